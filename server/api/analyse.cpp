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
  return out;
}

MeasuredLine measure(const BinaryImage& line, const BoxOptions& boxes, StopFlag stop) {
  auto dimensions = box_dimensions(line, boxes, stop);
  if (!dimensions) return {{}, reason_of(dimensions.error())};
  return {std::move(*dimensions), {}};
}

void add_control(PictureMeasurement& out, const char* name, const Result<LabelImage>& control, const BoxOptions& boxes,
                 StopFlag stop) {
  if (control) {
    out.controls.push_back({name, analyse_lines(*control, 0, boxes, stop)});
  } else {
    const MeasuredLine none{{}, reason_of(control.error())};
    out.controls.push_back({name, {none, none}});
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
  out.lines = {measure(ink, boxes, stop), measure(*outline, boxes, stop)};
  out.reason = "drawn lines: their cells are known by the areas that the ink encloses, not by their shapes";
  const std::vector<LabelArea> areas = label_areas(out.cells);
  add_control(out, "hexagonal", hexagonal_control(areas), boxes, stop);
  add_control(out, "random_discs", random_disc_control(areas, kControlSeed), boxes, stop);
  out.verdict.push_back("The ink itself was counted: lines thicker than one pixel raise the counts of the smallest boxes.");
  if (out.lines.walls.dimensions && out.lines.walls.dimensions->crossover.found) {
    out.verdict.push_back("The drawn lines: crossover, not scaling: the slope is no dimension.");
  }
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
  input.control_seed = kControlSeed;
  input.boxes = boxes;
  auto report = analyse_labels(input, stop);
  if (report) {
    out.lines = report->lines;
    out.controls = report->controls;
    out.verdict = report->verdict;
    out.report = std::move(*report);
  } else {
    out.reason = reason_of(report.error());
    out.lines = {{{}, out.reason}, {{}, out.reason}};
  }
  if (out.analysis.segmentation.pipeline == Pipeline::kNuclei) {
    out.verdict.push_back("The objects of this picture are what is stained or printed, nuclei if the stain is one: their borders are not "
                          "borders of cells.");
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
          {"clahe", options.clahe}};
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

Result<PictureMeasurement> measure_picture(std::string_view bytes, const ImageOptions& options, const Effort& effort) {
  auto analysis = analyse_image(bytes, engine_options(options), effort.stop);
  if (!analysis) return analysis.error();
  PictureMeasurement out;
  out.analysis = std::move(*analysis);
  for (StepImage& step : out.analysis.segmentation.steps) step.values = {};  // only the names are told
  BoxOptions boxes;
  boxes.threads = effort.threads;
  const bool is_ink = out.analysis.segmentation.pipeline == Pipeline::kContours;
  const Status measured = is_ink ? measure_ink(out, boxes, effort.stop) : measure_objects(out, boxes, effort.stop);
  if (!measured) return measured.error();
  std::uint64_t covered_px = 0;
  const std::vector<LabelArea> areas = label_areas(out.cells);
  for (const LabelArea& area : areas) covered_px += area.area_px;
  out.cell_count = areas.size();
  if (!areas.empty()) out.cell_area_mean_px = static_cast<double>(covered_px) / static_cast<double>(areas.size());
  return out;
}

Json encode_picture_result(const PictureMeasurement& measurement) {
  Json steps = Json::array();
  for (const StepImage& step : measurement.analysis.segmentation.steps) {
    steps.push_back({{"name", step.name}, {"text", step.text}});
  }
  Json controls = Json::array();
  for (const ControlReport& control : measurement.controls) {
    controls.push_back({{"name", control.name},
                        {"walls", encode_line(control.lines.walls)},
                        {"outline", encode_line(control.lines.outline)}});
  }
  Json measurements = nullptr;
  if (measurement.report) {
    measurements = encode_report(*measurement.report);
    for (const char* name : {"verdict", "fractal", "controls"}) measurements.erase(name);
  }
  return {{"image", encode_metadata(measurement.analysis.metadata)},
          {"segmentation", encode_segmentation(measurement.analysis)},
          {"steps", std::move(steps)},
          {"verdict", measurement.verdict},
          {"cell_count", measurement.cell_count},
          {"cell_area_mean_px", measurement.cell_area_mean_px},
          {"fractal",
           {{"walls", encode_line(measurement.lines.walls)}, {"outline", encode_line(measurement.lines.outline)}}},
          {"controls", std::move(controls)},
          {"measurements", std::move(measurements)},
          {"reason", measurement.reason.empty() ? Json(nullptr) : Json(measurement.reason)}};
}

Result<std::string> step_png(std::string_view bytes, const ImageOptions& options, const std::string& name,
                             const Effort& effort) {
  AnalysisOptions wanted = engine_options(options);
  wanted.segment.keep_only = name;
  const auto analysis = analyse_image(bytes, wanted, effort.stop);
  if (!analysis) return analysis.error();
  for (const StepImage& step : analysis->segmentation.steps) {
    if (step.name == name) return encode_step_png(step);
  }
  return Error{ErrorCode::kNotFound, "this analysis has no step '" + name + "'; its result names those there are"};
}

}  // namespace colony::server::api
