// codec_model: the parameters of the model between JSON and Params, driven by the parameter table.
// Threads: pure.
#pragma once

#include <string>
#include <vector>

#include "engine/model/params.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

/// Overrides fields of `params` by those of `model` and checks the whole. Pointers begin with `pointer`.
void decode_model(const Json& model, const std::string& pointer, Params& params, std::vector<FieldError>& errors);

Json encode_model(const Params& params);

/// One parameter as JSON: number, true/false, name, [low, high], list of positions, null.
Json encode_param(const ParamInfo& info, const Params& params);

}  // namespace colony::server::api
