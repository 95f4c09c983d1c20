#include "server/api/examples.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/base/check.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/codec_spec.hpp"
#include "server/api/problems.hpp"

namespace colony::server::api {
namespace {

Json example(const char* summary, Json value, int answer) {
  return {{"summary", summary}, {"value", std::move(value)}, {"x-answer", answer}};
}

Json labelled_spec() {
  return {{"name", "AHH-1 at 37 C"},
          {"labels", {{"plate", "7"}}},
          {"seed", 1},
          {"preset", "paper"},
          {"until", {{"time_h", 240}, {"cells", 2000}}},
          {"model", {{"cycle", {{"mean_h", 12}, {"sd_h", 2}}}, {"division", {{"generation_limit", nullptr}}}}}};
}

Json spec_examples() {
  const Json places = Json::array({Json::array({0, 0}), Json::array({400, 0}), Json::array({-150, 320})});
  return {
      {"smallest", example("a bound is all that is needed", {{"until", {{"cells", 100}}}}, 201)},
      {"labelled", example("a culture with its own cycle", labelled_spec(), 201)},
      {"founders", example("three founders where they were seen",
                           {{"preset", "clonogenic"},
                            {"until", {{"time_h", 96}}},
                            {"model", {{"founders", {{"positions_um", places}}}}}},
                           201)},
      {"crawling",
       example("cells that crawl", {{"preset", "young-colony"}, {"seed", 7}, {"until", {{"time_h", 72}}}}, 201)},
      // Right by the schema, which cannot state a rule between two fields.
      {"refused", example("a spread of more than a quarter of the mean",
                          {{"until", {{"cells", 100}}}, {"model", {{"cycle", {{"mean_h", 12}, {"sd_h", 5}}}}}}, 422)}};
}

Cell example_cell(std::uint32_t id) {
  Cell cell;
  cell.id = {id};
  if (id > 1) cell.parent_id = CellId{1};
  cell.generation = 1;
  cell.ordinal = id == 1 ? 2 : 0;
  const double side = id == 1 ? -1.0 : 1.0;
  cell.centre_um = {side * 5.25, 0.5, 4.0};
  cell.nucleus_um = {side * 5.0, 0.25, 3.5};
  cell.nucleus_radius_um = 3.25;
  cell.semiaxes_um = {8.5, 7.75, 4.5};
  cell.rotation_rad = {0.0, 0.125, 1.5};
  cell.noise_offset = {0.25, 1.75, 3.0};
  cell.born_h = 11.5;
  cell.due_h = 23.75;
  cell.settle_due_h = 13.5;
  cell.volume_um3 = 1100.0;
  return cell;
}

Event example_event(std::uint64_t seq, double time_h, EventBody body) {
  Event event;
  event.seq = seq;
  event.time_h = time_h;
  if (!std::holds_alternative<Finished>(body)) event.cell_id = CellId{1};
  event.body = std::move(body);
  for (std::size_t i = 0; i < event.digest.bytes.size(); ++i)
    event.digest.bytes[i] = static_cast<std::uint8_t>(seq * 37 + i * 11);
  return event;
}

Json event_examples() {
  Divided divided;
  divided.cells = {example_cell(1), example_cell(2)};
  divided.plane_normal = divided.direction = {1.0, 0.0, 0.0};
  divided.fitness = 0.98;
  divided.evaluation_count = 640;
  divided.woken = {{CellId{3}, 0.5, 14.25}};
  const Inhibited inhibited{
      .fitness = 0.62, .free_share = 0.125, .try_count = 1, .evaluation_count = 640, .corrected = true, .due_h = {}};
  const Settled settled{.nucleus_um = {-5.0, 0.25, 3.5},
                        .nearest_membrane_um = {-9.5, 0.25, 4.0},
                        .deformed_volume_um3 = 1050.5,
                        .due_h = 23.75};
  Json examples = Json::array();
  for (const Event& event : {example_event(1, 0.0, Founded{example_cell(1)}), example_event(2, 11.5, divided),
                             example_event(3, 13.5, settled), example_event(4, 14.0, Moved{example_cell(1), {}}),
                             example_event(5, 23.75, inhibited), example_event(6, 480.0, Senesced{}),
                             example_event(7, 500.0, Finished{FinishReason::kAllSenescent, 2})}) {
    examples.push_back(encode_event(event));
  }
  return examples;
}

Json job_example() {
  const auto spec = decode_spec(labelled_spec(), SpecLimits{});
  CHECK(bool(spec));
  JobView view;
  view.job.id = kExampleId;
  view.job.name = spec->name;
  view.job.labels = spec->labels;
  view.job.state = JobState::kRunning;
  view.job.submitted_by = "local";
  view.job.created_at = "2026-01-02T03:04:05.678Z";
  view.job.started_at = "2026-01-02T03:04:05.700Z";
  view.job.revision = 2;
  view.job.last_seq = 2;
  view.job.digest = example_event(2, 11.5, Senesced{}).digest;
  view.job.engine_version = "0.1.0/1";
  view.job.spec_json = to_text(encode_spec(*spec));
  view.progress = {2, 11.5, 2, 2, 0, 0, 0.0479166, 850.0, 2.35};
  return encode_job(view, "");
}

Json series_example() {
  SeriesRow row;
  row.time_h = 11.5;
  row.cell_count = row.active_count = 2;
  row.volume_mean_um3 = 1100.0;
  row.radius_um = 11.25;
  row.area_um2 = 397.5;
  row.density_per_mm2 = 5031.5;
  return encode_row(series_columns(), row);
}

Json problem_example() {
  const ProblemRow& row = problem_row(ProblemKind::kInvalid);
  return {{"type", "urn:colony:problem:" + std::string(row.code)},
          {"title", row.title},
          {"status", row.status},
          {"detail", "the spec has 1 wrong field"},
          {"request_id", "bd369d05af61848dc56f545dea31a388"},
          {"errors",
           Json::array({{{"pointer", "/model/cycle/sd_h"}, {"message", "must be at most a quarter of mean_h"}}})}};
}

}  // namespace

Json request_examples(std::string_view operation_id) {
  if (operation_id == "submitJob") return spec_examples();
  if (operation_id == "compare") {
    return {{"now", example("a colony as it is, beside a picture",
                            {{"job_id", kExampleId}, {"analysis_id", kExampleId}}, 201)},
            {"then", example("as it was after 20 h",
                             {{"job_id", kExampleId}, {"analysis_id", kExampleId}, {"at_h", 20}}, 201)}};
  }
  if (operation_id == "forkJob") {
    return {
        {"cooler", example("slower cells from the fifth event on",
                           {{"at_seq", 5}, {"until", {{"cells", 60}}}, {"model", {{"cycle", {{"mean_h", 15}}}}}}, 201)},
        {"again", example("another seed after 15 h", {{"at_h", 15}, {"seed", 2}, {"until", {{"cells", 60}}}}, 201)},
        {"late", example("an end before the fork", {{"at_h", 15}, {"until", {{"time_h", 1}}}}, 422)}};
  }
  if (operation_id == "editJob") {
    return {
        {"renamed", example("another name", {{"name", "plate 7, second run"}}, 200)},
        {"labelled", example("one label set, one taken away", {{"labels", {{"plate", "7"}, {"old", nullptr}}}}, 200)}};
  }
  if (operation_id == "createToken") {
    return {{"reader", example("for a dashboard", {{"name", "dashboard"}, {"scope", "read"}, {"expires_h", 24}}, 201)}};
  }
  return nullptr;
}

Json parameter_example(const QueryParam& param) {
  static const std::array<std::pair<std::string_view, Json>, 14> kByName = {{{"cursor", nullptr},
                                                                             {"name", "AHH-1 at 37 C"},
                                                                             {"kind", "colony"},
                                                                             {"label", "plate:7"},
                                                                             {"limit", 20},
                                                                             {"after", 100},
                                                                             {"at_h", 20.5},
                                                                             {"um_per_px", 0.5},
                                                                             {"width_px", 640},
                                                                             {"points", 50},
                                                                             {"cell_id", 1},
                                                                             {"channel", 0},
                                                                             {"triangles_max", 50'000},
                                                                             {"jobs", "all"}}};
  const auto known =
      std::find_if(kByName.begin(), kByName.end(), [&](const auto& one) { return one.first == param.name; });
  switch (param.type) {
    case QueryType::kName:
      return param.names.front();
    case QueryType::kNames:
      return Json::array({param.names.front()});
    case QueryType::kBoolean:
      return true;
    case QueryType::kInteger:
      if (known == kByName.end()) return static_cast<std::int64_t>(std::clamp(100.0, param.min, param.max));
      return known->second;
    case QueryType::kNumber:
      if (known == kByName.end()) return std::clamp(1.0, param.min, param.max);
      return known->second;
    case QueryType::kText:
      if (known == kByName.end() || known->second.is_null()) return nullptr;
      return param.repeatable ? Json::array({known->second}) : known->second;
  }
  return nullptr;
}

void add_component_examples(Json& schemas) {
  const Json cell = encode_cell(example_cell(2));
  const Json events = event_examples();
  const Json job = job_example();
  const Json series = series_example();
  LogRow line;
  line.index = 1;
  line.at = "2026-01-02T03:04:05.700Z";
  line.level = "info";
  line.message = "started";
  const Json log = encode_log_row(line);
  const auto add = [&](const char* component, Json examples) {
    schemas.at(component)["examples"] = std::move(examples);
  };
  const auto one = [](const Json& value) { return Json::array({value}); };
  const auto page = [&](const Json& item, const Json& next) { return one({{"items", one(item)}, {"next", next}}); };
  add("Job", one(job));
  add("JobList", page(job, "9f4c1e0b7d2a4a6f8b3c5d7e9f0a1b2c"));
  add("Progress", one(job["progress"]));
  add("Spec", one(job["spec"]));
  add("Cell", one(cell));
  add("CellList",
      one({{"time_h", 11.5}, {"last_seq", 2}, {"digest", job["digest"]}, {"items", one(cell)}, {"next", nullptr}}));
  add("Event", events);
  add("EventList", one({{"items", events}, {"next", "7"}}));
  add("SeriesRow", one(series));
  add("Series", page(series, nullptr));
  add("LogLine", one(log));
  const Json step = {{"name", "grey"},
                     {"text", "the channel that is analysed, as 8 bits"},
                     {"href", "/v1/analyses/01a21486-926b-7bfd-87d8-22eafb110b27/steps/grey"}};
  add("Step", one(step));
  add("StepList", page(step, nullptr));
  add("Problem", one(problem_example()));
}

}  // namespace colony::server::api
