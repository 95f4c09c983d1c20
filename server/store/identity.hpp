// identity: names that the store gives: job ids, cursors, wall times.
// Threads: pure but for the clock and the system's randomness.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace colony::server {

/// Now, RFC 3339 UTC with milliseconds: 2026-11-22T05:36:07.123Z.
std::string wall_time_text();
/// Of a moment, ms since 1970, in the same form, and back; nullopt for any other text. Texts of the years 0..9999 sort as the moments do.
std::string wall_time_text_at(std::int64_t unix_ms);
std::optional<std::int64_t> unix_ms_of(std::string_view text);
/// Now, ms since 1970.
std::int64_t wall_time_ms();

/// A new UUID of version 7, lower case: milliseconds since 1970, then 74 random bits.
std::string new_job_id();

/// A place in the list of jobs as 32 hex digits: the key, and a hash of it with this database's salt, so that a cursor that
/// the store did not give is refused instead of being taken for another place.
std::string cursor_text(std::int64_t job_key, std::int64_t salt);
std::optional<std::int64_t> cursor_key(std::string_view text, std::int64_t salt);

}  // namespace colony::server
