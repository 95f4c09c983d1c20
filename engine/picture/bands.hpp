// bands: which cells a band of rows can show. Bands are the pieces that threads work on.
// Method:  one pass over all boxes. Not the grid: its columns are many more than the cells where few cells lie far apart.
// Units:   um, pixels.
// Errors:  CHECKs the rows.
// Threads: pure.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/model/colony.hpp"
#include "engine/picture/frame.hpp"
#include "engine/picture/pixels.hpp"

namespace colony {

inline constexpr std::int64_t kBandRows_px = 16;

/// Indices of the pixel centres in [low, high], clipped to [begin, end).
struct Span {
  std::int64_t begin;
  std::int64_t end;
};
inline Span centres_within(double low_px, double high_px, std::int64_t begin, std::int64_t end) {
  const double low = std::clamp(low_px - 0.5, static_cast<double>(begin), static_cast<double>(end));
  const double high = std::clamp(high_px - 0.5, static_cast<double>(begin) - 1.0, static_cast<double>(end) - 1.0);
  return {ceil_to_int(low), floor_to_int(high) + 1};
}

/// Columns whose centres lie in the box, clipped to the frame.
inline Span columns_of(const Box& box, const Frame& frame) {
  return centres_within((box.low.x() - frame.left_um) / frame.um_per_px,
                        (box.high.x() - frame.left_um) / frame.um_per_px, 0, frame.width_px);
}
/// Rows whose centres lie in the box, clipped to `rows`.
inline Span rows_of(const Box& box, const Frame& frame, RowRange rows) {
  return centres_within((frame.top_um - box.high.y()) / frame.um_per_px, (frame.top_um - box.low.y()) / frame.um_per_px,
                        rows.first, rows.end);
}

/// The rows asked for, cut into bands at multiples of kBandRows_px, with the cells of each by ascending id.
class BandCells {
 public:
  BandCells(const Colony& colony, const Frame& frame, RowRange rows);

  std::size_t band_count() const { return of_band_.size(); }
  RowRange band(std::size_t index) const {
    const std::int64_t first = (first_band_ + static_cast<std::int64_t>(index)) * kBandRows_px;
    return {std::max(first, rows_.first), std::min(first + kBandRows_px, rows_.end)};
  }
  std::span<const CellId> of_band(std::size_t index) const { return of_band_[index]; }

 private:
  RowRange rows_;
  std::int64_t first_band_ = 0;
  std::vector<std::vector<CellId>> of_band_;
};

}  // namespace colony
