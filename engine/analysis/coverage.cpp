#include "engine/analysis/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr double kCoordinateMax_um = 2e9;  // a grid index fits 32 bits; cells lie within 1e9 um (grid.cpp)
constexpr std::uint8_t kCountMax = std::numeric_limits<std::uint8_t>::max();

std::int32_t grid_index(double coordinate_um) {
  CHECK(std::abs(coordinate_um) < kCoordinateMax_um);
  const auto truncated = static_cast<std::int32_t>(coordinate_um);
  return static_cast<double>(truncated) > coordinate_um ? truncated - 1 : truncated;
}

std::uint64_t key_of(std::int32_t tile_column, std::int32_t tile_row) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(tile_column)) << 32 |
         static_cast<std::uint32_t>(tile_row);
}

}  // namespace

/// A footprint is convex: the centres inside it in one row are those from the first to the last that it contains.
void add_spans(const Body& body, std::vector<RowSpan>& spans) {
  const Vec2 half_um = body.footprint_half_extent_um();
  const Vec3& centre_um = body.centre_um();
  // One more on every side: the extent and the containment test round differently.
  const std::int32_t left = grid_index(centre_um.x() - half_um.x()) - 1,
                     right = grid_index(centre_um.x() + half_um.x()) + 1;
  const std::int32_t bottom = grid_index(centre_um.y() - half_um.y()) - 1,
                     top = grid_index(centre_um.y() + half_um.y()) + 1;
  for (std::int32_t row = bottom; row <= top; ++row) {
    const double y_um = static_cast<double>(row) + 0.5;
    const auto inside = [&](std::int32_t column) {
      return body.footprint_contains(static_cast<double>(column) + 0.5, y_um);
    };
    std::int32_t first = left, last = right;
    while (first <= last && !inside(first)) ++first;
    while (last > first && !inside(last)) --last;
    if (first <= last) spans.push_back({row, first, last});
  }
}

void Coverage::change(const Body& body, bool add) {
  spans_.clear();
  add_spans(body, spans_);
  if (spans_.empty()) return;
  std::int32_t left = spans_.front().first, right = spans_.front().last;
  for (const RowSpan& span : spans_) {
    left = std::min(left, span.first);
    right = std::max(right, span.last);
  }
  const std::int32_t tile_left = left >> kTileShift, tile_right = right >> kTileShift;
  const auto width = static_cast<std::size_t>(tile_right - tile_left + 1);
  for (std::size_t next = 0; next < spans_.size();) {
    const std::int32_t tile_row = spans_[next].row >> kTileShift;
    tile_row_.assign(width, nullptr);
    for (; next < spans_.size() && spans_[next].row >> kTileShift == tile_row; ++next) {
      change_row(spans_[next], tile_left, add);
    }
    if (add) continue;
    for (std::size_t i = 0; i < width; ++i) {
      if (tile_row_[i] != nullptr && tile_row_[i]->covered == 0) {
        tiles_.erase(key_of(tile_left + static_cast<std::int32_t>(i), tile_row));
      }
    }
  }
}

void Coverage::change_row(const RowSpan& span, std::int32_t tile_left, bool add) {
  const std::int32_t tile_row = span.row >> kTileShift;
  const auto row_start = static_cast<std::size_t>(span.row & (kTileSide - 1)) * kTileSide;
  for (std::int32_t first = span.first; first <= span.last;) {
    const std::int32_t tile_column = first >> kTileShift;
    const std::int32_t last = std::min(span.last, first | (kTileSide - 1));
    Tile*& tile = tile_row_[static_cast<std::size_t>(tile_column - tile_left)];
    if (tile == nullptr) {
      const std::uint64_t key = key_of(tile_column, tile_row);
      if (add) {
        tile = &tiles_[key];
      } else {
        const auto found = tiles_.find(key);
        CHECK(found != tiles_.end());
        tile = &found->second;
      }
    }
    for (std::int32_t column = first; column <= last; ++column) {
      const std::size_t at = row_start + static_cast<std::size_t>(column & (kTileSide - 1));
      if (add) {
        raise(*tile, at, column, span.row);
      } else {
        lower(*tile, at, column, span.row);
      }
    }
    first = last + 1;
  }
}

void Coverage::raise(Tile& tile, std::size_t at, std::int32_t column, std::int32_t row) {
  std::uint8_t& count = tile.counts[at];
  if (count == kCountMax) {
    ++above_[{column, row}];
    return;
  }
  if (count++ != 0) return;
  ++tile.covered;
  ++area_um2_;
}

void Coverage::lower(Tile& tile, std::size_t at, std::int32_t column, std::int32_t row) {
  std::uint8_t& count = tile.counts[at];
  CHECK(count > 0);
  if (count == kCountMax) {
    if (const auto more = above_.find({column, row}); more != above_.end()) {
      if (--more->second == 0) above_.erase(more);
      return;
    }
  }
  if (--count != 0) return;
  --tile.covered;
  --area_um2_;
}

}  // namespace colony
