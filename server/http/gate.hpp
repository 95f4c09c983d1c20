// gate: decides from the raw bytes of a request header whether anything after it may see the request.
// Why raw: a parser that has already folded lines, merged duplicates or dropped blanks hides exactly the shapes by
//          which two readers of one connection come to disagree about where a request ends. Nothing here is lenient.
// Promises that a head that passed has one framing (a length or chunked, never both), one allowed Host, no foreign
//          Origin, a clean target (or "*" with OPTIONS, and no other method), and a known method.
// Errors:  a Refusal, which the session sends as a problem document and then closes the connection.
// Threads: pure functions over bytes; no socket is needed to test or to fuzz them.
// Source:  RFC 9112, RFC 9110.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.hpp"
#include "server/http/target.hpp"

namespace colony::server::http {

struct GatePolicy {
  std::vector<std::string> allowed_hosts;  // lower case, without port
  std::uint16_t port = 0;                  // ours: an Origin with it is our own page
  std::size_t header_bytes_max = 0;
  std::size_t header_fields_max = 0;
  std::size_t target_bytes_max = 0;
  std::size_t body_bytes_max = 0;
  std::string large_body_path = {};      // with the base path; a POST there may have a larger body. Empty: none
  std::size_t large_body_bytes_max = 0;
  std::vector<std::string> cors_origins = {};  // other sites whose pages may ask, as an Origin says them, lower case
};

struct Refusal {
  int status = 400;
  std::string code;  // of the problem type
  std::string title;
  std::string detail;
  std::string challenge = {};        // WWW-Authenticate; empty: none
  std::int64_t retry_after_s = 0;    // 0: no Retry-After
};

/// Finds the end of a header in bytes that arrive in pieces, each byte looked at once.
class HeadScanner {
 public:
  enum class State { kNeedMore, kComplete, kRefused };
  /// `bytes` is all that came since the header began; it only grows between calls.
  State scan(std::string_view bytes, const GatePolicy& policy);
  std::size_t head_size() const { return position_; }  // after kComplete: with the empty line
  const Refusal& refusal() const { return refusal_; }  // after kRefused

 private:
  State refuse(Refusal refusal);

  std::size_t position_ = 0;  // bytes before it have been looked at
  std::size_t line_begin_ = 0;
  bool first_line_ended_ = false;
  Refusal refusal_;
};

struct RequestHead {
  std::string method;
  Target target;
  int version_minor = 1;  // HTTP/1.minor
  Headers headers;
  std::optional<std::uint64_t> content_length;
  bool chunked = false;
  std::size_t body_bytes_max = 0;   // of this request
  bool may_be_large = false;        // its body can exceed what any request may have
  bool keep_alive = true;
  bool expects_continue = false;
  std::string request_id;  // the client's if it is acceptable, else empty
  std::string cors_origin;  // the Origin, if it is one of cors_origins; else empty
};

/// `bytes` is a header as HeadScanner found it. What could be read before a refusal stands in `head`, for
/// the log and the request id.
std::optional<Refusal> examine(std::string_view bytes, const GatePolicy& policy, RequestHead& head);

}  // namespace colony::server::http
