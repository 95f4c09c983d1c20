#include "server/api/analyse.hpp"

#include <utility>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/controls.hpp"
#include "engine/analysis/reason.hpp"
#include "engine/base/check.hpp"
#include "server/api/codec_report.hpp"

namespace colony::server::api {
namespace {

constexpr const char* kPipelines[] = {"auto", "nuclei", "phase", "contours"};
constexpr const char* kForegrounds[] = {"auto", "light", "dark"};
constexpr Seed kControlSeed = 1;

template <class Enum, std::size_t kCount>
Enum enum_from(const char* const (&names)[kCount], const std::string& name) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (name == names[i]) return static_cast<Enum>(i);
  }
  CHECK(!"a stored name is unknown");
  return Enum{};
}

AnalysisOptions engine_options(const ImageOptions& options) {
  AnalysisOptions out;
  out.um_per_px = options.um_per_px;
  out.channel = options.channel;
  out.segment.pipeline = options.pipeline;
  out.segment.foreground = options.foreground;
  out.segment.threshold = options.threshold;
  out.segment.clahe = options.clahe;
  out.segment.split = options.split;
  out.segment.area_min_px = options.area_min_px;
  out.segment.hole_max_px = options.hole_max_px;
  out.segment.background_reach_px = options.background_reach_px;
  out.segment.window_radius_px = options.window_radius_px;
  return out;
}

ObjectKind objects_of(const Segmentation& found) {
  switch (found.pipeline) {
    case Pipeline::kContours: return ObjectKind::kCells;
    case Pipeline::kPhase: return ObjectKind::kRegions;
    default: return found.pipeline_given && !found.dish_found ? ObjectKind::kNuclei : ObjectKind::kObjects;
  }
}

// Ink: what is drawn is what is counted; its cells are what it encloses.
Status measure_ink(PictureMeasurement& out, const BoxOptions& boxes, StopFlag stop) {
  const BinaryImage& ink = out.analysis.segmentation.mask;
  const auto outside = outside_of(ink);
  if (!outside) return outside.error();
  out.cells = enclosed_areas(ink, *outside);
  const auto outline = colony_outline(ink);
  if (!outline) return outline.error();
  out.walls = ink;
  out.outline = *outline;
  out.lines = {measure_line(ink, boxes, stop), measure_line(*outline, boxes, stop)};
  out.reason = "drawn lines: their cells are known by the areas that the ink encloses, not by their shapes";
  MatchedControls matched = matched_controls(out.cells, out.lines, kControlSeed, boxes, stop);
  out.controls = std::move(matched.reports);
  out.object_cover = matched.cover;
  out.verdict.push_back("The ink itself was counted as cell walls: lines thicker than one pixel raise the counts of the smallest boxes.");
  return Ok{};
}

Status measure_objects(PictureMeasurement& out, const BoxOptions& boxes, StopFlag stop) {
  out.cells = std::move(out.analysis.segmentation.labels);
  out.cells.um_per_px = out.analysis.um_per_px;
  auto walls = cell_walls(out.cells);
  if (!walls) return walls.error();
  auto outline = colony_outline(out.cells);
  if (!outline) return outline.error();
  out.walls = std::move(*walls);
  out.outline = std::move(*outline);
  LabelInput input;
  input.labels = &out.cells;
  input.objects = out.objects;
  input.control_seed = kControlSeed;
  input.boxes = boxes;
  auto report = analyse_labels(input, stop);
  if (report) {
    out.lines = report->lines;
    out.controls = report->controls;
    out.object_cover = report->object_cover;
    out.report = std::move(*report);
  } else {
    out.reason = reason_of(report.error());
    out.lines = {{{}, out.reason}, {{}, out.reason}};
  }
  if (out.analysis.segmentation.pipeline == Pipeline::kNuclei) {
    out.verdict.push_back(out.objects == ObjectKind::kNuclei
                              ? "The objects of this picture were taken for nuclei, as asked for: their borders are not borders of cells."
                              : "The objects of this picture are what is stained or printed, nuclei if the stain is one, colonies in a dish: their "
                                "borders are not borders of cells.");
  } else {
    out.verdict.push_back("The objects of this picture are regions of cells: cells that touch count as one.");
  }
  return Ok{};
}

}  // namespace

