#include "server/api/codec_spec.hpp"

#include <algorithm>
#include <array>

#include "server/api/codec_model.hpp"
#include "server/api/suggest.hpp"

namespace colony::server::api {
namespace {

constexpr std::array<std::string_view, 6> kSpecNames = {"name", "labels", "seed", "preset", "until", "model"};
constexpr std::array<std::string_view, 2> kUntilNames = {"time_h", "cells"};

constexpr const char* kSummary = "the job spec is wrong; nothing was stored";

using Errors = std::vector<FieldError>;

void check_names(const Json& object, const std::string& pointer, std::span<const std::string_view> known,
                 Errors& errors) {
  for (const auto& [name, value] : object.items()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::string hint = suggestion(name, known);
    for (const ParamInfo& info : param_table()) {
      const std::string_view path = info.path;
      if (path == name || path.substr(path.find('.') + 1) == name || path.substr(0, path.find('.')) == name) {
        hint = ", did you mean model." + std::string(path.substr(0, path.find('.')) == name ? name : path) + "?";
        break;
      }
    }
    errors.push_back({child_pointer(pointer, name), "unknown field" + hint});
  }
}

void decode_name(const Json& json, JobSpec& spec, Errors& errors) {
  if (!json.is_string()) return errors.push_back({"/name", "must be a string"});
  const std::string& name = json.get_ref<const std::string&>();
  if (std::string wrong = name_error(name); !wrong.empty()) return errors.push_back({"/name", std::move(wrong)});
  spec.name = name;
}

void decode_labels(const Json& json, JobSpec& spec, Errors& errors) {
  if (!json.is_object()) return errors.push_back({"/labels", "must be an object of strings"});
  if (json.size() > kLabelsMax)
    errors.push_back({"/labels", "must have at most " + std::to_string(kLabelsMax) + " labels"});
  for (const auto& [key, value] : json.items()) {
    const std::string at = child_pointer("/labels", key);
    const std::string wrong_key = label_key_error(key);
    if (!wrong_key.empty()) errors.push_back({at, wrong_key});
    if (!value.is_string()) {
      errors.push_back({at, "must be a string"});
    } else if (std::string wrong = label_value_error(value.get_ref<const std::string&>()); !wrong.empty()) {
      errors.push_back({at, std::move(wrong)});
    } else {
      spec.labels[key] = value.get<std::string>();
    }
  }
}

void decode_seed(const Json& json, JobSpec& spec, Errors& errors) {
  const auto seed = integer_of(json);
  if (!seed || *seed < 0 || static_cast<Seed>(*seed) > kSeedMax) {
    return errors.push_back({"/seed", "must be an integer within 0 to " + std::to_string(kSeedMax)});
  }
  spec.run.seed = static_cast<Seed>(*seed);
}

void decode_preset(const Json& json, JobSpec& spec, Errors& errors) {
  std::string names;
  for (const std::string_view name : preset_names()) names += (names.empty() ? "" : ", ") + std::string(name);
  if (!json.is_string()) return errors.push_back({"/preset", "must be one of " + names});
  const std::string& name = json.get_ref<const std::string&>();
  if (const auto params = preset(name)) {
    spec.preset = name;
    spec.run.params = *params;
    return;
  }
  errors.push_back({"/preset", "must be one of " + names + suggestion(name, preset_names())});
}

void decode_until(const Json* json, const SpecLimits& limits, JobSpec& spec, Errors& errors) {
  if (json == nullptr) return errors.push_back({"/until", "is missing: a job needs until.time_h or until.cells"});
  if (!json->is_object()) return errors.push_back({"/until", "must be an object with time_h, cells or both"});
  check_names(*json, "/until", kUntilNames, errors);
  if (const auto time = json->find("time_h"); time != json->end()) {
    const double time_h = time->is_number() ? time->get<double>() : -1.0;
    if (time_h > 0.0 && time_h <= kUntilTimeMax_h)
      spec.run.until.time_h = time_h;
    else
      errors.push_back({"/until/time_h", "must be a number above 0, at most 100000 h"});
  }
  if (const auto cells = json->find("cells"); cells != json->end()) {
    const auto count = integer_of(*cells);
    if (count && *count >= 1 && static_cast<std::uint64_t>(*count) <= limits.cells_max) {
      spec.run.until.cells = static_cast<std::uint64_t>(*count);
    } else {
      errors.push_back({"/until/cells", "must be an integer within 1 to " + std::to_string(limits.cells_max)});
    }
  }
  if (!json->contains("time_h") && !json->contains("cells")) {
    errors.push_back({"/until", "has no bound: a job needs until.time_h or until.cells"});
  }
  if (spec.run.until.cells && !json->contains("time_h")) spec.run.until.time_h = kUntilTimeImplied_h;
}

void check_founder_count(const RunSpec& run, const SpecLimits& limits, Errors& errors) {
  const std::uint64_t count = founder_count(run.params.founders);
  if (count > limits.cells_max) {
    errors.push_back(
        {"/model/founders", "must be at most " + std::to_string(limits.cells_max) + ", the limit of cells in a job"});
  }
  if (run.until.cells && count > *run.until.cells) {
    errors.push_back({"/until/cells", "must be at least the number of founders, " + std::to_string(count)});
  }
}

void decode_members(const Json& body, const SpecLimits& limits, JobSpec& spec, Errors& errors) {
  const auto member = [&](const char* name) -> const Json* {
    const auto found = body.find(name);
    return found == body.end() ? nullptr : &*found;
  };
  if (const Json* json = member("name")) decode_name(*json, spec, errors);
  if (const Json* json = member("labels")) decode_labels(*json, spec, errors);
  if (const Json* json = member("seed")) decode_seed(*json, spec, errors);
  decode_until(member("until"), limits, spec, errors);
  if (const Json* json = member("model")) decode_model(*json, "/model", spec.run.params, errors);
}

// `limits` absent: a stored spec.
Result<JobSpec> decode(const Json& body, const SpecLimits* limits) {
  if (!body.is_object()) return Error{ErrorCode::kInvalid, kSummary, {{"", "must be an object"}}};
  JobSpec spec;
  spec.run.seed = kSeedDefault;
  spec.run.params = *preset(kPresetDefault);
  Errors errors;
  check_names(body, "", kSpecNames, errors);
  if (const auto json = body.find("preset"); json != body.end()) decode_preset(*json, spec, errors);  // the model is over it
  decode_members(body, limits == nullptr ? SpecLimits{} : *limits, spec, errors);
  const auto in_model = [](const FieldError& error) { return error.pointer.starts_with("/model"); };
  if (limits != nullptr && std::none_of(errors.begin(), errors.end(), in_model)) check_founder_count(spec.run, *limits, errors);
  if (!errors.empty()) return Error{ErrorCode::kInvalid, kSummary, std::move(errors)};
  return spec;
}

}  // namespace

std::string name_error(std::string_view name) {
  if (code_point_count(name) > kNameCharactersMax) {
    return "must have at most " + std::to_string(kNameCharactersMax) + " characters";
  }
  return has_control_character(name) ? "must not contain control characters" : "";
}

std::string label_key_error(std::string_view key) {
  const bool right = !key.empty() && key.size() <= kLabelKeyBytesMax && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '.' || c == '-';
  });
  return right ? "" : "the key must be 1 to 63 of a-z, 0-9, '_', '.' and '-'";
}

