// series: the growth curve, one row a moment.
// Method:  area = union of the noise-free projections on a 1 um grid anchored at the origin; radius = sqrt(area / pi).
// Units:   h, um, um2, um3, cells per mm2.
// Threads: pure.
#pragma once

#include <cstdint>

#include "engine/model/colony.hpp"

namespace colony {

struct SeriesRow {
  double time_h = 0.0;
  std::uint64_t cell_count = 0, active_count = 0, passive_count = 0, senescent_count = 0;
  double volume_mean_um3 = 0.0;
  double volume_sd_um3 = 0.0;      // of the population (divides by n)
  double radius_um = 0.0;
  double area_um2 = 0.0;
  double density_per_mm2 = 0.0;    // cells / area
};

/// The row of `colony` at `time_h` (zeros for a colony without cells).
SeriesRow measure_series(const Colony& colony, double time_h);

}  // namespace colony
