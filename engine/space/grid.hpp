// grid: which cells may be near a place. Square columns over the dish; a cell is listed in the column of its centre.
// Method:  an open hash table of the columns that hold cells (the plane has no edge and most of it is empty); the cells of a
//          column are a list linked through one number a cell.
// Memory:  4 bytes for each id up to the highest listed; 16 to 32 for each column that holds cells, half as much again while
//          the table doubles. A founder alone in its column is the worst case; in tissue a column holds three cells or more.
// Threads: queries are pure; put and remove are exclusive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/paged.hpp"
#include "engine/base/types.hpp"
#include "engine/shape/body.hpp"

namespace colony {

class Grid {
 public:
  /// `half_extent_max_um`: no listed box reaches further than this from its centre along x or y (CHECKed in put).
  explicit Grid(double half_extent_max_um);

  /// CHECKs that `id` is not listed, and |x|, |y| <= 1e9 um.
  void put(CellId id, const Vec3& centre_um, const Box& box);
  /// CHECKs that `id` is listed in the column of `centre_um`.
  void remove(CellId id, const Vec3& centre_um);
  /// Ids of every cell whose box may meet `box`, each once and in no useful order, into `out` (cleared first). A superset: the
  /// caller tests the boxes and sorts what is left.
  void candidates(const Box& box, std::vector<CellId>& out) const;

  /// All heap that it holds.
  std::size_t memory_bytes() const { return slots_.capacity() * sizeof(Slot) + next_.memory_bytes(); }

 private:
  struct Column {
    std::int32_t x = 0, y = 0;
    friend bool operator==(const Column&, const Column&) = default;
  };
  struct Slot {
    Column column;
    std::uint32_t first = kUnused;            // id of the first cell listed; kEnd: a column whose cells have gone
  };
  static constexpr std::uint32_t kEnd = 0;              // no cell has this id
  static constexpr std::uint32_t kUnused = 0xFFFFFFFF;  // in a slot: no column; in next_: not listed

  Column column_at(double x_um, double y_um) const;
  std::size_t slot_of(Column column) const;             // the column's slot, or the unused one where it would be
  void rebuild();
  void append_list(std::uint32_t first, std::vector<CellId>& out) const;

  double half_extent_max_um_;
  double pitch_um_;
  std::vector<Slot> slots_;                   // a power of two, at most three quarters used
  std::size_t used_count_ = 0;                // slots with a column, those without cells included
  Paged<std::uint32_t> next_;                 // by id.value - 1: the next cell of its column, or kEnd
};

}  // namespace colony
