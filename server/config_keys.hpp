// config_keys: the one table of what can be configured; file, environment, flags and --help follow it.
// Threads: pure.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/config.hpp"

namespace colony::server {

inline constexpr std::uint64_t kThreadsMax = 256;  // of a job, and jobs at a time

struct ConfigKey {
  enum class Type { kText, kInteger, kTexts, kBoolean };
  std::string name;  // "jobs.concurrent_max"
  Type type;
  std::string text;
  // Takes the value in its text form (kTexts: separated by commas); answers what is wrong with it, or nothing.
  std::function<std::string(Config&, const std::string&)> set;
};

const std::vector<ConfigKey>& config_keys();

bool is_loopback(const std::string& host);
std::optional<double> to_number(std::string_view text);  // finite, in full

}  // namespace colony::server
