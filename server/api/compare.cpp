#include "server/api/compare.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/analysis/controls.hpp"
#include "engine/analysis/reason.hpp"
#include "engine/base/maths.hpp"
#include "engine/picture/top_view.hpp"
#include "server/api/codec_report.hpp"

namespace colony::server::api {
namespace {

constexpr std::int64_t kScaleProbeWidth_px = 2048;

Error wrong(const char* pointer, const std::string& message) { return {ErrorCode::kInvalid, message, {{pointer, message}}}; }

double nucleus_area_mean_um2(const Colony& colony) {
  double sum = 0.0;
  for (const Cell& cell : colony.cells()) sum += maths::kPi * cell.nucleus_radius_um * cell.nucleus_radius_um;
  return sum / static_cast<double>(colony.cells().size());
}

std::string range_text(const BoxDimensions& found) { return boxes_of(found) + ", the range that both have"; }

// What box counting of one line says about the two.
Json judge(const std::string& name, const MeasuredLine& simulated, const MeasuredLine& real, const LineFinding& of_simulated,
           const LineFinding& of_real, std::vector<std::string>& verdict) {
  const std::string begin = name + ": ";
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
  const std::string values = "simulated " + with_error(a) + ", real " + with_error(b) + " for " + range_text(*simulated.dimensions) + ": ";
  if (of_simulated.finding == Finding::kTooFew || of_real.finding == Finding::kTooFew) {
    verdict.push_back(begin + values + "nothing follows: fewer than " + std::to_string(kObjectsMin) + " objects were counted on " +
                      (of_simulated.finding != of_real.finding ? std::string(of_real.finding == Finding::kTooFew ? "the picture's" : "the colony's") + " side."
                                                               : std::string("both sides.")));
  } else if (differs) {
    verdict.push_back(begin + values + "they differ by more than errors and the bias of boxes. What follows: the two pictures are not alike in this. "
                      "What does not: which structure differs.");
  } else {
    const bool is_plain = !of_simulated.like_controls.empty() || !of_real.like_controls.empty();
    verdict.push_back(begin + values + "no difference that box counting could show. What follows: nothing against the model. What does not: that the "
                      "model is right" + (is_plain ? ", since controls without the structure in question give the same value." : "."));
  }
  if (of_simulated.finding != Finding::kScaling || of_real.finding != Finding::kScaling) {
    verdict.push_back(begin + "over this range the finding is " + std::string(name_of(of_simulated.finding)) + " for the simulated and " +
                      std::string(name_of(of_real.finding)) + " for the real one. Where it is not scaling the slope is no dimension, and equal slopes "
                      "are no evidence of equal structure.");
  }
  return {{"simulated", a.value}, {"real", b.value}, {"difference", a.value - b.value}, {"se", se}, {"differs", differs},
          {"range_px", {simulated.dimensions->side_min_px, simulated.dimensions->side_max_px}}};
}

// Of both sides, each with its own name where the names differ.
std::string both_names(const std::string& simulated, const std::string& real) {
  return simulated == real ? "The " + simulated : "The colony's " + (simulated == "colony outline" ? "outline" : simulated) + " and the picture's " + real;
}

std::string counted(std::uint64_t count, ObjectKind kind) {
  return std::to_string(count) + " " + std::string(count == 1 ? singular_of(kind) : name_of(kind));
}

// What was matched to what, and what to keep in mind.
std::vector<std::string> match_sentences(const Comparison& comparison) {
  const Match& match = comparison.match;
  const std::string kind(name_of(match.real.kind)), one(singular_of(match.real.kind));
  const std::string scale = decimals(comparison.um_per_px, 4) + " um a pixel";
  std::vector<std::string> out;
  if (match.request.by == MatchBy::kUmPerPx) {
    out.push_back("Matched by scale: the colony is drawn at the picture's " + scale + "; the picture's " + kind + " have " +
                  decimals(match.real.area_mean_px, 1) + " px on average, what is counted of the colony " +
                  decimals(comparison.simulated.cell_area_mean_px, 1) + " px.");
  } else {
    std::string source = "the mean area of one of the picture's " + counted(match.real.count, match.real.kind);
    if (match.request.cell_count) source = "the picture's covered area divided by the " + std::to_string(*match.request.cell_count) + " cells stated";
    if (match.request.cell_area_px) source = "the area of a cell stated";
    out.push_back("Matched by area: a " + std::string(singular_of(match.matched)) + " of the colony has " + decimals(match.area_px, 1) + " px, " + source +
                  "; that is " + scale + " in the colony.");
  }
  const bool is_stated = match.request.cell_count || match.request.cell_area_px || match.request.by == MatchBy::kUmPerPx;
  switch (match.real.kind) {
    case ObjectKind::kCells: break;
    case ObjectKind::kNuclei:
      out.push_back("Nuclei are compared with nuclei: what is drawn and counted of the colony are its nuclei, as discs, not its cells.");
      break;
    case ObjectKind::kRegions:
      if (!is_stated) {
        out.push_back("Warning: a region of the picture may hold many cells, and was matched with one cell of the colony. Give cell_count or cell_area_px, or "
                      "match um_per_px, for pixels per cell alike.");
      }
      out.push_back("Lines between cells inside a region are not seen in the picture, but counted in the colony: of the two only the outlines of the "
                    "whole are of one kind.");
      break;
    case ObjectKind::kObjects:
      if (!is_stated) {
        out.push_back("Warning: the picture's objects were matched with cells, and nothing says that they are cells. If they are nuclei, analyse with "
                      "pipeline=nuclei, and nuclei are compared with nuclei; else give cell_count or cell_area_px, or match um_per_px.");
      }
      break;
  }
  return out;
}

Json encode_match(const Comparison& comparison) {
  const Match& match = comparison.match;
  const auto or_null = [](const auto& value) { return value ? Json(*value) : Json(nullptr); };
  const bool by_area = match.request.by == MatchBy::kObjectArea;
  return {{"by", name_of(match.request.by)},
          {"of", by_area ? Json(name_of(match.matched)) : Json(nullptr)},
          {"area_px", by_area ? Json(match.area_px) : Json(nullptr)},
          {"cell_count", or_null(match.request.cell_count)},
          {"cell_area_px", or_null(match.request.cell_area_px)}};
}

Json encode_side(const ComparedSide& side, ObjectKind kind, std::uint64_t count, std::uint64_t hidden_count, double area_px,
                 std::optional<double> um_per_px) {
  return {{"um_per_px", um_per_px ? Json(*um_per_px) : Json(nullptr)},
          {"object_kind", name_of(kind)},
          {"object_count", count},
          {"hidden_count", hidden_count},
          {"object_area_mean_px", area_px},
          {"fractal", {{"walls", encode_line(side.lines.walls)}, {"outline", encode_line(side.lines.outline)}}},
          {"controls", encode_controls(side.controls)},
          {"findings", encode_findings(side.findings)}};
}

// The colony's nuclei as the picture's stain would show them: seen from above they are discs.
LabelImage nuclei_of(const Colony& colony, const LabelledColony& image) {
  LabelImage nuclei(image.labels.width_px, image.labels.height_px, image.labels.um_per_px);
  const double scale = *image.labels.um_per_px;
  std::vector<LabelDisc> discs;
  for (const Cell& cell : colony.cells()) {
    discs.push_back({cell.id.value, (cell.nucleus_um.x() - image.left_um) / scale, (image.top_um - cell.nucleus_um.y()) / scale,
                     cell.nucleus_radius_um / scale});
  }
  draw_discs(discs, nuclei);
  return nuclei;
}

}  // namespace

std::string_view name_of(MatchBy by) { return by == MatchBy::kObjectArea ? "object_area" : "um_per_px"; }

Result<Match> match_of(const MatchRequest& request, const ObjectFacts& real) {
  if (real.count == 0) return wrong("/analysis_id", "the picture has no objects to match: its lines enclose nothing");
  Match match{request, real};
  // A cell count of nuclei is one of nuclei: their covered area is known, that of their cells is not.
  const bool is_nuclei = real.kind == ObjectKind::kNuclei;
  match.simulated = is_nuclei ? ObjectKind::kNuclei : ObjectKind::kCells;
  match.matched = is_nuclei && !request.cell_area_px ? ObjectKind::kNuclei : ObjectKind::kCells;
  match.area_px = real.area_mean_px;
  if (request.cell_count) match.area_px = real.area_mean_px * static_cast<double>(real.count) / static_cast<double>(*request.cell_count);
  if (request.cell_area_px) match.area_px = *request.cell_area_px;
  if (request.by == MatchBy::kUmPerPx && !real.um_per_px) {
    return wrong("/match", "the analysis has no scale: give um_per_px with the picture, or match object_area");
  }
  return match;
}

Result<double> matched_scale(const Colony& colony, const Match& match, const Effort& effort) {
  if (match.request.by == MatchBy::kUmPerPx) return *match.real.um_per_px;
  if (match.matched == ObjectKind::kNuclei) return std::sqrt(nucleus_area_mean_um2(colony) / match.area_px);
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
  return frame->um_per_px * std::sqrt(area_px / match.area_px);
}

std::int64_t compared_px_estimate(const Colony& colony, const Match& match) {
  const bool by_scale = match.request.by == MatchBy::kUmPerPx;
  if (colony.cells().empty() || (!by_scale && !(match.area_px > 0.0))) return 0;
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
  const auto count = static_cast<double>(colony.cells().size());
  const double um2_per_px = by_scale ? *match.real.um_per_px * *match.real.um_per_px
                            : match.matched == ObjectKind::kNuclei ? nucleus_area_mean_um2(colony) / match.area_px
                                                                   : area_um2 / count / match.area_px;
  const double px = 1.21 * (right - left) * (top - bottom) / um2_per_px;  // 5 % of margin on each side
  return px < 1e15 ? static_cast<std::int64_t>(px) : std::int64_t{1'000'000'000'000'000};
}

void judge_common_range(const LineReport& simulated, const std::vector<ControlReport>& simulated_controls, ObjectKind simulated_kind,
                        const LineReport& real, const std::vector<ControlReport>& real_controls, ObjectKind real_kind, ComparedSide& simulated_side,
                        ComparedSide& real_side) {
  const auto end_of = [](const MeasuredLine& line) { return line.dimensions ? line.dimensions->side_max_px : kImageSideMax_px; };
  const std::int64_t walls = std::min(end_of(simulated.walls), end_of(real.walls));
  const std::int64_t outline = std::min(end_of(simulated.outline), end_of(real.outline));
  const auto within = [&](const LineReport& lines) { return LineReport{up_to(lines.walls, walls), up_to(lines.outline, outline)}; };
  const auto fill = [&](ComparedSide& side, const LineReport& lines, const std::vector<ControlReport>& controls, ObjectKind kind) {
    side.lines = within(lines);
    for (const ControlReport& control : controls) side.controls.push_back({control.name, within(control.lines), control.placement});
    side.findings = judge_lines(side.lines, side.controls, kind);
  };
  fill(simulated_side, simulated, simulated_controls, simulated_kind);
  fill(real_side, real, real_controls, real_kind);
}

Result<Comparison> compare(ColonyAt at, std::string_view picture, const ImageOptions& options, const MatchRequest& request, const Effort& effort,
                           Sweep sweep) {
  Comparison out;
  if (at.colony->cells().empty()) {
    return Error{ErrorCode::kInvalid, "the colony has no cells", {{"/at_h", "nothing is founded yet at this time"}}};
  }
  auto real = measure_picture(picture, options, effort, sweep);
  if (!real) return real.error();
  auto match = match_of(request, {real->objects, real->object_count, real->object_area_mean_px, real->analysis.um_per_px});
  if (!match) return match.error();
  const auto scale = matched_scale(*at.colony, *match, effort);
  if (!scale) return scale.error();
  PictureSpec spec;
  spec.um_per_px = *scale;
  spec.side_max_px = kMeasuredSideMax_px;
  auto image = label_colony(*at.colony, spec, effort);
  if (!image) {
    return Error{image.error().code,
                 "the colony cannot be drawn at " + decimals(*scale, 4) + " um a pixel, which the match asks for: " + reason_of(image.error()),
                 {{request.by == MatchBy::kUmPerPx ? "/match" : "/analysis_id",
                   "at this scale the colony's sides exceed " + std::to_string(kMeasuredSideMax_px) + " px, or are none"}}};
  }
  if (match->simulated == ObjectKind::kNuclei) image->labels = nuclei_of(*at.colony, *image);
  auto report = measure_colony(at, *image, effort, match->simulated);
  if (!report) return report.error();
  judge_common_range(report->lines, report->controls, match->simulated, real->lines, real->controls, real->objects, out.simulated_side,
                     out.real_side);
  out.at = std::move(at);
  out.match = std::move(*match);
  out.image = std::move(*image);
  out.um_per_px = *scale;
  out.simulated = std::move(*report);
  out.real = std::move(*real);
  return out;
}

Json encode_comparison(const Comparison& comparison) {
  std::vector<std::string> verdict = match_sentences(comparison);
  const ComparedSide &simulated = comparison.simulated_side, &real = comparison.real_side;
  const LineNames ours = line_names(comparison.match.simulated), theirs = line_names(comparison.real.objects);
  Json differences = {{"walls", judge(both_names(ours.walls, theirs.walls), simulated.lines.walls, real.lines.walls, simulated.findings.walls,
                                      real.findings.walls, verdict)},
                      {"outline", judge(both_names(ours.outline, theirs.outline), simulated.lines.outline, real.lines.outline,
                                        simulated.findings.outline, real.findings.outline, verdict)}};
  const auto add = [&](const char* whose, const std::vector<std::string>& sentences) {
    for (const std::string& sentence : sentences) verdict.push_back(whose + sentence);
  };
  add("The colony. ", hidden_sentences(comparison.simulated));
  add("The colony. ", sentences_of(simulated.findings));
  add("The colony. ", control_sentences(comparison.match.simulated, comparison.simulated.object_cover, comparison.simulated.visible_count));
  if (!comparison.real.analysis.segmentation.doubt.empty()) add("The picture. ", {comparison.real.analysis.segmentation.doubt});
  add("The picture. ", sentences_of(real.findings));
  if (!real.controls.empty()) add("The picture. ", control_sentences(comparison.real.objects, comparison.real.object_cover, comparison.real.object_count));
  add("The picture. ", comparison.real.sweep.sentences);
  Json side = encode_side(real, comparison.real.objects, comparison.real.object_count, 0, comparison.real.object_area_mean_px,
                          comparison.real.analysis.um_per_px);
  side["threshold_sweep"] = encode_threshold_sweep(comparison.real.sweep);
  return {{"time_h", comparison.at.time_h},
          {"last_seq", comparison.at.colony->last_seq()},
          {"digest", comparison.at.digest.hex()},
          {"match", encode_match(comparison)},
          {"verdict", verdict},
          {"differences", std::move(differences)},
          {"simulated", encode_side(simulated, comparison.match.simulated, comparison.simulated.visible_count,
                                    comparison.simulated.cell_count - comparison.simulated.visible_count, comparison.simulated.cell_area_mean_px,
                                    comparison.um_per_px)},
          {"real", std::move(side)}};
}

}  // namespace colony::server::api
