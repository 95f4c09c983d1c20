// wire: a response as bytes.
// Promises that a header never carries a control character, whatever a handler put there, and that exactly one of
//          Content-Length, chunks or the end of the connection tells where the body ends.
// Threads: pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/message.hpp"

namespace colony::server::http {

/// How the reader of a response finds the end of its body.
enum class Framing { kLength, kChunked, kUntilClose };

struct WireOptions {
  Framing framing = Framing::kLength;
  bool keep_alive = true;
  int version_minor = 1;  // of the request: a kept HTTP/1.0 connection must be told so
  std::string_view request_id;
  bool is_encrypted = false;          // then browsers are told to stay with https
  std::string_view cors_origin = {};  // of a foreign page that may read this answer; empty: none
  bool varies_by_origin = false;      // there are such pages at all
};

/// What a handler did that no response may carry, e.g. a line break in a header; nullopt if all is well.
std::optional<std::string> fault_of(const Response& response);

/// Status line and header, with the empty line. The response has no fault.
std::string write_head(const Response& response, const WireOptions& options);

/// Whether a response with this status has a body at all (204 and 304 have none).
bool has_body(int status);

std::string_view reason_phrase(int status);

/// The line before a chunk of a chunked body; `size` is not 0. The chunk ends with another CR LF.
std::string write_chunk_size(std::size_t size);
inline constexpr std::string_view kLastChunk = "0\r\n\r\n";
inline constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

/// RFC 9110, 5.6.7, e.g. "Sun, 06 Nov 1994 08:49:37 GMT".
std::string write_date(std::int64_t unix_time_s);

}  // namespace colony::server::http
