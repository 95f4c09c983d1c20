// schema: JSON Schemas (2020-12) of what goes in and comes out, made from the same tables as the codec.
// Promise: the schema of a job spec accepts what the codec accepts, up to rules between fields, which are in the texts.
// Threads: pure.
#pragma once

#include "server/api/codec_spec.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

Json job_spec_schema(const SpecLimits& limits);
/// The body of a fork: parts of a job spec, and where it begins.
Json fork_spec_schema(const SpecLimits& limits);
/// `model` of a job spec; complete: as the server gives it back, with every parameter required.
Json model_schema(bool is_complete);
/// components/schemas of openapi.json.
Json component_schemas(const SpecLimits& limits);

/// {"type": "object", "properties": ..., "required": all of them, "additionalProperties": false}
Json strict_object(Json properties);
Json reference(std::string_view component);
/// The type words of a parameter: "number", "integer or null", ...
std::string param_type_name(const ParamInfo& info);

/// Of `labels`, as submitted.
Json labels_schema();

}  // namespace colony::server::api
