// voxel_kernel: a body's cubes, a row of them at a time (voxels.hpp).
// Threads: pure but for the caller's CountWork.
#pragma once

#include <cstdint>

#include "engine/space/overlap_kernel.hpp"

namespace colony::kernel {

/// Sets bit i % 32 of word i / 32 of row (k, j) where the point edge * (i, j, k) lies inside `body`. The rows, and a word beyond the last, must be
/// there and 0 before. At most 2^31 bits in all.
void raster_rows(const FloatBody& body, float edge, std::int32_t nx, std::int32_t ny, std::int32_t nz, std::int32_t words_per_row,
                 std::uint32_t* rows, CountWork* work = nullptr);

/// Rows (z, y, word) of a raster, of which those with first_y <= y < end_y count. Eight bytes beyond the last are readable.
struct RowRange {
  const std::uint32_t* words;
  std::int32_t words_per_row, ny, nz;
  std::int32_t first_y, end_y;
  std::int32_t at_y;                 // row (z, y) of the raster is row (z, at_y + y) of the counts
};

/// Adds 1, up to 255, to counts[(z n + at_y + y) n + first_x + i] for every set bit i of row (z, y) with 0 <= first_x + i < n. Writes (unchanged)
/// up to 32 counts further.
void add_rows(const RowRange& rows, std::int32_t first_x, std::int32_t n, std::uint8_t* counts);

}  // namespace colony::kernel
