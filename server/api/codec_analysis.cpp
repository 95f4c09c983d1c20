#include "server/api/codec_analysis.hpp"

#include "server/api/codec_spec.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {
namespace {

constexpr double kAtMax_h = 1e9;
constexpr std::int64_t kCellCountMax = 10'000'000;
constexpr double kCellAreaMax_px = 4e8;  // a picture's own limit

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json typed(const char* type) { return {{"type", type}}; }
Json nullable(const char* type) { return {{"type", Json::array({type, "null"})}}; }
Json one_of(std::initializer_list<const char*> names) {
  Json list = Json::array();
  for (const char* name : names) list.push_back(name);
  return {{"enum", std::move(list)}};
}
Json or_null(Json schema) { return {{"anyOf", Json::array({std::move(schema), {{"type", "null"}}})}}; }
Json list(Json item) { return {{"type", "array"}, {"items", std::move(item)}}; }

Json common_properties(const char* kind) {
  Json properties = {{"id", typed("string")},
                     {"kind", {{"const", kind}}},
                     {"name", typed("string")},
                     {"state", one_of({"queued", "running", "succeeded", "failed"})},
                     {"failure_code", nullable("string")},
                     {"detail", nullable("string")}};
  properties["created_at"] = {{"type", "string"}, {"format", "date-time"}};
  properties["finished_at"] = {{"type", Json::array({"string", "null"})}, {"format", "date-time"}};
  return properties;
}

Json links(std::initializer_list<const char*> names) {
  Json properties = Json::object();
  for (const char* name : names) properties[name] = {{"type", "string"}, {"format", "uri-reference"}};
  return strict_object(std::move(properties));
}

Json fractal_properties() {
  const Json lines = {{"walls", reference("MeasuredLine")}, {"outline", reference("MeasuredLine")}};
  Json control = {{"name", one_of({"without_noise", "hexagonal", "random_discs"})},
                  {"placement", one_of({"same_places", "touching", "spread"})}};
  control.update(lines);
  return {{"fractal", strict_object(lines)}, {"controls", list(strict_object(std::move(control)))}};
}

Json picture_result() {
  Json properties = {{"image", reference("ImageMetadata")},
                     {"segmentation", reference("Segmentation")},
                     {"steps", list(strict_object({{"name", typed("string")}, {"text", typed("string")}}))},
                     {"verdict", list(typed("string"))},
                     {"object_kind", one_of({"cells", "nuclei", "regions", "objects"})},
                     {"object_count", typed("integer")},
                     {"object_area_mean_px", typed("number")},
                     {"object_cover", typed("number")}};
  properties.update(fractal_properties());
  properties["findings"] = reference("Findings");
  properties["threshold_sweep"] = reference("ThresholdSweep");
  properties["measurements"] = or_null(reference("Shapes"));
  properties["reason"] = nullable("string");
  return strict_object(std::move(properties));
}

Json match_properties() {
  return {{"match", one_of({"object_area", "um_per_px"})},
          {"cell_count", {{"type", Json::array({"integer", "null"})}, {"minimum", 1}, {"maximum", kCellCountMax}}},
          {"cell_area_px", {{"type", Json::array({"number", "null"})}, {"minimum", 1}, {"maximum", kCellAreaMax_px}}}};
}

Json comparison_result() {
  const Json kind = one_of({"cells", "nuclei", "regions", "objects"});
  Json hidden = typed("integer");
  hidden["description"] = "of the colony: cells or nuclei under others, in no figure; 0 of a picture, which hides what it hides";
  Json side = {{"um_per_px", nullable("number")},
               {"hidden_count", std::move(hidden)},
               {"object_kind", kind},
               {"object_count", typed("integer")},
               {"object_area_mean_px", typed("number")}};
  side.update(fractal_properties());
  side["findings"] = reference("Findings");
  const Json difference = or_null(strict_object({{"simulated", typed("number")},
                                                 {"real", typed("number")},
                                                 {"difference", typed("number")},
                                                 {"se", typed("number")},
                                                 {"differs", typed("boolean")},
                                                 {"range_px", list(typed("integer"))}}));
  Json match = match_properties();
  match["by"] = match["match"];
  match.erase("match");
  match["of"] = or_null(kind);
  match["area_px"] = nullable("number");
  Json real = side;
  real["threshold_sweep"] = reference("ThresholdSweep");
  return strict_object({{"time_h", typed("number")},
                        {"last_seq", typed("integer")},
                        {"digest", typed("string")},
                        {"match", strict_object(std::move(match))},
                        {"verdict", list(typed("string"))},
                        {"differences", strict_object({{"walls", difference}, {"outline", difference}})},
                        {"simulated", strict_object(side)},
                        {"real", strict_object(std::move(real))}});
}

Json page_of(std::string_view component) {
  return strict_object({{"items", list(reference(component))}, {"next", nullable("string")}});
}

}  // namespace

