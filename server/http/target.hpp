// target: the request target and the authorities of Host and Origin, taken apart strictly.
// Promises that a decoded path starts with '/', is UTF-8, and has no dot segment, no control character and no '/' that
//          was escaped: a path that passed means the same to every reader after the gate. A decoded query is UTF-8
//          and has no NUL.
// Does not resolve anything: "." and ".." are refused, never folded; "//" stays two slashes (and finds no route).
// Errors:  a sentence for the client. Threads: pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/result.hpp"

namespace colony::server::http {

struct Authority {
  std::string host;                   // lower case; an IPv6 address with its brackets
  std::optional<std::uint16_t> port;  // absent: not written
  friend bool operator==(const Authority&, const Authority&) = default;
};

/// host[:port] without user information; the port, if there is a colon, is 1 to 5 digits.
std::optional<Authority> parse_authority(std::string_view text);

struct Target {
  std::optional<Authority> authority;  // of the absolute form
  std::string path;
  std::vector<std::pair<std::string, std::string>> query;
  bool is_bare = false;                // the absolute form of a host alone: its path, "/", was not written, and no query
};

/// What OPTIONS may have instead of a path: the server itself (RFC 9110, 9.3.7); a host alone is the same (RFC 9112, 3.2.4).
inline constexpr std::string_view kServerTarget = "*";

/// Origin form ("/v1/jobs?x=1") or absolute form with scheme http. In a query '+' is a space, as in HTML forms.
Result<Target> parse_target(std::string_view text);

/// Each %XX becomes its byte; nullopt on an incomplete or non-hexadecimal escape.
std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space);

}  // namespace colony::server::http
