// examples: what openapi.json shows beside its schemas. The system tests send every request example and hold its answer against `x-answer`, the
//           status it states; they hold every other example against its schema.
// Why encoded, not written: an example of an answer is made by the very codec that makes answers, so it cannot fall behind it.
// Threads: pure.
#pragma once

#include <string_view>

#include "server/api/json.hpp"
#include "server/api/query.hpp"

namespace colony::server::api {

/// Examples of a JSON request body: name -> {summary, value, x-answer}; null where an operation has none. Ids in them are stand-ins.
Json request_examples(std::string_view operation_id);

/// A value that the parameter accepts, in the form of its schema; null where no value can be known beforehand (a cursor).
Json parameter_example(const QueryParam& param);

/// Adds `examples` to the schemas of components/schemas that have some.
void add_component_examples(Json& schemas);

/// The stand-in for any id: a UUIDv7 that no server gives out (its time is that of the paper's year).
inline constexpr std::string_view kExampleId = "00d5b1f3-7c00-7a1e-8c3d-5f0e9b7a2d46";

}  // namespace colony::server::api
