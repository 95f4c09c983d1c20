// settings: which server, and with which token. Rising precedence: built-in default, config file, environment, flag.
// File:   $XDG_CONFIG_HOME/colony/config.toml or ~/.config/colony/config.toml; keys `server` and `token`; unknown keys
// are errors. Errors: Failure kUsage naming where the wrong value came from.
#pragma once

#include <string>

#include "client/cli/environment.hpp"

namespace colony::client {

struct Settings {
  std::string server = "http://127.0.0.1:8080";  // without a slash at the end
  std::string token;                             // empty: none is sent
};

/// `server_flag` empty: the flag was not given.
Settings read_settings(const Environment& env, const std::string& server_flag);

}  // namespace colony::client
