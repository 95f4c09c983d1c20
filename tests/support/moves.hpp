// moves: what the tests of moves share: a model that crawls, cells that sleep, a ring that encloses.
#pragma once

#include <vector>

#include "engine/sim/decide_move.hpp"
#include "tests/support/founding.hpp"

namespace colony::testing {

inline Params crawling(double rate_per_h = 0.1, double bias = 0.5) {
  Params params = *preset("young-colony");
  params.motility.rate_per_h = rate_per_h;
  params.motility.bias = bias;
  return params;
}

inline Moved move_of(const Colony& colony, const Params& params, Seed seed, CellId id, double time_h = 10.0) {
  Workspace workspace(params);
  return std::get<Moved>(decide_move(colony, params, seed, id, time_h, workspace).body);
}

inline Cell asleep(Cell cell, double free_share) {
  cell.activity = Activity::kPassive;
  cell.free_share = free_share;
  cell.try_count = 2;
  return cell;
}

/// A ball and, close around it, `count` others in a ring.
inline std::vector<Cell> ring(int count, double distance_um, double radius_um = 5.0) {
  std::vector<Cell> cells = {ball_at(0.0, 0.0, radius_um)};
  for (int k = 0; k < count; ++k) {
    const auto [s, c] = maths::sincos(2.0 * maths::kPi * k / count);
    cells.push_back(ball_at(distance_um * c, distance_um * s, radius_um));
  }
  return cells;
}

}  // namespace colony::testing
