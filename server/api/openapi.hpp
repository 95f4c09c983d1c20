// openapi: the OpenAPI 3.1 description, made from the table of endpoints and the tables of the codec.
// Promise: every status that an operation can answer is stated, each with a strict schema.
// Threads: pure.
#pragma once

#include <span>
#include <string_view>

#include "server/api/api.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

Json openapi_document(std::span<const Endpoint> table, const SpecLimits& limits, std::string_view version,
                      std::string_view base_path);

}  // namespace colony::server::api
