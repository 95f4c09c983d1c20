// paths: how far a vertical ray runs in cells, and in nuclei, at every pixel: what brightfield absorbs and phase delays.
// Method:  path_kernel.hpp, on tiles anchored to the frame, so that a pixel is the same whatever rows are asked for with
//          it. The length is that of f~ >= 0, z >= 0, which depends on the contact rule: under `max` cells share the
//          union of the bodies; `sum` leaves voids. A nucleus is the upright spheroid of radius r_n and half height
//          min(r_n, 0.6 C) about its centre, as far as it lies in its cell.
// Units:   um, pixels.
// Errors:  CHECKs the rows and the frame's scale; throws Stopped.
// Threads: bands of rows side by side; sums run over cells by ascending id.
#pragma once

#include <vector>

#include "engine/model/colony.hpp"
#include "engine/picture/frame.hpp"
#include "engine/picture/parallel.hpp"

namespace colony {

/// Levels per least vertical semiaxis: see the accuracy in path_kernel.hpp.
inline constexpr double kPathLevelsPerSemiaxis = 16.0;
/// Half height of a nucleus over C, at most.
inline constexpr double kNucleusHeightShare = 0.6;

/// Half height of a cell's nucleus, um.
double nucleus_half_height_um(const Cell& cell);

/// One entry a pixel, row-major from row `rows.first`.
struct PathView {
  Frame frame;
  RowRange rows;
  std::vector<float> cell_um;     // in all cells together, nuclei included
  std::vector<float> nucleus_um;  // in all nuclei together
  std::size_t index(std::int64_t row, std::int64_t column) const {
    return static_cast<std::size_t>((row - rows.first) * frame.width_px + column);
  }
};

PathView path_lengths(const Colony& colony, ContactRule rule, const Frame& frame, RowRange rows,
                      const Effort& effort = {});

/// Volume of every deformed cell, um3, by id.value - 1: the sum of its lengths times the pixel's area, over the whole
/// frame. Of pixels of 0.1 r the error is about 0.1 % (tests/unit/paths_test.cpp).
std::vector<double> path_volumes_um3(const Colony& colony, ContactRule rule, const Frame& frame,
                                     const Effort& effort = {});

}  // namespace colony
