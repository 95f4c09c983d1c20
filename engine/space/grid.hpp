// grid: which cells may be near a place. Square columns over the dish; a cell is listed in the column of its centre.
// Threads: queries are pure; put and remove are exclusive.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "engine/base/types.hpp"
#include "engine/shape/body.hpp"

namespace colony {

class Grid {
 public:
  /// `half_extent_max_um`: no listed box reaches further than this from its centre along x or y (CHECKed in put).
  explicit Grid(double half_extent_max_um);

  void put(CellId id, const Vec3& centre_um, const Box& box);
  void remove(CellId id, const Vec3& centre_um);
  /// Ids of every cell whose box may meet `box`, ascending, into `out` (cleared first). A superset: the caller tests the boxes.
  void candidates(const Box& box, std::vector<CellId>& out) const;

 private:
  using Key = std::uint64_t;
  Key key_of(double x_um, double y_um) const;

  double half_extent_max_um_;
  double pitch_um_;
  std::unordered_map<Key, std::vector<CellId>> columns_;  // looked up, never iterated: order cannot matter
};

}  // namespace colony