Json encode_image_options(const ImageOptions& options) {
  return {{"um_per_px", options.um_per_px ? Json(*options.um_per_px) : Json(nullptr)},
          {"channel", options.channel ? Json(*options.channel) : Json(nullptr)},
          {"pipeline", kPipelines[static_cast<int>(options.pipeline)]},
          {"foreground", kForegrounds[static_cast<int>(options.foreground)]},
          {"threshold", options.threshold ? Json(*options.threshold) : Json(nullptr)},
          {"clahe", options.clahe},
          {"split", options.split},
          {"area_min_px", options.area_min_px ? Json(*options.area_min_px) : Json(nullptr)},
          {"hole_max_px", options.hole_max_px ? Json(*options.hole_max_px) : Json(nullptr)},
          {"background_reach_px", options.background_reach_px ? Json(*options.background_reach_px) : Json(nullptr)},
          {"window_radius_px", options.window_radius_px}};
}

ImageOptions decode_image_options(const std::string& json) {
  const Json stored = Json::parse(json);
  ImageOptions options;
  if (!stored["um_per_px"].is_null()) options.um_per_px = stored["um_per_px"].get<double>();
  if (!stored["channel"].is_null()) options.channel = stored["channel"].get<std::int64_t>();
  options.pipeline = enum_from<Pipeline>(kPipelines, stored["pipeline"].get<std::string>());
  options.foreground = enum_from<Foreground>(kForegrounds, stored["foreground"].get<std::string>());
  if (!stored["threshold"].is_null()) options.threshold = stored["threshold"].get<int>();
  options.clahe = stored["clahe"].get<bool>();
  // What an older program stored has none of the following.
  options.split = stored.value("split", options.split);
  options.window_radius_px = stored.value("window_radius_px", options.window_radius_px);
  const auto whole = [&](const char* name) -> std::optional<std::int64_t> {
    if (!stored.contains(name) || stored[name].is_null()) return std::nullopt;
    return stored[name].get<std::int64_t>();
  };
  options.area_min_px = whole("area_min_px");
  options.hole_max_px = whole("hole_max_px");
  options.background_reach_px = whole("background_reach_px");
  return options;
}

LabelImage enclosed_areas(const BinaryImage& ink, const BinaryImage& outside) {
  LabelImage labels(ink.width_px, ink.height_px, ink.um_per_px);
  const auto is_free = [&](std::int64_t row, std::int64_t column) {
    return ink.contains(row, column) && ink.at(row, column) == 0 && outside.at(row, column) == 0 &&
           labels.at(std::int64_t{row}, std::int64_t{column}) == 0;
  };
  std::uint32_t count = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> open;
  for (std::int64_t row = 0; row < ink.height_px; ++row) {
    for (std::int64_t column = 0; column < ink.width_px; ++column) {
      if (!is_free(row, column)) continue;
      ++count;
      labels.at(row, column) = count;
      open.emplace_back(row, column);
      while (!open.empty()) {
        const auto [y, x] = open.back();
        open.pop_back();
        constexpr int kSteps[4][2] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}};
        for (const auto& step : kSteps) {
          if (!is_free(y + step[0], x + step[1])) continue;
          labels.at(y + step[0], x + step[1]) = count;
          open.emplace_back(y + step[0], x + step[1]);
        }
      }
    }
  }
  return labels;
}

