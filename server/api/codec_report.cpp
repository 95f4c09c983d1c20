#include "server/api/codec_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace colony::server::api {
namespace {

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// JSON has no infinity: an interval without an upper bound.
Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json encode_dimension(const Dimension& dimension, const BoxDimensions& of) {
  return {{"value", dimension.value},
          {"se", dimension.standard_error},
          {"r2", dimension.r2},
          {"range_px", {of.side_min_px, of.side_max_px}}};
}

// Mean, standard deviation (of the population) and range of one property of all measured cells; null where none is.
Json spread(const std::vector<Shape>& shapes, const std::function<double(const Shape&)>& property) {
  double sum = 0.0, squares = 0.0, low = 0.0, high = 0.0, count = 0.0;
  for (const Shape& shape : shapes) {
    if (!shape.is_measured) continue;
    const double value = property(shape);
    if (count == 0.0) low = high = value;
    count += 1.0;
    sum += value;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (count == 0.0) return nullptr;
  const double mean = sum / count;
  for (const Shape& shape : shapes) squares += shape.is_measured ? (property(shape) - mean) * (property(shape) - mean) : 0.0;
  return {{"mean", mean}, {"sd", std::sqrt(squares / count)}, {"min", low}, {"max", high}};
}

Json encode_colony(const ColonyShape& colony, std::optional<double> um_per_px) {
  const double scale = um_per_px.value_or(0.0);
  const auto area_px = static_cast<double>(colony.shape.area_px);
  return {{"area_px", colony.shape.area_px},
          {"area_um2", um_per_px ? Json(area_px * scale * scale) : Json(nullptr)},
          {"perimeter_px", colony.shape.perimeter_px},
          {"perimeter_um", um_per_px ? Json(colony.shape.perimeter_px * scale) : Json(nullptr)},
          {"circularity", colony.shape.circularity},
          {"solidity", colony.shape.solidity},
          {"eccentricity", colony.shape.eccentricity},
          {"at_frame", colony.shape.at_frame},
          {"piece_count", colony.piece_count},
          {"covered_px", colony.covered_px},
          {"hole_count", colony.hole_count},
          {"hole_px", colony.hole_px},
          {"open_share", colony.open_share},
          {"radius_mean_px", colony.radius_mean_px},
          {"radius_rms_px", colony.radius_rms_px},
          {"roughness", colony.roughness},
          {"excess_perimeter", colony.excess_perimeter}};
}

Json encode_sides(const SideStatistics& sides) {
  Json classes = Json::array();
  for (std::size_t i = 0; i < sides.counts.size(); ++i) {
    classes.push_back({{"sides", kSidesFirst + i},
                       {"count", sides.counts[i]},
                       {"share", sides.shares[i]},
                       {"gibson_share", kGibsonShares[i]}});
  }
  return {{"other_count", sides.other_count},
          {"classes", std::move(classes)},
          {"sides_mean", sides.sides_mean},
          {"difference_max", sides.difference_max},
          {"chi_square", or_null(sides.chi_square)},
          {"degrees", sides.degrees},
          {"p_value", or_null(sides.p_value)}};
}

Json encode_neighbours(const LabelReport& report) {
  Json out = encode_sides(report.sides);
  out["interior_count"] = std::count_if(report.contacts.cells.begin(), report.contacts.cells.end(),
                                        [](const CellContacts& cell) { return cell.interior; });
  out["not_judged"] = report.sides_reason.empty() ? Json(nullptr) : Json(report.sides_reason);
  const ClosedSides& closed = report.closed_sides;
  out["holes_given"] = encode_sides(closed.sides);
  out["holes_given"].update({{"hole_max_px", closed.hole_max_px}, {"hole_count", closed.hole_count}, {"hole_px", closed.hole_px}});
  return out;
}

Json encode_straightness(const std::optional<SiblingStraightness>& siblings) {
  if (!siblings) return nullptr;
  const auto group = [](const StraightnessGroup& of) {
    return Json{{"count", of.count}, {"mean", of.mean}, {"se", of.standard_error}};
  };
  return {{"siblings", group(siblings->siblings)},
          {"others", group(siblings->others)},
          {"difference", siblings->difference},
          {"t", siblings->t}};
}

Json encode_rings(const LabelReport& report) {
  Json rings = Json::array();
  for (const Ring& ring : report.rings) {
    rings.push_back({{"inner_px", ring.inner_px},
                     {"outer_px", ring.outer_px},
                     {"cell_count", ring.cell_count},
                     {"covered_px", ring.covered_px},
                     {"area_mean_px", ring.area_mean_px},
                     {"area_se_px", ring.area_se_px},
                     {"density_per_px", ring.density_per_px},
                     {"active_share", or_null(ring.active_share)}});
  }
  return rings;
}

Json encode_phase(const std::optional<GrowthPhase>& phase, const char* value_name) {
  if (!phase) return nullptr;
  return {{"from_h", phase->from_h},
          {"to_h", phase->to_h},
          {"row_count", phase->row_count},
          {value_name, finite_or_null(phase->value)},
          {"low", finite_or_null(phase->interval.low)},
          {"high", finite_or_null(phase->interval.high)},
          {"r2", phase->r2}};
}

Json encode_levels(const std::optional<HumpFigures>& levels) {
  if (!levels) return nullptr;
  return {{"between_share", levels->between_share}, {"skewness", levels->skewness}, {"kurtosis", levels->kurtosis}};
}

}  // namespace

Json encode_line(const MeasuredLine& line) {
  if (!line.dimensions) {
    return {{"d0", nullptr}, {"d0_smallest_cover", nullptr}, {"d1", nullptr}, {"finding", name_of(finding_of(line))}, {"crossover", nullptr},
            {"curve", Json::array()}, {"local_slopes", Json::array()}, {"reason", line.reason}};
  }
  const BoxDimensions& found = *line.dimensions;
  Json curve = Json::array();
  for (const BoxCount& count : found.counts) {
    curve.push_back({{"side_px", count.side_px},
                     {"count_mean", count.count_mean},
                     {"count_min", count.count_min},
                     {"information_mean", count.information_mean}});
  }
  Json local = Json::array();
  for (const LocalSlope& slope : found.capacity.local) {
    local.push_back({{"side_px", slope.side_px}, {"dimension", slope.dimension}});
  }
  return {{"d0", encode_dimension(found.capacity, found)},
          {"d0_smallest_cover", encode_dimension(found.smallest_cover, found)},
          {"d1", encode_dimension(found.information, found)},
          {"finding", name_of(finding_of(line))},
          {"crossover",
           {{"found", found.crossover.found},
            {"drift", found.crossover.drift},
            {"drift_se", found.crossover.drift_se},
            {"t", found.crossover.t},
            {"t_critical", found.crossover.t_critical}}},
          {"curve", std::move(curve)},
          {"local_slopes", std::move(local)},
          {"reason", nullptr}};
}

Json encode_controls(const std::vector<ControlReport>& controls) {
  Json list = Json::array();
  for (const ControlReport& control : controls) {
    list.push_back({{"name", control.name},
                    {"placement", name_of(control.placement)},
                    {"walls", encode_line(control.lines.walls)},
                    {"outline", encode_line(control.lines.outline)}});
  }
  return list;
}

Json encode_findings(const LineFindings& findings) {
  const auto one = [](const LineFinding& line) -> Json {
    if (line.finding == Finding::kNoFigures) {
      return {{"finding", name_of(line.finding)}, {"decades", nullptr},         {"plateau_decades", nullptr},
              {"slope_small_boxes", nullptr},     {"slope_large_boxes", nullptr}, {"like_controls", Json::array()},
              {"unlike_controls", Json::array()}};
    }
    return {{"finding", name_of(line.finding)},
            {"decades", line.slopes.decades},
            {"plateau_decades", line.slopes.plateau_decades},
            {"slope_small_boxes", line.slopes.first},
            {"slope_large_boxes", line.slopes.last},
            {"like_controls", line.like_controls},
            {"unlike_controls", line.unlike_controls}};
  };
  return {{"walls", one(findings.walls)}, {"outline", one(findings.outline)}};
}

Json encode_threshold_sweep(const ThresholdSweep& sweep) {
  const auto line = [](const MeasuredLine& measured) -> Json {
    if (!measured.dimensions) return {{"d0", nullptr}, {"finding", name_of(finding_of(measured))}, {"crossover", nullptr}, {"reason", measured.reason}};
    return {{"d0", encode_dimension(measured.dimensions->capacity, *measured.dimensions)},
            {"finding", name_of(finding_of(measured))},
            {"crossover", measured.dimensions->crossover.found},
            {"reason", nullptr}};
  };
  Json rows = Json::array();
  for (const ThresholdRow& row : sweep.rows) {
    rows.push_back({{"threshold", row.threshold}, {"walls", line(row.walls)}, {"outline", line(row.outline)}});
  }
  return {{"sides_px", sweep.sides_px}, {"rows", std::move(rows)}};
}

Json encode_report(const LabelReport& report) {
  return {{"um_per_px", or_null(report.um_per_px)},
          {"cell_count", report.cell_count},
          {"visible_cell_count", report.visible_count},
          {"cell_area_mean_px", report.cell_area_mean_px},
          {"px_per_cell_diameter", report.px_per_cell_diameter},
          {"verdict", report.verdict},
          {"findings", encode_findings(report.findings)},
          {"fractal", {{"walls", encode_line(report.lines.walls)}, {"outline", encode_line(report.lines.outline)}}},
          {"controls", encode_controls(report.controls)},
          {"object_cover", report.object_cover},
          {"colony", encode_colony(report.colony, report.um_per_px)},
          {"cells",
           {{"measured_count", report.measured_count},
            {"partly_hidden_count", report.partly_hidden_count},
            {"area_px", spread(report.shapes, [](const Shape& s) { return static_cast<double>(s.area_px); })},
            {"perimeter_px", spread(report.shapes, [](const Shape& s) { return s.perimeter_px; })},
            {"circularity", spread(report.shapes, [](const Shape& s) { return s.circularity; })},
            {"solidity", spread(report.shapes, [](const Shape& s) { return s.solidity; })},
            {"eccentricity", spread(report.shapes, [](const Shape& s) { return s.eccentricity; })}}},
          {"neighbours", encode_neighbours(report)},
          {"sibling_straightness", encode_straightness(report.siblings)},
          {"rings", encode_rings(report)},
          {"apart",
           {{"apart_count", report.apart.apart_count},
            {"other_count", report.apart.other_count},
            {"share", report.apart.share},
            {"apart_area_cv", report.apart.apart_area_cv},
            {"apart_circularity_sd", report.apart.apart_circularity_sd},
            {"other_area_cv", report.apart.other_area_cv},
            {"other_circularity_sd", report.apart.other_circularity_sd}}}};
}

Json encode_packing(const Result<PackingStatistics>& packing) {
  if (!packing) return {{"reason", packing.error().message}};
  return {{"union_um3", packing->union_um3},         {"void_um3", packing->void_um3},
          {"void_share", packing->void_share},       {"retained_mean", packing->retained_mean},
          {"retained_sd", packing->retained_sd},     {"retained_5_percent", packing->retained_5_percent},
          {"retained_min", packing->retained_min},   {"most_pressed_cell_id", packing->most_pressed.value},
          {"reason", nullptr}};
}

Json encode_growth(const Result<GrowthPhases>& growth) {
  if (!growth) return {{"reason", growth.error().message}};
  return {{"lag", encode_phase(growth->lag, "cell_count")},
          {"exponential", encode_phase(growth->exponential, "doubling_time_h")},
          {"linear_radius", encode_phase(growth->linear_radius, "speed_um_per_h")},
          {"plateau", encode_phase(growth->plateau, "cell_count")},
          {"relative_sd", growth->relative_sd},
          {"bic", finite_or_null(growth->bic)},
          {"reason", nullptr}};
}

Json encode_metadata(const ImageAnalysis& analysis) {
  const ImageMetadata& metadata = analysis.metadata;
  constexpr const char* kSources[] = {"none", "given", "ome"};
  constexpr const char* kModels[] = {"grey", "rgb", "channels"};
  return {{"media_type", media_type(metadata.format)},
          {"colour_model", kModels[static_cast<int>(metadata.model)]},
          {"width_px", metadata.width_px},
          {"height_px", metadata.height_px},
          {"channel_count", metadata.channel_count},
          {"bits", metadata.bits},
          {"um_per_px", or_null(analysis.um_per_px)},
          {"um_per_px_source", kSources[static_cast<int>(metadata.scale_source)]},
          {"um_per_px_stated", or_null(metadata.um_per_px_stated)},
          {"channel", or_null(metadata.channel)},
          {"level_low", metadata.level_low},
          {"level_high", metadata.level_high},
          {"notes", metadata.notes}};
}

Json encode_segmentation(const ImageAnalysis& analysis) {
  const Segmentation& found = analysis.segmentation;
  constexpr const char* kPipelines[] = {"auto", "nuclei", "phase", "contours"};
  constexpr const char* kForegrounds[] = {"auto", "light", "dark"};
  Json sweep = Json::array();
  for (const SweepPoint& point : found.sweep) {
    sweep.push_back({{"threshold", point.threshold},
                     {"foreground_px", point.foreground_px},
                     {"object_count", point.object_count}});
  }
  return {{"pipeline", kPipelines[static_cast<int>(found.pipeline)]},
          {"pipeline_given", found.pipeline_given},
          {"pipeline_reason", found.pipeline_reason},
          {"foreground", kForegrounds[static_cast<int>(found.foreground)]},
          {"foreground_given", found.foreground_given},
          {"foreground_reason", found.foreground_reason},
          {"threshold", found.threshold},
          {"threshold_given", found.threshold_given},
          {"levels", encode_levels(found.levels)},
          {"doubt", found.doubt.empty() ? Json(nullptr) : Json(found.doubt)},
          {"background_reach_px", found.background_reach_px},
          {"area_min_px", found.area_min_px},
          {"field_px", found.field_px},
          {"dish_found", found.dish_found},
          {"object_count", analysis.object_count},
          {"foreground_px", found.foreground_px},
          {"foreground_share", analysis.foreground_share},
          {"area_mean_px", analysis.area_mean_px},
          {"area_median_px", analysis.area_median_px},
          {"area_mean_um2", or_null(analysis.area_mean_um2)},
          {"foreground_um2", or_null(analysis.foreground_um2)},
          {"density_per_mm2", or_null(analysis.density_per_mm2)},
          {"sweep", std::move(sweep)}};
}

}  // namespace colony::server::api
