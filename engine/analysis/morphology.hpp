// morphology: size and shape of every cell of a label image, and of the colony as a whole.
// Method:  areas and second moments are exact integer sums over pixels. The convex hull (OpenCV) is that of the pixels' corners, so
//          no solidity exceeds 1. Perimeter: Crofton's formula with four directions, pi/8 (n_h + n_v + (n_d1 + n_d2) / sqrt 2), n = changes
//          between inside and outside along all lines of one direction. It is unbiased for borders of all directions (a disc of
//          radius 20: within 1 %), 5 % short for axis-parallel squares, and holes count.
// Units:   pixels; x to the right and y down from the frame's upper left corner, a pixel's centre at (column + 0.5, row + 0.5).
// Errors:  kLimit / kInvalid (field `image`): check_image's, no labels, more than kLabelsMax labels or kRunsMax runs of one label.
// Threads: pure. Sums are integers; labels ascend.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/analysis/image.hpp"
#include "engine/base/stop.hpp"

namespace colony {

inline constexpr std::size_t kLabelsMax = 200'000;
inline constexpr std::size_t kRunsMax = 50'000'000;
/// Below it a shape is that of pixels more than of a cell. Circularity: one pixel has 1.75, two or four 1.20; from 5 px on 1.08 is the most, which falls to
/// the 1.055 of octagons at any size, whose flat sides lie along all four directions of the perimeter.
inline constexpr std::uint64_t kShapePxMin = 20;

struct Shape {
  std::uint32_t label = 0;
  std::uint64_t area_px = 0;
  double centre_x_px = 0.0, centre_y_px = 0.0;
  double perimeter_px = 0.0;
  double circularity = 0.0;      // 4 pi area / perimeter^2: 1 for a disc; from 5 px on at most 1.08: see kShapePxMin
  double solidity = 0.0;         // area / area of the convex hull
  double eccentricity = 0.0;     // sqrt(1 - l2 / l1) of the second moments, a pixel's own 1/12 included: 0 for a disc
  double hull_area_px = 0.0;
  double hull_perimeter_px = 0.0;
  bool at_frame = false;         // has a pixel at the frame's edge: it may be cut
  bool is_measured = true;       // kShapePxMin pixels or more (and, as analyse_labels finds it, seen by half): counts in means of shape
};

/// One entry a label, ascending. A label of several pieces is measured as one set.
/// Throws Stopped.
Result<std::vector<Shape>> cell_shapes(const LabelImage& labels, StopFlag stop = nullptr);

struct ColonyShape {
  Shape shape;                   // of the largest piece, holes filled
  std::uint64_t piece_count = 0; // 8-connected parts of the union, holes filled
  std::uint64_t covered_px = 0;  // pixels of any label, in all pieces
  std::uint64_t hole_count = 0;  // 4-connected background parts that are shut in
  std::uint64_t hole_px = 0;
  double open_share = 0.0;       // of the hull of all pieces: not covered by any label
  double hull_area_px = 0.0;     // of all pieces together
  // Roughness of the largest piece's outline.
  double radius_mean_px = 0.0;   // of outline pixels about the piece's centre
  double radius_rms_px = 0.0;    // root mean square deviation from that mean
  double roughness = 0.0;        // radius_rms / radius_mean: 0 for a circle; an ellipse has some without being rough
  double excess_perimeter = 0.0; // perimeter / hull perimeter - 1: 0 for any convex outline, to the estimator's error
};

/// `gap_px` as in outside_of. Throws Stopped.
Result<ColonyShape> colony_shape(const LabelImage& labels, std::int64_t gap_px = 0, StopFlag stop = nullptr);

}  // namespace colony
