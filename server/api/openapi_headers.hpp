// openapi_headers: the part of openapi.json about header fields, and the groups of operations.
// Promise: a field of an answer that means something to a client is stated; the system tests hold every answer against it.
// Threads: pure.
#pragma once

#include <string_view>

#include "server/api/api.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

/// Adds what an operation reads from the header of a request.
void add_header_parameters(const Endpoint& endpoint, Json& parameters);
/// Of a success or a 304.
Json answer_headers(const Endpoint& endpoint, int status);
Json problem_headers(const Endpoint& endpoint, int status);

/// The group of an operation, and all groups in the order in which they are read.
std::string_view tag_of(const Endpoint& endpoint);
Json tag_list();

}  // namespace colony::server::api
