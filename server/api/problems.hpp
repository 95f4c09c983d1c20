// problems: the one table from what went wrong to a problem document (RFC 9457) and an HTTP status.
// Promise: every error answer of the API has type, title, status, detail, request_id and, where fields are at fault,
// errors. Threads: pure.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/result.hpp"
#include "server/http/message.hpp"

namespace colony::server::api {

enum class ProblemKind {
  kMalformed,
  kInvalid,
  kNotFound,
  kJobTerminal,
  kJobNotTerminal,
  kKeyReused,
  kTimeNotReached,
  kLimit,
  kBusy,
  kOccupied,
  kStorage,
  kUnavailable,
  kInternal,
  kUnsupportedMediaType,
  kNotAcceptable,
  kEngineChanged,
  kPreconditionFailed,
  kLastAdmin
};

/// Of one document; a list of 100,000 wrong positions needs no 100,000 lines of answer. The detail says how many there
/// are.
inline constexpr std::size_t kProblemErrorsMax = 1000;

struct ProblemRow {
  ProblemKind kind;
  int status;
  std::string_view code;  // of urn:colony:problem:<code>
  std::string_view title;
  int retry_after_s;  // 0: no Retry-After
};

/// Every problem that a handler can answer, in the order of ProblemKind.
std::span<const ProblemRow> problem_table();
const ProblemRow& problem_row(ProblemKind kind);
ProblemKind problem_kind_of(ErrorCode code);

/// The problem document of an error. A field whose name is empty or begins with '/' is a JSON Pointer into the body,
/// any other the name of a query parameter or header. Of a 500 the document says that the log has more; the error's own message is
/// Response::failure, for the log alone.
http::Response problem_response(ProblemKind kind, const Error& error, std::string_view request_id);
http::Response problem_response(const Error& error, std::string_view request_id);

}  // namespace colony::server::api
