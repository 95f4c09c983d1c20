// compare: a colony at a time against a picture: the same lines, the same counting, the same pixels per cell.
// Method:  the colony is drawn at the scale at which its mean visible cell area in pixels equals the picture's; then both are label images,
//          and both go through analyse_lines.
// Errors:  kInvalid / kLimit naming a field of the body: a picture without cells, a colony without cells, a scale beyond the picture limits.
// Threads: pure. Throws Stopped.
#pragma once

#include "server/api/analyse.hpp"
#include "server/api/measure.hpp"

namespace colony::server::api {

struct Comparison {
  ColonyAt at;
  LabelledColony image;      // of the colony, at the matched scale
  double um_per_px = 0.0;
  LabelReport simulated;
  PictureMeasurement real;
};

Result<Comparison> compare(ColonyAt at, std::string_view picture, const ImageOptions& options, const Effort& effort,
                           Sweep sweep = Sweep::kMake);
Json encode_comparison(const Comparison& comparison);

/// How many pixels the colony will take at the matched scale, from its cells' smooth ellipses without their overlaps and without drawing
/// anything: too low where cells hide each other, by a third in a confluent layer.
std::int64_t compared_px_estimate(const Colony& colony, double cell_area_px);

/// The scale at which `cell_area_px` is the mean visible area of a cell, um per pixel.
Result<double> matched_scale(const Colony& colony, double cell_area_px, const Effort& effort);

/// PNG: both contours above, and below the log-log plots of both with their controls.
std::string comparison_figure(const Comparison& comparison);

}  // namespace colony::server::api
