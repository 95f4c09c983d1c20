// log: what colonyd says while it runs, one line an event: as text for people, or as JSON for machines.
// Promise: one line whatever the content (control characters are escaped); no query, no header, no body, and nothing that looks
//          like a token is ever in it, at any level.
// Threads: the functions are pure; where the lines go is main.cpp's affair.
#pragma once

#include <string>
#include <string_view>

#include "server/http/message.hpp"
#include "server/http/server.hpp"

namespace colony::server {

enum class LogFormat { kText, kJson };

struct LogLine {
  std::string level;  // "info", "warning", "error"
  std::string text;   // kJson: an object without a line break; kText: what stands after time and level
};

/// `time`: RFC 3339; it is in the JSON only (text gets its time from the sink).
LogLine log_event(LogFormat format, std::string_view time, std::string_view level, std::string_view message);
LogLine log_access(LogFormat format, std::string_view time, const http::AccessRecord& record);
/// What a handler or a stream threw, or why a handler answered 500.
LogLine log_failure(LogFormat format, std::string_view time, const http::Request& request, std::string_view what);

}  // namespace colony::server
