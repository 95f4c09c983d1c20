// settings: which server, and with which token. Rising precedence: built-in default, config file, environment, flag.
// File:   $XDG_CONFIG_HOME/colony/config.toml or ~/.config/colony/config.toml; keys `server`, `token` and `ca_file`; unknown
// keys are errors. A token is never part of a message. Errors: Failure kUsage naming where the wrong value came from.
#pragma once

#include <string>

#include "client/cli/environment.hpp"

namespace colony::client {

struct Settings {
  std::string server = "http://127.0.0.1:8080";  // without a slash at the end
  std::string token;                             // empty: none is sent
  std::string ca_file;                           // certificates that are trusted for https; empty: the system's
};

/// A flag that is empty was not given. Errors also: a token for a server that is not on this machine and not https, since it would
/// travel in the clear.
Settings read_settings(const Environment& env, const std::string& server_flag, const std::string& ca_file_flag);

/// Whether the URL names this machine.
bool is_loopback(const std::string& server);

}  // namespace colony::client
