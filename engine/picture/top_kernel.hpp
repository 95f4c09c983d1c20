// top_kernel: ColumnScan::top_um (column.hpp) for a row of columns side by side.
// Why the same bits everywhere: a column is a lane, and a lane does what the scalar scan does, operation for operation: only + - * / sqrt, a compare
//          and a sign bit, in double, in one fixed order. A lane that is done waits for the others; what it computes meanwhile is thrown away.
//          So the scalar scan is the reference, equal to the last bit (tested, on every target).
// Units:   um. Shapes: arrays of n, readable and writable kTopRun.
// Threads: pure.
#pragma once

#include <cstddef>

namespace colony::kernel {

/// Columns handled by one call, at most; a multiple of every vector.
inline constexpr std::size_t kTopRun = 64;

/// A body prepared for its columns: the members of ColumnScan and of its Body.
struct TopBody {
  double to_unit[9];   // row by row
  double centre_um[3];
  double step[3];      // change of (u, v, w) per um of z
  double step_squared;
  double noise_offset[3];
  double amplitude, frequency, phase;
  double amplitude_ratio, frequency_ratio;  // of the two terms of Gardner's series
  double noise_bound;
  double rate[3];          // |step|
  double factor_slope[3];  // of Gx, Gy, Gz, at most, per um of z
  double step_min_um;
};

/// top_um[i]: the highest z > floor_um[i] with f >= 0 in the column (x_um[i], y_um), or floor_um[i]. 1 <= n <= kTopRun.
void column_tops(const TopBody& body, const double* x_um, double y_um, const double* floor_um, std::size_t n, double* top_um);

}  // namespace colony::kernel
