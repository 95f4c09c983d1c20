// founding: colonies for tests, from given cells, by `founded` events as the simulator writes them.
#pragma once

#include <cmath>
#include <vector>

#include "engine/base/maths.hpp"
#include "engine/model/colony.hpp"
#include "engine/random/stream.hpp"

namespace colony::testing {

/// The preset `paper`; without noise where the truth is to be analytic.
inline Params paper() { return *preset("paper"); }
inline Params paper_without_noise() {
  Params params = paper();
  params.noise.amplitude = 0.0;
  return params;
}

/// A cell that stands on the dish as the model has it, centre at 0.55 C; its nucleus at the centre.
inline Cell cell_at(double x_um, double y_um, const Vec3& semiaxes_um) {
  Cell cell;
  cell.centre_um = Vec3(x_um, y_um, 0.55 * semiaxes_um.z());
  cell.semiaxes_um = semiaxes_um;
  cell.nucleus_um = cell.centre_um;
  cell.nucleus_radius_um = 2.5;
  cell.volume_um3 = volume_above_dish_um3({cell.centre_um, cell.semiaxes_um, cell.rotation_rad, cell.noise_offset});
  return cell;
}
inline Cell ball_at(double x_um, double y_um, double radius_um) {
  return cell_at(x_um, y_um, Vec3(radius_um, radius_um, radius_um));
}

/// `count` different cells as the model makes them, tilted and noisy, scattered over a square of `side_um`: they
/// overlap if it is small.
inline std::vector<Cell> scattered_cells(int count, double side_um, Seed seed) {
  std::vector<Cell> cells;
  for (int i = 0; i < count; ++i) {
    Stream stream(seed, CellId{static_cast<std::uint32_t>(i + 1)}, 0, Purpose::kFounder);
    const double elongation = stream.uniform({1.0, 1.7});
    const double flatness = stream.uniform({0.3, 0.6});
    const double b_um = stream.uniform({4.5, 6.5});
    Cell cell = cell_at(stream.uniform({-0.5, 0.5}) * side_um, stream.uniform({-0.5, 0.5}) * side_um,
                        Vec3(elongation * b_um, b_um, flatness * std::sqrt(elongation) * b_um));
    cell.rotation_rad =
        Vec3(stream.uniform({-0.07, 0.07}), stream.uniform({-0.07, 0.07}), stream.uniform({0.0, maths::kPi}));
    for (int axis = 0; axis < 3; ++axis) cell.noise_offset[axis] = stream.uniform({0.0, noise_period(paper().noise)});
    cell.volume_um3 = volume_above_dish_um3({cell.centre_um, cell.semiaxes_um, cell.rotation_rad, cell.noise_offset});
    cells.push_back(cell);
  }
  return cells;
}

/// The colony of these cells, numbered 1..n in their order, at `time_h`.
inline Colony found(const Params& params, std::vector<Cell> cells, double time_h = 0.0) {
  Colony colony(params);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i].id = CellId{static_cast<std::uint32_t>(i + 1)};
    // In one piece: GCC 12 sees an uninitialised vector where a default body is replaced, under the sanitizers.
    Event event{i + 1, time_h, cells[i].id, Founded{cells[i]}, {}};
    canonicalise(event);
    event.digest = digest_after(colony.digest(), event);
    colony.apply(event);
  }
  return colony;
}

}  // namespace colony::testing
