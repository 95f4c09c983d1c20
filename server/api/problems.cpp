#include "server/api/problems.hpp"

#include <array>

#include "engine/base/check.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {
namespace {

constexpr std::array<ProblemRow, 18> kTable = {{
    {ProblemKind::kMalformed, 400, "malformed", "The request cannot be read", 0},
    {ProblemKind::kInvalid, 422, "invalid", "Fields of the request are wrong", 0},
    {ProblemKind::kNotFound, 404, "not-found", "There is no such thing", 0},
    {ProblemKind::kJobTerminal, 409, "job-terminal", "The job has ended", 0},
    {ProblemKind::kJobNotTerminal, 409, "job-not-terminal", "The job has not ended", 0},
    {ProblemKind::kKeyReused, 422, "idempotency-key-reused", "The idempotency key was used with another body", 0},
    {ProblemKind::kTimeNotReached, 409, "time-not-reached", "The job has not reached this time", 0},
    {ProblemKind::kLimit, 422, "limit", "A limit would be exceeded", 0},
    {ProblemKind::kBusy, 429, "queue-full", "The queue is full", 10},
    {ProblemKind::kOccupied, 503, "busy", "The server is at work on another one", 5},
    {ProblemKind::kStorage, 503, "storage", "The storage refused", 10},
    {ProblemKind::kUnavailable, 503, "unavailable", "The server is not ready", 5},
    {ProblemKind::kInternal, 500, "internal", "A bug in the server", 0},
    {ProblemKind::kUnsupportedMediaType, 415, "unsupported-media-type", "The body is of another type than this takes", 0},
    {ProblemKind::kNotAcceptable, 406, "not-acceptable", "None of the accepted media types is offered", 0},
    {ProblemKind::kEngineChanged, 409, "engine-changed", "The job is of a version that gives other results", 0},
    {ProblemKind::kPreconditionFailed, 412, "precondition-failed", "The resource is not as the request supposes", 0},
    {ProblemKind::kLastAdmin, 409, "last-admin-token", "It is the last token with which tokens can be made", 0},
}};

http::Response problem_document(const ProblemRow& row, const Error& error, std::string_view request_id) {
  Json body = {{"type", "urn:colony:problem:" + std::string(row.code)},
               {"title", row.title},
               {"status", row.status},
               {"detail", error.message},
               {"request_id", request_id}};
  if (!error.fields.empty()) {
    Json& fields = body["errors"] = Json::array();
    if (error.fields.size() > kProblemErrorsMax) {
      body["detail"] = error.message + " (the first " + std::to_string(kProblemErrorsMax) + " of " +
                       std::to_string(error.fields.size()) + " errors are listed)";
    }
    for (const FieldError& field : error.fields) {
      if (fields.size() >= kProblemErrorsMax) break;
      const bool is_pointer = field.pointer.empty() || field.pointer.front() == '/';
      fields.push_back({{is_pointer ? "pointer" : "parameter", field.pointer}, {"message", field.message}});
    }
  }
  http::Response response;
  response.status = row.status;
  response.headers.set("Content-Type", "application/problem+json");
  if (row.retry_after_s > 0) response.headers.set("Retry-After", std::to_string(row.retry_after_s));
  response.body = to_text(body);
  return response;
}

}  // namespace

std::span<const ProblemRow> problem_table() { return kTable; }

const ProblemRow& problem_row(ProblemKind kind) {
  const ProblemRow& row = kTable[static_cast<std::size_t>(kind)];
  CHECK(row.kind == kind);
  return row;
}

ProblemKind problem_kind_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kMalformed:
      return ProblemKind::kMalformed;
    case ErrorCode::kInvalid:
      return ProblemKind::kInvalid;
    case ErrorCode::kNotFound:
      return ProblemKind::kNotFound;
    case ErrorCode::kConflict:
      return ProblemKind::kJobTerminal;
    case ErrorCode::kKeyReused:
      return ProblemKind::kKeyReused;
    case ErrorCode::kNotReached:
      return ProblemKind::kTimeNotReached;
    case ErrorCode::kLimit:
      return ProblemKind::kLimit;
    case ErrorCode::kBusy:
      return ProblemKind::kBusy;
    case ErrorCode::kStorage:
      return ProblemKind::kStorage;
    case ErrorCode::kUnavailable:
      return ProblemKind::kUnavailable;
    case ErrorCode::kInternal:
      return ProblemKind::kInternal;
  }
  return ProblemKind::kInternal;
}

http::Response problem_response(ProblemKind kind, const Error& error, std::string_view request_id) {
  const ProblemRow& row = problem_row(kind);
  // Why a bug showed itself is the operator's to know: expressions and paths of the source, what the database said.
  if (row.status == 500) {
    const Error told{error.code, "the server's log has more under this request_id", {}};
    http::Response response = problem_document(row, told, request_id);
    response.failure = error.message;
    return response;
  }
  return problem_document(row, error, request_id);
}

http::Response problem_response(const Error& error, std::string_view request_id) {
  return problem_response(problem_kind_of(error.code), error, request_id);
}

}  // namespace colony::server::api