Result<ComparisonSpec> decode_comparison_spec(const Json& body) {
  if (!body.is_object()) return Error{ErrorCode::kInvalid, "the body is wrong", {{"", "must be an object"}}};
  ComparisonSpec spec;
  std::vector<FieldError> errors;
  const auto read_text = [&](const Json& value, const std::string& pointer, std::string& to) {
    if (value.is_string()) {
      to = value.get<std::string>();
    } else {
      errors.push_back({pointer, "must be a string"});
    }
  };
  for (const auto& [name, value] : body.items()) {
    const std::string pointer = child_pointer("", name);
    if (name == "job_id") {
      read_text(value, pointer, spec.job_id);
    } else if (name == "analysis_id") {
      read_text(value, pointer, spec.analysis_id);
    } else if (name == "name") {
      read_text(value, pointer, spec.name);
      if (const std::string wrong = name_error(spec.name); !wrong.empty()) errors.push_back({pointer, wrong});
    } else if (name == "at_h") {
      if (value.is_null()) continue;
      if (value.is_number() && value.get<double>() >= 0.0 && value.get<double>() <= kAtMax_h) {
        spec.at_h = value.get<double>();
      } else {
        errors.push_back({pointer, "must be a number within 0 to 1000000000, or null for now"});
      }
    } else if (name == "match") {
      if (value == "object_area" || value == "um_per_px") {
        spec.match.by = value == "um_per_px" ? MatchBy::kUmPerPx : MatchBy::kObjectArea;
      } else {
        errors.push_back({pointer, "must be object_area or um_per_px"});
      }
    } else if (name == "cell_count") {
      if (value.is_null()) continue;
      if (value.is_number_integer() && value >= 1 && value <= kCellCountMax) {
        spec.match.cell_count = value.get<std::int64_t>();
      } else {
        errors.push_back({pointer, "must be an integer within 1 to " + std::to_string(kCellCountMax) + ", or null"});
      }
    } else if (name == "cell_area_px") {
      if (value.is_null()) continue;
      if (value.is_number() && value.get<double>() >= 1.0 && value.get<double>() <= kCellAreaMax_px) {
        spec.match.cell_area_px = value.get<double>();
      } else {
        errors.push_back({pointer, "must be a number within 1 to 400000000, or null"});
      }
    } else {
      errors.push_back({pointer, "unknown field; there are job_id, analysis_id, at_h, name, match, cell_count and cell_area_px"});
    }
  }
  for (const char* name : {"job_id", "analysis_id"}) {
    if (!body.contains(name)) errors.push_back({child_pointer("", name), "is missing"});
  }
  if (spec.match.cell_count && spec.match.cell_area_px) errors.push_back({"/cell_area_px", "either this or cell_count"});
  if (spec.match.by == MatchBy::kUmPerPx && (spec.match.cell_count || spec.match.cell_area_px)) {
    errors.push_back({"/match", "um_per_px takes the scale from the analysis: cell_count and cell_area_px are for object_area"});
  }
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "the comparison is wrong", std::move(errors)};
  return spec;
}

Json encode_match_request(const MatchRequest& match) {
  return {{"match", name_of(match.by)},
          {"cell_count", match.cell_count ? Json(*match.cell_count) : Json(nullptr)},
          {"cell_area_px", match.cell_area_px ? Json(*match.cell_area_px) : Json(nullptr)}};
}

MatchRequest decode_match_request(const std::string& options_json) {
  const Json stored = Json::parse(options_json);
  MatchRequest match;
  if (!stored.contains("match")) return match;
  if (stored["match"] == name_of(MatchBy::kUmPerPx)) match.by = MatchBy::kUmPerPx;
  if (!stored["cell_count"].is_null()) match.cell_count = stored["cell_count"].get<std::int64_t>();
  if (!stored["cell_area_px"].is_null()) match.cell_area_px = stored["cell_area_px"].get<double>();
  return match;
}

