// submission: what every POST that makes a job has in common: the idempotency key, the name of its body, its answer.
// Threads: pure.
#pragma once

#include <string>
#include <string_view>

#include "server/api/api.hpp"

namespace colony::server::api {

/// The key of the request; empty: none.
Result<std::string> idempotency_key(const http::Request& request);
/// A name for a body as received: the same bytes after the same `what`, the same submission.
std::string hash_of_body(std::string_view what, const std::string& body);
/// Commands have no arguments: an empty body, or an empty object.
Status check_no_arguments(const std::string& body);
/// 201 for a new job, 200 for one that was there; with its Location.
http::Response submitted_response(const Context& context, const JobView& view, bool is_new);

}  // namespace colony::server::api