std::string label_value_error(std::string_view value) {
  if (value.size() > kLabelValueBytesMax) return "must be at most " + std::to_string(kLabelValueBytesMax) + " bytes";
  if (has_control_character(value)) return "must not contain control characters";
  return {};
}

Result<JobSpec> decode_spec(const Json& body, const SpecLimits& limits) { return decode(body, &limits); }

Status check_founders(const RunSpec& spec, StopFlag stop) {
  const auto placed = place_founders(spec, stop);
  if (placed) return Ok{};
  Errors errors;
  for (const FieldError& field : placed.error().fields) errors.push_back({"/model" + field.pointer, field.message});
  if (errors.empty()) errors.push_back({"/model/founders", placed.error().message});
  return Error{ErrorCode::kInvalid, kSummary, std::move(errors)};
}

Json encode_spec(const JobSpec& spec) {
  Json until = Json::object();
  if (spec.run.until.time_h) until["time_h"] = *spec.run.until.time_h;
  if (spec.run.until.cells) until["cells"] = *spec.run.until.cells;
  return {{"seed", spec.run.seed}, {"preset", spec.preset}, {"until", until}, {"model", encode_model(spec.run.params)}};
}

Result<JobSpec> decode_stored_job_spec(const std::string& spec_json) {
  const auto json = parse_json(spec_json);
  if (!json) return json.error();
  return decode(*json, nullptr);
}

void decode_spec_members(const Json& body, const SpecLimits& limits, JobSpec& spec, std::vector<FieldError>& errors) {
  decode_members(body, limits, spec, errors);
}

void check_spec_names(const Json& body, std::span<const std::string_view> known, std::vector<FieldError>& errors) {
  check_names(body, "", known, errors);
}

Result<RunSpec> decode_stored_spec(const std::string& spec_json) {
  auto spec = decode_stored_job_spec(spec_json);
  if (!spec) return spec.error();
  return std::move(spec->run);
}

NewJob new_job(const JobSpec& spec) {
  NewJob job;
  job.name = spec.name;
  job.labels = spec.labels;
  job.spec_json = to_text(encode_spec(spec));
  job.until_time_h = spec.run.until.time_h;
  job.until_cells = spec.run.until.cells;
  return job;
}

}  // namespace colony::server::api
