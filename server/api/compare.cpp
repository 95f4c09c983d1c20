#include "server/api/compare.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/analysis/controls.hpp"
#include "engine/base/maths.hpp"
#include "engine/picture/top_view.hpp"
#include "server/api/codec_report.hpp"

namespace colony::server::api {
namespace {

constexpr std::int64_t kScaleProbeWidth_px = 2048;

// What box counting of one line says about the two.
Json judge(const std::string& name, const MeasuredLine& simulated, const MeasuredLine& real, const LineFinding& of_simulated,
           const LineFinding& of_real, std::vector<std::string>& verdict) {
  const std::string begin = "The " + name + ": ";
  if (!simulated.dimensions || !real.dimensions) {
    verdict.push_back(begin + "no comparison: " +
                      (simulated.dimensions ? "the picture's has no figures (" + real.reason + ")."
                                            : "the colony's has no figures (" + simulated.reason + ")."));
    return nullptr;
  }
  const Dimension& a = simulated.dimensions->capacity;
  const Dimension& b = real.dimensions->capacity;
  const double se = std::sqrt(a.standard_error * a.standard_error + b.standard_error * b.standard_error);
  const bool differs = dimensions_differ(a, b);
  const std::string values = "simulated " + with_error(a) + ", real " + with_error(b) + ": ";
  if (differs) {
    verdict.push_back(begin + values + "they differ by more than errors and the bias of boxes. What follows: the two pictures are not alike in this. "
                      "What does not: which structure differs.");
  } else {
    const bool is_plain = !of_simulated.like_controls.empty() || !of_real.like_controls.empty();
    verdict.push_back(begin + values + "no difference that box counting could show. What follows: nothing against the model. What does not: that the "
                      "model is right" + (is_plain ? ", since controls without the structure in question give the same value." : "."));
  }
  if (of_simulated.finding != Finding::kScaling || of_real.finding != Finding::kScaling) {
    verdict.push_back(begin + "the finding is " + std::string(name_of(of_simulated.finding)) + " for the simulated and " +
                      std::string(name_of(of_real.finding)) + " for the real one. Where it is not scaling the slope is no dimension, and equal slopes "
                      "are no evidence of equal structure.");
  }
  return {{"simulated", a.value}, {"real", b.value}, {"difference", a.value - b.value}, {"se", se}, {"differs", differs}};
}

Json encode_side(const LineReport& lines, const std::vector<ControlReport>& controls, const LineFindings& findings, std::uint64_t cells,
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
          {"controls", std::move(list)},
          {"findings", encode_findings(findings)}};
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

std::int64_t compared_px_estimate(const Colony& colony, double cell_area_px) {
  if (colony.cells().empty() || !(cell_area_px > 0.0)) return 0;
  double area_um2 = 0.0, left = 0.0, right = 0.0, bottom = 0.0, top = 0.0;
  bool is_first = true;
  for (const Cell& cell : colony.cells()) {
    const Vec2 half = colony.body(cell.id).footprint_half_extent_um();
    area_um2 += maths::kPi * cell.semiaxes_um.x() * cell.semiaxes_um.y();
    const double x = cell.centre_um.x(), y = cell.centre_um.y();
    left = is_first ? x - half.x() : std::min(left, x - half.x());
    right = is_first ? x + half.x() : std::max(right, x + half.x());
    bottom = is_first ? y - half.y() : std::min(bottom, y - half.y());
    top = is_first ? y + half.y() : std::max(top, y + half.y());
    is_first = false;
  }
  const double um2_per_px = area_um2 / static_cast<double>(colony.cells().size()) / cell_area_px;
  const double px = 1.21 * (right - left) * (top - bottom) / um2_per_px;  // 5 % of margin on each side
  return px < 1e15 ? static_cast<std::int64_t>(px) : std::int64_t{1'000'000'000'000'000};
}

Result<Comparison> compare(ColonyAt at, std::string_view picture, const ImageOptions& options, const Effort& effort,
                           Sweep sweep) {
  Comparison out;
  if (at.colony->cells().empty()) {
    return Error{ErrorCode::kInvalid, "the colony has no cells", {{"/at_h", "nothing is founded yet at this time"}}};
  }
  auto real = measure_picture(picture, options, effort, sweep);
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
                     decimals(real->cell_area_mean_px) + " px a cell): " + image.error().message,
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
  const LineFindings &a = comparison.simulated.findings, &b = comparison.real.findings;
  Json differences = {{"walls", judge("cell walls", simulated.walls, real.walls, a.walls, b.walls, verdict)},
                      {"outline", judge("colony outline", simulated.outline, real.outline, a.outline, b.outline, verdict)}};
  for (const std::string& sentence : comparison.simulated.verdict) verdict.push_back("The colony. " + sentence);
  for (const std::string& sentence : comparison.real.verdict) verdict.push_back("The picture. " + sentence);
  Json side = encode_side(real, comparison.real.controls, b, comparison.real.cell_count, comparison.real.cell_area_mean_px,
                          comparison.real.analysis.um_per_px);
  side["threshold_sweep"] = encode_threshold_sweep(comparison.real.sweep);
  return {{"time_h", comparison.at.time_h},
          {"last_seq", comparison.at.colony->last_seq()},
          {"digest", comparison.at.digest.hex()},
          {"verdict", verdict},
          {"differences", std::move(differences)},
          {"simulated", encode_side(simulated, comparison.simulated.controls, a, comparison.simulated.cell_count,
                                    comparison.simulated.cell_area_mean_px, comparison.um_per_px)},
          {"real", std::move(side)}};
}

}  // namespace colony::server::api
