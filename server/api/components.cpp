// The schemas of everything that comes out (components/schemas of openapi.json).
#include <array>

#include "server/api/codec_analysis.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/codec_patch.hpp"
#include "server/api/handlers_tokens.hpp"
#include "server/api/codec_report.hpp"
#include "server/api/problems.hpp"
#include "server/api/schema.hpp"
#include "server/api/shape_table.hpp"

namespace colony::server::api {
namespace {

Json typed(const char* type) { return {{"type", type}}; }
Json nullable(const char* type) { return {{"type", Json::array({type, "null"})}}; }
Json count() { return {{"type", "integer"}, {"minimum", 0}}; }
Json nullable_share() { return {{"type", Json::array({"number", "null"})}, {"minimum", 0}, {"maximum", 1}}; }
Json vec3() { return {{"type", "array"}, {"items", typed("number")}, {"minItems", 3}, {"maxItems", 3}}; }
Json digest() { return {{"type", "string"}, {"pattern", "^[0-9a-f]{32}$"}}; }
Json cell_id() { return {{"type", "integer"}, {"minimum", 1}, {"maximum", kCellIdMax}}; }
Json wall_time(bool may_be_null) {
  Json schema = may_be_null ? nullable("string") : typed("string");
  schema["format"] = "date-time";
  return schema;
}
Json list_of(std::string_view component) { return {{"type", "array"}, {"items", reference(component)}}; }

Json job_id() {
  return {{"type", "string"}, {"pattern", "^[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$"}};
}

template <class Row>
Json row_schema(std::span<const Column<Row>> columns) {
  constexpr std::array<const char*, 4> kTypes = {"integer", "number", "boolean", "string"};
  Json properties = Json::object();
  for (const Column<Row>& column : columns) {
    const char* type = kTypes[static_cast<std::size_t>(column.type)];
    Json schema = column.nullable ? nullable(type) : typed(type);
    schema["description"] = column.text;
    properties[std::string(column.name)] = std::move(schema);
  }
  return strict_object(std::move(properties));
}

template <class Enum>
Json names_upto(Enum last) {
  Json names = Json::array();
  for (int value = 0; value <= static_cast<int>(last); ++value) names.push_back(name_of(static_cast<Enum>(value)));
  return {{"type", "string"}, {"enum", names}};
}

Json event_schema(EventKind kind, const Json& own) {
  Json properties = {{"seq", {{"type", "integer"}, {"minimum", 1}}},
                     {"time_h", {{"type", "number"}, {"minimum", 0}}},
                     {"kind", {{"const", name_of(kind)}}},
                     {"cell_id", kind == EventKind::kFinished ? typed("null") : cell_id()},
                     {"digest", digest()}};
  properties.update(own);
  return strict_object(std::move(properties));
}

Json share() { return {{"type", "number"}, {"minimum", 0}, {"maximum", 1}}; }

Json search_fields() { return {{"fitness", share()}, {"evaluation_count", count()}, {"corrected", typed("boolean")}}; }

Json event_union() {
  Json divided = {{"cells", {{"type", "array"}, {"items", reference("Cell")}, {"minItems", 2}, {"maxItems", 2}}},
                  {"plane", strict_object({{"point_um", vec3()}, {"normal", vec3()}})},
                  {"direction", vec3()},
                  {"woken", list_of("Woken")}};
  divided.update(search_fields());
  Json inhibited = {{"free_share", share()}, {"try_count", count()}, {"due_h", nullable("number")}};
  inhibited.update(search_fields());
  Json moved = event_schema(EventKind::kMoved, {{"cell", reference("Cell")}, {"woken", list_of("Woken")}});
  moved["description"] =
      "an amoeboid move; one that found no place is told as well, with the cell where it was and a new move_due_h";
  const Json settled = {{"nucleus_um", vec3()},
                        {"nearest_membrane_um", vec3()},
                        {"deformed_volume_um3", typed("number")},
                        {"due_h", nullable("number")}};
  return {{"oneOf",
           Json::array({event_schema(EventKind::kFounded, {{"cell", reference("Cell")}}),
                        event_schema(EventKind::kDivided, divided), event_schema(EventKind::kInhibited, inhibited),
                        event_schema(EventKind::kSettled, settled),
                        moved,
                        event_schema(EventKind::kSenesced, Json::object()),
                        event_schema(EventKind::kFinished, {{"reason", names_upto(FinishReason::kTargetDeleted)},
                                                            {"cell_count", count()}})})}};
}

Json spec_schema(const SpecLimits& limits) {
  const Json input = job_spec_schema(limits);
  Json until = input["properties"]["until"];
  // A stored spec keeps the bound that was allowed when it was submitted.
  until["properties"]["cells"]["maximum"] = kCellIdMax;
  return strict_object({{"seed", input["properties"]["seed"]},
                        {"preset", typed("string")},
                        {"until", std::move(until)},
                        {"model", model_schema(true)}});
}

Json or_null(std::string_view component) {
  return {{"oneOf", Json::array({reference(component), typed("null")})}};
}

Json origin_schema() {
  Json schema = strict_object(
      {{"job_id", job_id()}, {"at_seq", {{"type", "integer"}, {"minimum", 1}}}, {"spec", reference("Spec")}, {"origin", or_null("Origin")}});
  schema["description"] = "where the first at_seq events of a fork were grown, and by which spec; the job may be gone since";
  return schema;
}

Json verify_result_schema() {
  Json seq = {{"type", Json::array({"integer", "null"})}, {"minimum", 1}};
  Json digest_or_null = digest();
  digest_or_null["type"] = Json::array({"string", "null"});
  Json expected = digest_or_null, actual = digest_or_null;
  expected["description"] = "of the event as made again";
  actual["description"] = "of the event as stored; null: it is missing or cannot be read";
  Json schema = strict_object({{"identical", typed("boolean")},
                               {"events", count()},
                               {"first_differing_seq", std::move(seq)},
                               {"expected_digest", std::move(expected)},
                               {"actual_digest", std::move(actual)},
                               {"message", nullable("string")}});
  schema["properties"]["events"]["description"] = "found identical, from the first on";
  return schema;
}

Json job_schema() {
  const Json path = {{"type", "string"}, {"format", "uri-reference"}};
  return strict_object(
      {{"id", job_id()},
       {"kind", typed("string")},
       {"name", typed("string")},
       {"labels", {{"type", "object"}, {"additionalProperties", typed("string")}}},
       {"state", names_upto(JobState::kCancelled)},
       {"reason", nullable("string")},
       {"detail", nullable("string")},
       {"submitted_by", typed("string")},
       {"created_at", wall_time(false)},
       {"started_at", wall_time(true)},
       {"finished_at", wall_time(true)},
       {"revision", {{"type", "integer"}, {"minimum", 1}}},
       {"last_seq", count()},
       {"digest", digest()},
       {"engine_version", typed("string")},
       {"origin", or_null("Origin")},
       {"spec", {{"oneOf", Json::array({reference("Spec"), reference("VerifySpec")})}}},
       {"result", or_null("VerifyResult")},
       {"progress", reference("Progress")},
       {"links",
        strict_object(
            {{"self", path}, {"events", path}, {"cells", path}, {"series", path}, {"image", path}, {"mesh", path},
             {"analysis", path}, {"lineage", path}, {"log", path}})}});
}

Json lineage_schema() {
  const Json parent = {{"type", Json::array({"integer", "null"})}, {"minimum", 1}, {"maximum", kCellIdMax}};
  Json born_h = typed("number");
  born_h["description"] = "when the id came into being: placed, or split off its parent";
  Json daughters = {{"type", "array"}, {"items", cell_id()}};
  daughters["description"] = "one for each division of this id, in the order of time";
  Json item = strict_object({{"cell_id", cell_id()},
                             {"parent_id", parent},
                             {"born_h", std::move(born_h)},
                             {"generation", count()},
                             {"activity", names_upto(Activity::kSenescent)},
                             {"daughter_ids", std::move(daughters)}});
  return strict_object({{"time_h", typed("number")},
                        {"last_seq", count()},
                        {"digest", digest()},
                        {"items", {{"type", "array"}, {"items", std::move(item)}}},
                        {"next", typed("null")}});
}

Json progress_schema() {
  return strict_object({{"time_h", {{"type", "number"}, {"minimum", 0}}},
                        {"cells", count()},
                        {"active", count()},
                        {"passive", count()},
                        {"senescent", count()},
                        {"fraction", nullable_share()},
                        {"cells_per_s", nullable("number")},
                        {"eta_s", nullable("number")}});
}

Json problem_schema() {
  const auto fault = [](const char* where) {
    return strict_object({{where, typed("string")}, {"message", typed("string")}});
  };
  Json schema = strict_object({{"type", {{"type", "string"}, {"pattern", "^urn:colony:problem:[a-z][a-z0-9-]*$"}}},
                               {"title", typed("string")},
                               {"status", {{"type", "integer"}, {"minimum", 400}, {"maximum", 599}}},
                               {"detail", typed("string")},
                               {"request_id", typed("string")}});
  schema["properties"]["errors"] = {
      {"type", "array"}, {"minItems", 1}, {"items", {{"oneOf", Json::array({fault("pointer"), fault("parameter")})}}}};
  return schema;
}

Json service_info_schema() {
  Json parameter = strict_object(
      {{"path", typed("string")}, {"unit", typed("string")}, {"type", typed("string")}, {"text", typed("string")}});
  parameter["properties"]["values"] = {{"type", "array"}, {"items", typed("string")}};
  parameter["properties"]["min"] = typed("number");
  parameter["properties"]["max"] = typed("number");
  parameter["properties"]["power_of_two"] = typed("boolean");
  parameter["properties"]["default"] = Json::object();  // of the parameter's own type
  parameter["required"].push_back("default");
  return strict_object(
      {{"name", typed("string")},
       {"version", typed("string")},
       {"limits", {{"type", "object"}, {"additionalProperties", typed("number")}}},
       {"presets",
        {{"type", "array"},
         {"items",
          strict_object({{"name", typed("string")}, {"text", typed("string")}, {"model", model_schema(true)}})}}},
       {"parameters", {{"type", "array"}, {"items", parameter}}}});
}

Json page_of(std::string_view component, Json next) {
  return strict_object({{"items", list_of(component)}, {"next", std::move(next)}});
}

Json counts_schema() {
  Json properties = Json::object();
  for (int state = 0; state <= static_cast<int>(JobState::kCancelled); ++state) {
    properties[std::string(name_of(static_cast<JobState>(state)))] = count();
  }
  return strict_object(std::move(properties));
}

Json submission_schema() {
  const Json dry_run = strict_object({{"dry_run", {{"const", true}}},
                                      {"name", typed("string")},
                                      {"labels", {{"type", "object"}, {"additionalProperties", typed("string")}}},
                                      {"spec", reference("Spec")},
                                      {"estimate", strict_object({{"cells", count()},
                                                                  {"time_h", typed("number")},
                                                                  {"wall_s", typed("number")},
                                                                  {"memory_bytes", count()},
                                                                  {"stored_bytes", count()},
                                                                  {"basis", typed("string")}})}});
  return {{"oneOf", Json::array({reference("Job"), dry_run})}};
}

}  // namespace

Json component_schemas(const SpecLimits& limits) {
  Json job_spec = job_spec_schema(limits);
  job_spec.erase("$schema");
  job_spec.erase("$id");
  job_spec["examples"] = Json::array({{{"name", "AHH-1 at 37 C"},
                                       {"labels", {{"plate", "7"}}},
                                       {"seed", 1},
                                       {"until", {{"time_h", 240}, {"cells", 2000}}},
                                       {"model", {{"cycle", {{"mean_h", 12}, {"sd_h", 2}}}}}}});
  Json activity = names_upto(Activity::kSenescent);
  Json cell = row_schema(cell_columns());
  cell["properties"]["activity"] = std::move(activity);
  Json components = {
      {"JobSpec", std::move(job_spec)},
      {"Spec", spec_schema(limits)},
      {"ForkSpec", fork_spec_schema(limits)},
      {"VerifySpec", strict_object({{"job_id", job_id()}, {"to_seq", count()}})},
      {"VerifyResult", verify_result_schema()},
      {"Origin", origin_schema()},
      {"Job", job_schema()},
      {"JobPatch", job_patch_schema()},
      {"Submission", submission_schema()},
      {"JobList", page_of("Job", nullable("string"))},
      {"JobCounts", counts_schema()},
      {"Progress", progress_schema()},
      {"Cell", std::move(cell)},
      {"CellList", strict_object({{"time_h", typed("number")},
                                  {"last_seq", count()},
                                  {"digest", digest()},
                                  {"items", list_of("Cell")},
                                  {"next", typed("null")}})},
      {"Lineage", lineage_schema()},
      {"Woken", strict_object({{"cell_id", cell_id()}, {"free_share", typed("number")}, {"due_h", typed("number")}})},
      {"Event", event_union()},
      {"EventList", page_of("Event", {{"type", Json::array({"string", "null"})}, {"pattern", "^[0-9]+$"}})},
      {"SeriesRow", row_schema(series_columns())},
      {"ObjectShape", row_schema(object_shape_columns())},
      {"ObjectList", page_of("ObjectShape", typed("null"))},
      {"Series", page_of("SeriesRow", typed("null"))},
      {"LogLine", strict_object({{"index", count()},
                                 {"at", wall_time(false)},
                                 {"level", {{"enum", Json::array({"info", "warning", "error"})}}},
                                 {"message", typed("string")},
                                 {"actor", nullable("string")}})},
      {"ServiceInfo", service_info_schema()},
      {"Health", strict_object({{"status", typed("string")}})},
      {"Problem", problem_schema()}};
  components.update(report_components());
  components.update(analysis_components());
  components.update(token_components());
  return components;
}

}  // namespace colony::server::api