Json encode_analysis(const AnalysisRow& row, bool with_result, std::string_view base_path) {
  const bool is_comparison = row.kind == AnalysisKind::kComparison;
  const std::string self = std::string(base_path) + (is_comparison ? "/v1/comparisons/" : "/v1/analyses/") + row.id;
  Json out = {{"id", row.id},
              {"kind", name_of(row.kind)},
              {"name", row.name},
              {"state", name_of(row.state)},
              {"failure_code", text_or_null(row.failure_code)},
              {"detail", text_or_null(row.detail)},
              {"created_at", row.created_at},
              {"finished_at", text_or_null(row.finished_at)}};
  if (is_comparison) {
    out["job_id"] = row.job_id;
    out["analysis_id"] = row.analysis_id;
  } else {
    out["media_type"] = row.media_type;
    out["image_bytes"] = row.image_bytes;
  }
  // Whole also where an older program stored fewer.
  out["options"] = Json::parse(row.options_json);
  out["options"].update(is_comparison ? encode_match_request(decode_match_request(row.options_json))
                                      : encode_image_options(decode_image_options(row.options_json)));
  if (with_result) out["result"] = row.result_json.empty() ? Json(nullptr) : Json::parse(row.result_json);
  out["links"] = {{"self", self}};
  if (is_comparison) {
    // Made again from what was compared: once that is deleted there is none.
    out["links"]["figure"] = row.has_source ? Json(self + "/figure") : Json(nullptr);
  } else {
    out["links"]["steps"] = self + "/steps";
    out["links"]["objects"] = self + "/objects";
  }
  return out;
}

Json encode_steps(const AnalysisRow& row, std::string_view base_path) {
  const std::string steps = std::string(base_path) + "/v1/analyses/" + row.id + "/steps/";
  Json items = Json::array();
  if (!row.result_json.empty()) {
    const Json result = Json::parse(row.result_json);
    for (const Json& step : result["steps"]) {
      items.push_back({{"name", step["name"]}, {"text", step["text"]}, {"href", steps + step["name"].get<std::string>()}});
    }
  }
  return {{"items", std::move(items)}, {"next", nullptr}};
}

Json analysis_components() {
  Json analysis = common_properties("analysis");
  analysis["media_type"] = one_of({"image/png", "image/tiff", "image/jpeg"});
  analysis["image_bytes"] = typed("integer");
  analysis["options"] = strict_object({{"um_per_px", nullable("number")},
                                       {"channel", nullable("integer")},
                                       {"pipeline", one_of({"auto", "nuclei", "phase", "contours"})},
                                       {"foreground", one_of({"auto", "light", "dark"})},
                                       {"threshold", nullable("integer")},
                                       {"clahe", typed("boolean")},
                                       {"split", typed("boolean")},
                                       {"area_min_px", nullable("integer")},
                                       {"hole_max_px", nullable("integer")},
                                       {"background_reach_px", nullable("integer")},
                                       {"window_radius_px", typed("integer")}});
  analysis["links"] = links({"self", "steps", "objects"});
  Json comparison = common_properties("comparison");
  comparison["job_id"] = comparison["analysis_id"] = typed("string");
  Json options = match_properties();
  Json spec_properties = options;
  options["at_h"] = typed("number");
  comparison["options"] = strict_object(std::move(options));
  comparison["links"] = links({"self", "figure"});
  spec_properties.update({{"job_id", typed("string")},
                          {"analysis_id", typed("string")},
                          {"at_h", {{"type", Json::array({"number", "null"})}, {"minimum", 0}, {"maximum", kAtMax_h}}},
                          {"name", typed("string")}});
  comparison["links"]["properties"]["figure"]["type"] = Json::array({"string", "null"});
  Json spec = {{"type", "object"},
               {"properties", std::move(spec_properties)},
               {"required", Json::array({"job_id", "analysis_id"})},
               {"additionalProperties", false}};
  Json components = {{"AnalysisSummary", strict_object(analysis)}, {"ComparisonSummary", strict_object(comparison)}};
  analysis["result"] = or_null(reference("PictureResult"));
  comparison["result"] = or_null(reference("ComparisonResult"));
  components.update({{"Analysis", strict_object(std::move(analysis))},
                     {"AnalysisList", page_of("AnalysisSummary")},
                     {"StepList", page_of("Step")},
                     {"Step", strict_object({{"name", typed("string")},
                                             {"text", typed("string")},
                                             {"href", {{"type", "string"}, {"format", "uri-reference"}}}})},
                     {"Comparison", strict_object(std::move(comparison))},
                     {"ComparisonList", page_of("ComparisonSummary")},
                     {"ComparisonSpec", std::move(spec)},
                     {"PictureResult", picture_result()},
                     {"ComparisonResult", comparison_result()}});
  return components;
}

}  // namespace colony::server::api
