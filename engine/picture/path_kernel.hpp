// path_kernel: how much of each vertical column lies in each deformed cell and in its nucleus, for a row of columns side
// by side.
// Method:  every f is evaluated at levels z = k dz, k = 0, 1, ...; between two levels f is taken as linear. Then cell i
//          holds the part of the interval where f_i >= 0 and f_i - f_j >= 0 for every j: an intersection of half-lines,
//          so under `max` the cells share the union of the bodies without gap or overlap, to rounding. Under `sum`, where
//          two neighbours are positive at once, f_i - sum f_j >= 0 as well. The nucleus is an upright spheroid; what lies
//          in its own cell counts.
// Why the same bits everywhere: a column is a lane; only + - * / sqrt in a fixed order in it, and a lane's value never
//          depends on its neighbours (what is skipped for a group of lanes is 0, or of certain sign, in each). The noise
//          is left out where it cannot matter: f < 0 for certain, or the cell alone and f > 0 for certain, here and at
//          the next level.
// Accuracy: the linear piece makes a smooth chord shorter by C / 2048 at most at dz = C / 16; a lobe thinner than dz can
//           be missed.
// Units:   um. Shapes: arrays of kPathRun columns, outputs kPathRun for each body.
// Threads: pure but for the caller's buffer.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/space/overlap_kernel.hpp"

namespace colony::kernel {

/// Columns handled by one call, at most.
inline constexpr std::size_t kPathRun = 64;

/// A body and its nucleus, relative to the same origin in the plane; z is the height above the dish.
struct PathBody {
  FloatBody field;
  float nucleus_x = 0.0F, nucleus_y = 0.0F, nucleus_z = 0.0F;
  float nucleus_radius = 1.0F, nucleus_half_height = 1.0F;
};

/// Kept from call to call; one per thread. Grows, never shrinks.
struct PathBuffer {
  struct Active {
    std::size_t body = 0;
    std::size_t first_level = 0, end_level = 0;  // f < 0 outside for certain
    float margin = 0.0F;  // how much 1 - u^2 - v^2 - w^2 changes from level to level near the membrane
    bool has_nucleus = false;
    bool positive = false;
  };
  std::vector<Active> active;
  std::vector<float> lanes;
};

/// cell[i * kPathRun + c], nucleus[...]: length of column c (at x[c], y) in bodies[i] and its nucleus. 1 <= n <=
/// kPathRun; x readable kPathRun.
void column_paths(std::span<const PathBody> bodies, bool largest_only, const float* x, float y, std::size_t n, float dz,
                  PathBuffer& buffer, float* cell, float* nucleus);

}  // namespace colony::kernel