Result<PictureMeasurement> measure_picture(std::string_view bytes, const ImageOptions& options, const Effort& effort,
                                           Sweep wanted_sweep) {
  BoxOptions boxes;
  boxes.threads = effort.threads;
  ThresholdLines sweep(boxes, effort.stop);
  AnalysisOptions wanted = engine_options(options);
  wanted.segment.sweep = wanted_sweep == Sweep::kMake;
  wanted.segment.at_threshold = [&sweep](const ThresholdView& view) { sweep.add(view); };
  auto analysis = analyse_image(bytes, wanted, effort.stop);
  if (!analysis) return analysis.error();
  PictureMeasurement out;
  out.analysis = std::move(*analysis);
  out.objects = objects_of(out.analysis.segmentation);
  for (StepImage& step : out.analysis.segmentation.steps) step.values = {};  // only the names are told
  const bool is_ink = out.analysis.segmentation.pipeline == Pipeline::kContours;
  const Status measured = is_ink ? measure_ink(out, boxes, effort.stop) : measure_objects(out, boxes, effort.stop);
  if (!measured) return measured.error();
  std::uint64_t covered_px = 0;
  const std::vector<LabelArea> areas = label_areas(out.cells);
  for (const LabelArea& area : areas) covered_px += area.area_px;
  out.object_count = areas.size();
  if (!areas.empty()) out.object_area_mean_px = static_cast<double>(covered_px) / static_cast<double>(areas.size());
  // Ink that encloses nothing is a set from elsewhere, judged as such.
  if (is_ink && out.object_count > 0) set_object_count(out.object_count, out.lines, out.controls);
  out.sweep = sweep.finish(out.objects);
  if (is_ink && out.object_count > 0) {
    for (ThresholdRow& row : out.sweep.rows) row.walls.object_count = row.outline.object_count = out.object_count;
  }
  out.findings = judge_lines(out.lines, out.controls, out.objects);
  if (const std::string& doubt = out.analysis.segmentation.doubt; !doubt.empty()) out.verdict.insert(out.verdict.begin(), doubt);
  const std::vector<std::string> about_controls =
      out.controls.empty() ? std::vector<std::string>() : control_sentences(out.objects, out.object_cover, out.object_count);
  for (const std::vector<std::string>& sentences : {sentences_of(out.findings), about_controls, out.sweep.sentences}) {
    out.verdict.insert(out.verdict.end(), sentences.begin(), sentences.end());
  }
  return out;
}

Json encode_picture_result(const PictureMeasurement& measurement) {
  Json steps = Json::array();
  for (const StepImage& step : measurement.analysis.segmentation.steps) {
    steps.push_back({{"name", step.name}, {"text", step.text}});
  }
  Json measurements = nullptr;
  if (measurement.report) {
    measurements = encode_report(*measurement.report);
    for (const char* name : {"verdict", "findings", "fractal", "controls"}) measurements.erase(name);
  }
  return {{"image", encode_metadata(measurement.analysis)},
          {"segmentation", encode_segmentation(measurement.analysis)},
          {"steps", std::move(steps)},
          {"verdict", measurement.verdict},
          {"object_kind", name_of(measurement.objects)},
          {"object_count", measurement.object_count},
          {"object_area_mean_px", measurement.object_area_mean_px},
          {"object_cover", measurement.object_cover},
          {"fractal",
           {{"walls", encode_line(measurement.lines.walls)}, {"outline", encode_line(measurement.lines.outline)}}},
          {"controls", encode_controls(measurement.controls)},
          {"findings", encode_findings(measurement.findings)},
          {"threshold_sweep", encode_threshold_sweep(measurement.sweep)},
          {"measurements", std::move(measurements)},
          {"reason", measurement.reason.empty() ? Json(nullptr) : Json(measurement.reason)}};
}

Result<LabelImage> objects_of_picture(std::string_view bytes, const ImageOptions& options, const Effort& effort) {
  AnalysisOptions wanted = engine_options(options);
  wanted.segment.keep_steps = wanted.segment.sweep = false;
  auto analysis = analyse_image(bytes, wanted, effort.stop);
  if (!analysis) return analysis.error();
  LabelImage objects = std::move(analysis->segmentation.labels);
  if (analysis->segmentation.pipeline == Pipeline::kContours) {
    const auto outside = outside_of(analysis->segmentation.mask);
    if (!outside) return outside.error();
    objects = enclosed_areas(analysis->segmentation.mask, *outside);
  }
  objects.um_per_px = analysis->um_per_px;
  return objects;
}

Result<std::string> step_png(std::string_view bytes, const ImageOptions& options, const std::string& name,
                             const Effort& effort) {
  AnalysisOptions wanted = engine_options(options);
  wanted.segment.keep_only = name;
  wanted.segment.sweep = false;
  const auto analysis = analyse_image(bytes, wanted, effort.stop);
  if (!analysis) return analysis.error();
  for (const StepImage& step : analysis->segmentation.steps) {
    if (step.name == name) return encode_step_png(step, effort.stop);
  }
  return Error{ErrorCode::kNotFound, "this analysis has no step '" + name + "'; its result names those there are"};
}

}  // namespace colony::server::api
