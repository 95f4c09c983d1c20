// scaling: dimensions from box counts, and whether the log-log line is scaling at all or a crossover between two regimes.
// Method:  D0 = -slope of ln N on ln s, D1 = -slope of I on ln s, ordinary least squares over a geometric series of box sides.
//          N and I are means over the grid offsets; the smallest cover (least N of all offsets) is fitted beside them.
// Range:   sides from side_min_px to extent / 8, extent = the longer side of the foreground's box, where the grid begins.
// Meaning: the standard error is that of the line, not of the dimension: counts at neighbouring sides share their noise, and on
//          generic boxes the bias is 0.01..0.05, larger. A small error and an R2 near 1 prove no scaling: see Crossover.
// Units:   pixels; dimensions and information (nats) are pure numbers.
// Errors:  kInvalid (field `image`): no foreground; nothing but foreground; an extent that leaves fewer than kSidesMin sides.
// Threads: as count_boxes.
// Source:  the paper, section 5; the crossover rule is ours (engine/DESIGN.md).
#pragma once

#include <string>
#include <vector>

#include "engine/analysis/box_counting.hpp"
#include "engine/analysis/line_fit.hpp"

namespace colony {

inline constexpr std::size_t kSidesMin = 6;

/// Where the local slopes drift over the range, the line joins two regimes (below and above the size of a cell, say), and its slope
/// is the dimension of neither. The rule, on the parabola through ln N against ln s: crossover if its curvature differs from 0 at the
/// level 0.01 (t test) and it changes the local slope over the range by more than kDriftMax. Self-similar sets make the slopes
/// swing, not drift (at most 0.22 here, and smooth curves 0.16); packed circles drift by 0.5 and more.
struct Crossover {
  bool found = false;
  double drift = 0.0;          // change of the local dimension from the smallest to the largest side, by the parabola
  double drift_se = 0.0;
  double t = 0.0;              // |drift| / drift_se
  double t_critical = 0.0;     // two-sided, kCrossoverAlpha
};
inline constexpr double kDriftMax = 0.30;
inline constexpr double kCrossoverAlpha = 0.01;

struct LocalSlope {
  double side_px = 0.0;        // geometric mean of the two sides
  double dimension = 0.0;      // -(ln N2 - ln N1) / (ln s2 - ln s1)
};

/// One fitted dimension.
struct Dimension {
  double value = 0.0;
  double standard_error = 0.0; // of the line's slope
  double r2 = 0.0;
  std::vector<LocalSlope> local;
};

struct BoxDimensions {
  std::vector<BoxCount> counts;      // by rising side: the curve itself
  PixelBox part;                     // what was counted
  std::int64_t side_min_px = 0, side_max_px = 0;  // the range used
  std::uint64_t foreground_px = 0;
  Dimension capacity;                // D0, offset mean
  Dimension smallest_cover;          // D0 by the least count
  Dimension information;             // D1, offset mean
  Crossover crossover;               // of `capacity`
};

struct BoxOptions {
  double side_min_px = 3.0;          // [1, 100]
  double side_ratio = 1.3;           // [1.05, 4]
  double extent_share = 0.125;       // largest side / extent, [0.01, 0.5]
  int offsets_per_axis = 8;          // [1, 32]
  int threads = 1;                   // [1, kAnalysisThreadsMax]
  /// Not empty: exactly these (rising, at least 3) in `part`, by default the whole image: then curves of several images share their sides.
  std::vector<std::int64_t> sides_px = {};
  PixelBox part = {};
};

/// kInvalid, naming the field, unless all options are within their ranges.
Status check_box_options(const BoxOptions& options);

/// round(side_min ratio^k), each once, up to extent_px * extent_share.
std::vector<std::int64_t> geometric_sides(std::int64_t extent_px, const BoxOptions& options);

/// Lines and local slopes through given counts, by rising side; at least 3.
BoxDimensions fit_dimensions(std::vector<BoxCount> counts);

/// D0, D1, the curve and the verdict for the foreground of `image`.
Result<BoxDimensions> box_dimensions(const BinaryImage& image, const BoxOptions& options, StopFlag stop = nullptr);
/// The same of a measure: a pixel's value is its mass.
Result<BoxDimensions> box_dimensions(const ImageOf<std::uint32_t>& mass, const BoxOptions& options, StopFlag stop = nullptr);

}  // namespace colony
