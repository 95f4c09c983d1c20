// packing: what the bodies of a colony say and no picture shows: how much of itself a cell keeps between its neighbours, what the
//          contact rule `sum` leaves to nobody, who is whose sibling, who is active.
// Method:  scrambled Sobol points in every body's box. A point inside k bodies stands for 1/k of its share of the union, so that each
//          place counts once; it is void when no deformed cell holds it: largest f < sum of the other positive f.
// Units:   um3; shares in [0, 1].
// Errors:  kInvalid: `points` no power of two in 64..65,536; kInvalid: a colony without cells. Throws Stopped.
// Accuracy: a cell's volume to 1.1 % at 1,024 points (space/overlap.hpp); shares of a colony of n cells about 1/sqrt(n) of that.
// Random:  Purpose::kControl.      Threads: one slot a cell, summed in id order; the thread count cannot matter.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/base/stop.hpp"
#include "engine/model/colony.hpp"

namespace colony {

struct PackingStatistics {
  double union_um3 = 0.0;              // of all bodies above the dish
  double void_um3 = 0.0;               // of it, in no deformed cell; exactly 0 under `max`
  double void_share = 0.0;
  double retained_mean = 0.0;          // of a cell's own body, inside its deformed cell
  double retained_sd = 0.0;
  double retained_5_percent = 0.0;     // quantile: a twentieth of the cells keep less
  double retained_min = 0.0;
  CellId most_pressed;                 // the lowest id of those with that least share
  friend bool operator==(const PackingStatistics&, const PackingStatistics&) = default;
};

Result<PackingStatistics> packing_statistics(const Colony& colony, ContactRule rule, Seed seed, std::uint32_t points = 1024,
                                             int threads = 1, StopFlag stop = nullptr);

/// Labels of the two cells of each division after which neither has divided again, by ascending daughter.
std::vector<std::pair<std::uint32_t, std::uint32_t>> sibling_pairs(const Colony& colony);
/// Ids of the active cells, ascending.
std::vector<std::uint32_t> active_labels(const Colony& colony);

}  // namespace colony
