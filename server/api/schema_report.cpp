// The schemas of measurements (components/schemas of openapi.json), beside codec_report.cpp, which they describe.
#include "server/api/codec_report.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {
namespace {

Json number() { return {{"type", "number"}}; }
Json nullable_number() { return {{"type", Json::array({"number", "null"})}}; }
Json count() { return {{"type", "integer"}, {"minimum", 0}}; }
Json boolean() { return {{"type", "boolean"}}; }
Json text() { return {{"type", "string"}}; }
Json texts() { return {{"type", "array"}, {"items", text()}}; }
Json list(Json item) { return {{"type", "array"}, {"items", std::move(item)}}; }
Json or_null(Json schema) { return {{"anyOf", Json::array({std::move(schema), {{"type", "null"}}})}}; }
Json described(Json schema, const char* description) {
  schema["description"] = description;
  return schema;
}

/// Properties of one type each: {"a", "b"} -> numbers.
Json numbers(std::initializer_list<const char*> names) {
  Json properties = Json::object();
  for (const char* name : names) properties[name] = number();
  return properties;
}

Json finding_schema() {
  return {{"enum", {"no_figures", "too_few", "crossover", "short_range", "wandering", "scaling"}},
          {"description", "too_few: lines of fewer than 10 cells, nuclei or objects; short_range: less than a decade of box sides; scaling: a power law fits over a "
                          "decade and three quarters of the range or more; no other is a dimension, and this one proves no fractal"}};
}

Json line_schema() {
  Json crossover = numbers({"drift", "drift_se", "t", "t_critical"});
  crossover["found"] =
      described(boolean(), "the test on the drift of the local slopes alone; `finding` is what follows from all of them");
  return strict_object(
      {{"d0", or_null(reference("Dimension"))},
       {"d0_smallest_cover", or_null(reference("Dimension"))},
       {"d1", or_null(reference("Dimension"))},
       {"finding", finding_schema()},
       {"crossover", or_null(strict_object(std::move(crossover)))},
       {"curve", list(strict_object({{"side_px", count()},
                                     {"count_mean", number()},
                                     {"count_min", count()},
                                     {"information_mean", number()}}))},
       {"local_slopes", list(strict_object(numbers({"side_px", "dimension"})))},
       {"reason", described({{"type", Json::array({"string", "null"})}}, "why there are no figures")}});
}

Json findings_schema() {
  Json line = Json::object();
  for (const char* name : {"decades", "plateau_decades", "slope_small_boxes", "slope_large_boxes"}) line[name] = nullable_number();
  line["finding"] = finding_schema();
  line["decades"]["description"] = "of box sides counted";
  line["plateau_decades"]["description"] = "longest range over which the local slopes are alike";
  line["like_controls"] = described(texts(), "controls with the same D0 within errors and bias: the value says nothing that they do not");
  line["unlike_controls"] = texts();
  const Json one = strict_object(std::move(line));
  return strict_object({{"walls", one}, {"outline", one}});
}

Json threshold_sweep_schema() {
  const Json line = strict_object({{"d0", or_null(reference("Dimension"))},
                                   {"finding", finding_schema()},
                                   {"crossover", {{"type", Json::array({"boolean", "null"})}}},
                                   {"reason", {{"type", Json::array({"string", "null"})}}}});
  Json schema = strict_object({{"sides_px", list(count())},
                               {"rows", list(strict_object({{"threshold", count()}, {"walls", line}, {"outline", line}}))}});
  return described(std::move(schema), "the same lines at other thresholds, with the same boxes: what hangs on the threshold is the threshold's");
}

Json colony_schema() {
  Json properties = numbers({"perimeter_px", "circularity", "solidity", "eccentricity", "open_share", "radius_mean_px",
                             "radius_rms_px", "roughness", "excess_perimeter"});
  for (const char* name : {"area_px", "piece_count", "covered_px", "hole_count", "hole_px"}) properties[name] = count();
  properties["area_um2"] = properties["perimeter_um"] = nullable_number();
  properties["at_frame"] = boolean();
  return strict_object(std::move(properties));
}

Json neighbours_schema() {
  Json sides = {{"other_count", count()},
                {"classes", list(strict_object({{"sides", count()},
                                                {"count", count()},
                                                {"share", number()},
                                                {"gibson_share", number()}}))},
                {"sides_mean", number()},
                {"difference_max", number()},
                {"chi_square", nullable_number()},
                {"degrees", count()},
                {"p_value", nullable_number()}};
  Json closed = sides;
  closed["hole_max_px"] = closed["hole_count"] = closed["hole_px"] = count();
  sides["interior_count"] = count();
  sides["not_judged"] = described({{"type", Json::array({"string", "null"})}}, "why the sides are not held against Gibson's table; null: they are");
  sides["holes_given"] = described(strict_object(std::move(closed)),
                                   "the same with shut-in holes of at most half a mean cell given to the cells about them: where cells meet they "
                                   "leave holes of a few pixels, which Gibson's table does not know");
  return strict_object(std::move(sides));
}

Json report_properties() {
  Json cells = Json::object();
  for (const char* name : {"area_px", "perimeter_px", "circularity", "solidity", "eccentricity"}) {
    cells[name] = or_null(strict_object(numbers({"mean", "sd", "min", "max"})));
  }
  cells["measured_count"] = described(count(), "cells in these means: of 20 pixels and more, and seen by half of their own outline");
  cells["partly_hidden_count"] = described(count(), "cells of which less than half is seen: what lies over them gives them their shape, so they are in no mean");
  const Json group = strict_object({{"count", count()}, {"mean", number()}, {"se", number()}});
  const Json straightness =
      strict_object({{"siblings", group}, {"others", group}, {"difference", number()}, {"t", number()}});
  Json ring = numbers({"inner_px", "outer_px", "area_mean_px", "area_se_px", "density_per_px"});
  ring["cell_count"] = described(count(), "cells seen there");
  ring["covered_px"] = count();
  ring["active_share"] = nullable_number();
  Json apart =
      numbers({"share", "apart_area_cv", "apart_circularity_sd", "other_area_cv", "other_circularity_sd"});
  apart["apart_count"] = apart["other_count"] = count();
  const Json lines = {{"walls", reference("MeasuredLine")}, {"outline", reference("MeasuredLine")}};
  Json control = {{"name", {{"enum", {"without_noise", "hexagonal", "random_discs"}}}},
                  {"placement", {{"enum", {"same_places", "touching", "spread"}}}}};
  control.update(lines);
  return {{"um_per_px", nullable_number()},
          {"cell_count", described(count(), "all cells of the colony, hidden ones too; of a picture the objects seen")},
          {"visible_cell_count", described(count(), "those seen from above: the figures of the picture are about them")},
          {"cell_area_mean_px", described(number(), "covered pixels / visible_cell_count")},
          {"px_per_cell_diameter", number()},
          {"verdict", described(texts(), "what follows from the figures, and what does not")},
          {"findings", reference("Findings")},
          {"fractal", strict_object(lines)},
          {"controls", list(strict_object(std::move(control)))},
          {"object_cover", described(number(), "share of their convex hull that the labels take; below 0.7 controls are spread over it")},
          {"colony", colony_schema()},
          {"cells", strict_object(std::move(cells))},
          {"neighbours", neighbours_schema()},
          {"sibling_straightness", or_null(straightness)},
          {"rings", described(list(strict_object(std::move(ring))),
                              "of equal width from the middle to the farthest cell centre; pixels beyond it, the outer halves of the outermost cells, "
                              "are in none")},
          {"apart", strict_object(std::move(apart))}};
}

Json unmeasured() { return strict_object({{"reason", text()}}); }

Json phase(const char* value_name) {
  return or_null(strict_object({{"from_h", number()},
                                {"to_h", number()},
                                {"row_count", count()},
                                {value_name, nullable_number()},
                                {"low", nullable_number()},
                                {"high", nullable_number()},
                                {"r2", number()}}));
}

Json packing_schema() {
  Json properties = numbers({"union_um3", "void_um3", "void_share", "retained_mean", "retained_sd",
                             "retained_5_percent", "retained_min"});
  properties["most_pressed_cell_id"] = count();
  properties["reason"] = {{"type", "null"}};
  return {{"oneOf", Json::array({strict_object(std::move(properties)), unmeasured()})}};
}

Json growth_schema() {
  return {{"oneOf", Json::array({strict_object({{"lag", phase("cell_count")},
                                                {"exponential", phase("doubling_time_h")},
                                                {"linear_radius", phase("speed_um_per_h")},
                                                {"plateau", phase("cell_count")},
                                                {"relative_sd", number()},
                                                {"bic", nullable_number()},
                                                {"reason", {{"type", "null"}}}}),
                                 unmeasured()})}};
}

Json metadata_schema() {
  return strict_object({{"media_type", text()},
                        {"colour_model", {{"enum", {"grey", "rgb", "channels"}}}},
                        {"width_px", count()},
                        {"height_px", count()},
                        {"channel_count", count()},
                        {"bits", count()},
                        {"um_per_px", described(nullable_number(), "the scale that was used")},
                        {"um_per_px_source", {{"enum", {"none", "given", "ome"}},
                                              {"description", "given: by the query; ome: by the file's OME metadata; a contradiction is in notes"}}},
                        {"um_per_px_stated", described(nullable_number(), "by the file; used only where OME metadata says it and nothing contradicts it")},
                        {"channel", {{"type", Json::array({"integer", "null"})}}},
                        {"level_low", count()},
                        {"level_high", count()},
                        {"notes", texts()}});
}

Json segmentation_schema() {
  Json properties = numbers({"foreground_share", "area_mean_px", "area_median_px"});
  for (const char* name :
       {"threshold", "background_reach_px", "area_min_px", "field_px", "object_count", "foreground_px"}) {
    properties[name] = count();
  }
  properties["pipeline"] = {{"enum", {"nuclei", "phase", "contours"}}};
  properties["foreground"] = {{"enum", {"light", "dark"}}};
  for (const char* name : {"pipeline_given", "foreground_given", "threshold_given", "dish_found"}) properties[name] = boolean();
  properties["pipeline_reason"] = described(text(), "why this pipeline, and which one else there is");
  properties["foreground_reason"] = text();
  properties["levels"] = described(or_null(strict_object(numbers({"between_share", "skewness", "kurtosis"}))),
                                   "of the step signal: share of the variance between Otsu's classes, skewness, kurtosis; a normal distribution has 0.637, 0, 3");
  properties["doubt"] = described({{"type", Json::array({"string", "null"})}}, "why there may be nothing in the picture");
  for (const char* name : {"area_mean_um2", "foreground_um2", "density_per_mm2"}) properties[name] = nullable_number();
  properties["sweep"] =
      list(strict_object({{"threshold", count()}, {"foreground_px", count()}, {"object_count", count()}}));
  return strict_object(std::move(properties));
}

}  // namespace

Json report_components() {
  Json job = {{"time_h", number()}, {"last_seq", count()}, {"digest", text()}};
  job.update(report_properties());
  job["packing"] = packing_schema();
  job["growth"] = growth_schema();
  Json shapes = report_properties();
  for (const char* name : {"verdict", "findings", "fractal", "controls"}) shapes.erase(name);
  return {{"Shapes", strict_object(std::move(shapes))},
          {"Dimension",
           strict_object({{"value", number()},
                          {"se", described(number(), "of the line, not of the dimension")},
                          {"r2", number()},
                          {"range_px", {{"type", "array"}, {"items", count()}, {"minItems", 2}, {"maxItems", 2}}}})},
          {"MeasuredLine", line_schema()},
          {"Findings", findings_schema()},
          {"ThresholdSweep", threshold_sweep_schema()},
          {"JobAnalysis", strict_object(std::move(job))},
          {"ImageMetadata", metadata_schema()},
          {"Segmentation", segmentation_schema()}};
}

}  // namespace colony::server::api
