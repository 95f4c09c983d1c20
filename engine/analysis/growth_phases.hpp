// growth_phases: exponential growth, growth of the radius at constant speed, plateau: which are there, when, and how fast.
// Model:   ln N = a + b t; then R = c + v t; then N constant. Each may be missing, but not all; each has at least kPhaseRowsMin rows.
// Rule:    change points and the set of phases are those of the least BIC = n ln(S / n) + k ln n. S sums squared relative deviations of N:
//          of ln N in the exponential phase and the plateau; 2 (q - fit) / q in the linear one, q = sqrt N, which goes as R there: one quantity
//          throughout, else the sums could not be compared. k: two for a line, one for a plateau, one for each change point, one for the
//          scatter. Phases need not join: nature has no corners. The speed is then that of R itself.
// Lag:     a first phase whose slope has 0 in its interval is no growth (one cell that has not divided yet): it is called lag.
// Intervals: 95 %, Student's t on the line's standard error times sqrt((1 + r) / (1 - r)), r = correlation of neighbouring residuals
//          (0..0.95): counts add up, so rows are not independent. Change points have no interval.
// Units:   h, um.
// Errors:  kInvalid (field `series`): fewer than kPhaseRowsMin rows, times that do not rise, sizes or radii that are not above 0;
//          kLimit: more than kSeriesRowsMax rows (take every n-th).
// Threads: pure.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/analysis/series.hpp"
#include "engine/base/result.hpp"

namespace colony {

inline constexpr std::size_t kPhaseRowsMin = 6;
inline constexpr std::size_t kSeriesRowsMax = 4'000;

/// One moment. A colony without a count of its cells (a photograph) can give its area as the size.
struct GrowthPoint {
  double time_h = 0.0;
  double size = 0.0;
  double radius_um = 0.0;
};

struct GrowthPhase {
  double from_h = 0.0, to_h = 0.0;  // first and last row
  std::size_t row_count = 0;
  double value = 0.0;               // doubling time, h; speed, um per h; size of the plateau
  Interval interval;                // 95 %; high is infinite where a doubling time has no upper bound
  double r2 = 0.0;                  // of the line; 0 for the plateau
};

struct GrowthPhases {
  std::optional<GrowthPhase> lag = {};            // value: size; the first phase where its growth cannot be told from none: then no exponential one
  std::optional<GrowthPhase> exponential = {};    // value: doubling time, h (negative: shrinking)
  std::optional<GrowthPhase> linear_radius = {};  // value: um per h
  std::optional<GrowthPhase> plateau = {};        // value: size
  double relative_sd = 0.0;                       // scatter about the phases, of N
  double bic = 0.0;
};

Result<GrowthPhases> growth_phases(std::span<const GrowthPoint> series);
/// N is the cell count. Rows without area (cells too small for the grid) are refused.
Result<GrowthPhases> growth_phases(std::span<const SeriesRow> series);

}  // namespace colony
