// json: strict JSON text to a value, and back.
// Promise: what is accepted has exactly one reading: duplicate names, U+0000, a byte order mark, invalid UTF-8, nesting
//          over kJsonDepthMax, literals that overflow a double and anything after the value are errors.
// Errors:  kMalformed, with the byte offset in the message; for a duplicate or forbidden member also its JSON Pointer.
// Threads: pure.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "engine/base/result.hpp"

namespace colony::server::api {

/// Members keep their order, so that answers read as they are documented.
using Json = nlohmann::ordered_json;

inline constexpr std::size_t kJsonDepthMax = 32;
inline constexpr std::size_t kJsonMembersMax = 1000;  // of one object: finding a duplicate is then bounded work

Result<Json> parse_json(std::string_view text);

/// Compact text; doubles round-trip. Bytes that are not UTF-8 (only ever an echo of bad input) become U+FFFD.
std::string to_text(const Json& json);

/// `pointer` with one more reference token, escaped (RFC 6901).
std::string child_pointer(std::string_view pointer, std::string_view token);

/// True for valid UTF-8 without U+0000.
bool is_text(std::string_view bytes);
/// Code points of valid UTF-8.
std::size_t code_point_count(std::string_view text);
/// True if a C0, DEL or C1 control character is in valid UTF-8.
bool has_control_character(std::string_view text);

/// The value of an integral JSON number (1, 1.0 and 1e0 are the same number, as in JSON Schema); nullopt otherwise, and
/// for numbers that no int64 holds.
std::optional<std::int64_t> integer_of(const Json& json);

}  // namespace colony::server::api
