// coverage: how many footprints lie over each 1 um cell of a grid anchored at the origin, kept while bodies come and go.
// Method:  a grid cell is covered by a body if its centre lies in the body's noise-free projection. Counts of 8 bits in tiles of
//          16 x 16, made when the first footprint touches them and gone with the last; what exceeds 8 bits stands in a map.
// Units:   um, um2.
// Memory:  about 310 bytes a tile: 135 bytes a cell in a confluent layer, at most 9 tiles for a lone cell of up to 32 um.
// Errors:  CHECKs that coordinates fit 32 bits, and that only what was added is removed.
// Threads: exclusive. Tiles are looked up, never iterated: the area is a function of what was added less what was removed.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "engine/shape/body.hpp"

namespace colony {

/// Grid cells first..last of one row, whose centres (first + 0.5, row + 0.5) ... lie in one footprint.
struct RowSpan {
  std::int32_t row = 0;
  std::int32_t first = 0;
  std::int32_t last = 0;
  friend auto operator<=>(const RowSpan&, const RowSpan&) = default;
};

/// Appends the spans of `body` to `spans`, rows ascending. Every other way of measuring the area starts from these.
void add_spans(const Body& body, std::vector<RowSpan>& spans);

class Coverage {
 public:
  void add(const Body& body) { change(body, true); }
  /// `body` was added before, and not yet removed.
  void remove(const Body& body) { change(body, false); }
  /// Grid cells under at least one footprint.
  std::uint64_t area_um2() const { return area_um2_; }
  /// For tests of the bound on memory.
  std::size_t tile_count() const { return tiles_.size(); }

 private:
  static constexpr int kTileShift = 4;
  static constexpr std::int32_t kTileSide = 1 << kTileShift;
  struct Tile {
    std::array<std::uint8_t, std::size_t{kTileSide} * kTileSide> counts{};
    std::uint16_t covered = 0;  // counts that are not 0
  };

  void change(const Body& body, bool add);
  void change_row(const RowSpan& span, std::int32_t tile_left, bool add);
  void raise(Tile& tile, std::size_t at, std::int32_t column, std::int32_t row);
  void lower(Tile& tile, std::size_t at, std::int32_t column, std::int32_t row);

  std::unordered_map<std::uint64_t, Tile> tiles_;  // by tile column and row; looked up, never iterated
  std::map<std::pair<std::int32_t, std::int32_t>, std::uint32_t> above_;  // (column, row) -> count beyond 255; none is 0
  std::uint64_t area_um2_ = 0;
  std::vector<RowSpan> spans_;     // scratch
  std::vector<Tile*> tile_row_;    // scratch: the tiles of the rows under way
};

}  // namespace colony
