// version: what a stored history was made by.
// kResultsVersion grows whenever the same spec and seed would give other bytes (a CHANGELOG line under Results); a history
// begun under one results version is never continued silently under another.
#pragma once

#include <string>
#include <string_view>

namespace colony {

inline constexpr std::string_view kEngineVersion = "0.1.0";
inline constexpr int kResultsVersion = 2;

/// As stored with every job: "0.1.0/1", program version / results version.
inline std::string engine_version_text() { return std::string(kEngineVersion) + "/" + std::to_string(kResultsVersion); }

/// The results version in such a text; -1 if there is none.
inline int results_version_of(std::string_view engine_version) {
  const std::size_t slash = engine_version.rfind('/');
  if (slash == std::string_view::npos || slash + 1 == engine_version.size() || engine_version.size() - slash > 9) return -1;
  int version = 0;
  for (const char digit : engine_version.substr(slash + 1)) {
    if (digit < '0' || digit > '9') return -1;
    version = 10 * version + (digit - '0');
  }
  return version;
}

}  // namespace colony
