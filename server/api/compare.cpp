#include "server/api/compare.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "engine/analysis/controls.hpp"
#include "engine/picture/top_view.hpp"
#include "server/api/codec_report.hpp"

namespace colony::server::api {
namespace {

constexpr std::int64_t kScaleProbeWidth_px = 2048;
constexpr double kBias = 0.05;  // of generic boxes: a difference within it is none

std::string two_decimals(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

// What box counting of one line says about the two.
Json judge(const std::string& name, const MeasuredLine& simulated, const MeasuredLine& real,
           std::vector<std::string>& verdict) {
  if (!simulated.dimensions || !real.dimensions) {
    verdict.push_back("The " + name + " cannot be compared: " +
                      (simulated.dimensions ? "the picture's has no figures (" + real.reason + ")."
                                            : "the colony's has no figures (" + simulated.reason + ")."));
    return nullptr;
  }
  const Dimension& a = simulated.dimensions->capacity;
  const Dimension& b = real.dimensions->capacity;
  const double difference = a.value - b.value;
  const double se = std::sqrt(a.standard_error * a.standard_error + b.standard_error * b.standard_error);
  const bool differs = std::abs(difference) > std::max(2.0 * se, kBias);
  verdict.push_back("The " + name + ": simulated " + two_decimals(a.value) + ", real " + two_decimals(b.value) + ": " +
                    (differs ? "they differ by more than errors and the bias of boxes."
                             : "no difference that box counting could show. The controls say how little that means: look at theirs."));
  if (simulated.dimensions->crossover.found || real.dimensions->crossover.found) {
    verdict.push_back("Of the " + name + " at least one is a crossover, not scaling: its slope is no dimension, and equal slopes are no "
                      "evidence of equal structure.");
  }
  return {{"simulated", a.value}, {"real", b.value}, {"difference", difference}, {"se", se}, {"differs", differs}};
}

Json encode_side(const LineReport& lines, const std::vector<ControlReport>& controls, std::uint64_t cells,
                 double area_px, std::optional<double> um_per_px) {
  Json list = Json::array();
  for (const ControlReport& control : controls) {
    list.push_back({{"name", control.name},
                    {"walls", encode_line(control.lines.walls)},
                    {"outline", encode_line(control.lines.outline)}});
  }
  return {{"um_per_px", um_per_px ? Json(*um_per_px) : Json(nullptr)},
          {"cell_count", cells},
          {"cell_area_mean_px", area_px},
          {"fractal", {{"walls", encode_line(lines.walls)}, {"outline", encode_line(lines.outline)}}},
          {"controls", std::move(list)}};
}

}  // namespace

Result<double> matched_scale(const Colony& colony, double cell_area_px, const Effort& effort) {
  PictureSpec spec;
  spec.width_px = kScaleProbeWidth_px;
  spec.side_max_px = kRasterSideMax_px;
  const Result<Frame> frame = frame_of(colony, spec);
  if (!frame) return frame.error();
  const TopView view = top_view(colony, *frame, {0, frame->height_px}, effort);
  const auto covered = std::count_if(view.owner.begin(), view.owner.end(), [](std::uint32_t id) { return id != 0; });
  std::vector<bool> is_seen(colony.cells().size() + 1, false);
  std::int64_t seen = 0;
  for (const std::uint32_t id : view.owner) {
    if (id == 0 || is_seen[id]) continue;
    is_seen[id] = true;
    ++seen;
  }
  if (seen == 0) return Error{ErrorCode::kInvalid, "no cell of the colony can be seen", {{"/at_h", "there are no cells"}}};
  const double area_px = static_cast<double>(covered) / static_cast<double>(seen);
  return frame->um_per_px * std::sqrt(area_px / cell_area_px);
}

Result<Comparison> compare(ColonyAt at, std::string_view picture, const ImageOptions& options, const Effort& effort) {
  Comparison out;
  if (at.colony->cells().empty()) {
    return Error{ErrorCode::kInvalid, "the colony has no cells", {{"/at_h", "nothing is founded yet at this time"}}};
  }
  auto real = measure_picture(picture, options, effort);
  if (!real) return real.error();
  if (real->cell_count == 0) {
    return Error{ErrorCode::kInvalid,
                 "the picture has no cells to match",
                 {{"/analysis_id", "its lines enclose nothing, so there are no pixels per cell to match"}}};
  }
  const auto scale = matched_scale(*at.colony, real->cell_area_mean_px, effort);
  if (!scale) return scale.error();
  PictureSpec spec;
  spec.um_per_px = *scale;
  spec.side_max_px = kMeasuredSideMax_px;
  auto image = label_colony(*at.colony, spec, effort);
  if (!image) {
    return Error{image.error().code,
                 "the colony cannot be drawn at the picture's pixels per cell (" +
                     two_decimals(real->cell_area_mean_px) + " px a cell): " + image.error().message,
                 {{"/analysis_id", "with so many pixels a cell the colony's sides exceed " +
                                       std::to_string(kMeasuredSideMax_px) + " px"}}};
  }
  auto report = measure_colony(at, *image, effort);
  if (!report) return report.error();
  out.at = std::move(at);
  out.image = std::move(*image);
  out.um_per_px = *scale;
  out.simulated = std::move(*report);
  out.real = std::move(*real);
  return out;
}

Json encode_comparison(const Comparison& comparison) {
  std::vector<std::string> verdict;
  const LineReport& simulated = comparison.simulated.lines;
  const LineReport& real = comparison.real.lines;
  Json differences = {{"walls", judge("walls", simulated.walls, real.walls, verdict)},
                      {"outline", judge("colony outline", simulated.outline, real.outline, verdict)}};
  for (const std::string& sentence : comparison.real.verdict) verdict.push_back("The picture. " + sentence);
  return {{"time_h", comparison.at.time_h},
          {"last_seq", comparison.at.colony->last_seq()},
          {"digest", comparison.at.digest.hex()},
          {"verdict", verdict},
          {"differences", std::move(differences)},
          {"simulated", encode_side(simulated, comparison.simulated.controls, comparison.simulated.cell_count,
                                    comparison.simulated.cell_area_mean_px, comparison.um_per_px)},
          {"real", encode_side(real, comparison.real.controls, comparison.real.cell_count,
                               comparison.real.cell_area_mean_px, comparison.real.analysis.um_per_px)}};
}

}  // namespace colony::server::api
