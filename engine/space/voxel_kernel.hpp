// voxel_kernel: a body's cubes, a row of them at a time (voxels.hpp).
// Threads: pure.
#pragma once

#include <cstdint>

#include "engine/space/overlap_kernel.hpp"

namespace colony::kernel {

/// Sets bit i % 32 of word i / 32 of row (k, j) where the point edge * (i, j, k) lies inside `body`; other bits of the words to 0.
void raster_rows(const FloatBody& body, float edge, std::int32_t nx, std::int32_t ny, std::int32_t nz, std::int32_t words_per_row,
                 std::uint32_t* rows);

}  // namespace colony::kernel
