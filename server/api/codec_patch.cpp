#include "server/api/codec_patch.hpp"

#include <algorithm>
#include <vector>

#include "server/api/codec_spec.hpp"
#include "server/api/schema.hpp"
#include "server/api/suggest.hpp"

namespace colony::server::api {
namespace {

constexpr std::string_view kNames[] = {"name", "labels"};
constexpr std::string_view kFixed[] = {"id",         "kind",        "state",    "reason",   "detail", "submitted_by",   "created_at",
                                       "started_at", "finished_at", "revision", "last_seq", "digest", "engine_version", "origin",
                                       "spec",       "progress",    "links"};

void decode_label(const std::string& key, const Json& value, JobTextChange& change, std::vector<FieldError>& errors) {
  const std::string at = child_pointer("/labels", key);
  if (std::string wrong = label_key_error(key); !wrong.empty()) errors.push_back({at, std::move(wrong)});
  if (value.is_null()) {
    change.labels[key] = std::nullopt;
  } else if (!value.is_string()) {
    errors.push_back({at, "must be a string, or null to take the label away"});
  } else {
    const auto& text = value.get_ref<const std::string&>();
    if (std::string wrong = label_value_error(text); !wrong.empty()) errors.push_back({at, std::move(wrong)});
    change.labels[key] = text;
  }
}

void decode_member(const std::string& name, const Json& value, JobTextChange& change, std::vector<FieldError>& errors) {
  if (name == "name") {
    if (!value.is_null() && !value.is_string()) {
      errors.push_back({"/name", "must be a string, or null to take it away"});
      return;
    }
    change.name = value.is_null() ? std::string() : value.get<std::string>();
    if (std::string wrong = name_error(*change.name); !wrong.empty()) errors.push_back({"/name", std::move(wrong)});
  } else if (name == "labels") {
    if (!value.is_null() && !value.is_object()) {
      errors.push_back({"/labels", "must be an object, or null to take all labels away"});
      return;
    }
    change.drops_labels = value.is_null();
    if (value.is_null()) return;
    for (const auto& [key, text] : value.items()) decode_label(key, text, change, errors);
  } else {
    const bool is_fixed = std::find(std::begin(kFixed), std::end(kFixed), name) != std::end(kFixed);
    errors.push_back({child_pointer("", name), is_fixed ? "cannot be changed; only name and labels can"
                                                        : "unknown field" + suggestion(name, kNames)});
  }
}

}  // namespace

Result<JobTextChange> decode_job_patch(const Json& patch) {
  constexpr const char* kSummary = "the patch is wrong; nothing was changed";
  if (!patch.is_object()) return Error{ErrorCode::kInvalid, kSummary, {{"", "must be an object"}}};
  JobTextChange change;
  change.labels_max = kLabelsMax;
  std::vector<FieldError> errors;
  for (const auto& [name, value] : patch.items()) decode_member(name, value, change, errors);
  if (!errors.empty()) return Error{ErrorCode::kInvalid, kSummary, std::move(errors)};
  return change;
}

Json job_patch_schema() {
  const Json submitted = labels_schema();
  Json value = submitted["additionalProperties"];
  value["type"] = Json::array({"string", "null"});
  return {{"type", "object"},
          {"description", "a merge patch (RFC 7386): null takes away, what is not named stays"},
          {"properties",
           {{"name",
             {{"type", Json::array({"string", "null"})},
              {"maxLength", kNameCharactersMax},
              {"description", "null: no name"}}},
            {"labels",
             {{"type", Json::array({"object", "null"})},
              {"propertyNames", submitted["propertyNames"]},
              {"additionalProperties", std::move(value)},
              {"description", "null: no labels; a label that is null is taken away"}}}}},
          {"additionalProperties", false},
          {"examples", Json::array({{{"name", "plate 7, again"}, {"labels", {{"plate", "8"}, {"draft", nullptr}}}}})}};
}

}  // namespace colony::server::api
