// support: whether the two new bodies of a division stand on something, where there are several layers.
// Method:  a body stands on the dish (its noise-free ellipsoid reaches z = 0) or on another cell (1 % of its own hits lie inside it). Two new
//          bodies must not hold up only each other: one of them stands on the dish or an older cell, the other on that or on its sibling.
//          Asked once, at the birth: a cell whose support divides or shrinks away stays where it is.
// Shapes:  [0] and [1] as in Pair.      Threads: pure.
// Source:  ours, section 4 of the model (engine/DESIGN.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/shape/body.hpp"

namespace colony {

/// One of the two bodies: counts of the points inside it.
struct Footing {
  bool on_dish = false;
  std::uint32_t hit_count = 0;
  std::uint32_t older_count = 0;     // of those, in an older cell: in the one that holds most, or summed over all where only that is known
  std::uint32_t sibling_count = 0;   // of those, in the other new body
};

/// The share of a body's hits, in percent, by which another one holds it up.
inline constexpr std::uint32_t kSupportPercent = 1;
/// The same in a search. On its few points (about 130 hits) a share of 1 % has a standard error of 0.9 %, and a search takes the luckiest: with
/// 1 % asked there the winner of a lone cell hung in the air on the fresh points in one search of five, with 4 % in one of a thousand.
inline constexpr std::uint32_t kSupportPercentInSearch = 4;

inline bool holds_up(std::uint32_t shared_count, std::uint32_t hit_count, std::uint32_t percent) {
  return hit_count > 0 && 100 * std::uint64_t{shared_count} >= std::uint64_t{percent} * hit_count;
}

inline bool is_supported(const std::array<Footing, 2>& pair, std::uint32_t percent) {
  const auto founded = [&](const Footing& one) { return one.on_dish || holds_up(one.older_count, one.hit_count, percent); };
  const std::array<bool, 2> on_others = {founded(pair[0]), founded(pair[1])};
  for (std::size_t k = 0; k < 2; ++k) {
    if (!on_others[k] && !(on_others[1 - k] && holds_up(pair[k].sibling_count, pair[k].hit_count, percent))) return false;
  }
  return true;
}

/// Whether the noise-free ellipsoid reaches the dish.
inline bool reaches_dish(const Body& body) { return body.centre_um().z() <= body.half_width_um(Vec3::UnitZ()); }

}  // namespace colony
