// box_counting: how many boxes of a grid a set meets, and how its mass is spread over them, for many box sides and grid offsets.
// Method:  the image is cut into bands of `side` rows; the sums of a band's columns, added up from the left, give the mass of every
//          box for every column offset by one subtraction. So the cost does not depend on how the offsets are chosen: rows x row
//          offsets to add up, and one step a box. All that is counted is an integer.
// Shapes:  offsets form a product: every row offset with every column offset, per side. Boxes at the frame's edge may reach beyond it.
// Units:   pixels.
// Errors:  kInvalid / kLimit with the field: an image that check_image refuses; no foreground; sides outside 1..20,000; too many.
// Limits:  image sides 20,000; 64 sides; 32 offsets an axis. Memory: 24 bytes a column and thread, none a pixel.
// Threads: pure. Each (side, row offset) is one task with its own slot; the thread count cannot change a bit of the result.
// Source:  the definition; information: Renyi 1959, as in the model's section 7.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/analysis/image.hpp"
#include "engine/base/stop.hpp"

namespace colony {

inline constexpr std::size_t kBoxSidesMax = 64;
inline constexpr int kBoxOffsetsPerAxisMax = 32;

/// Part of an image: rows [top, top + height) and columns [left, left + width).
struct PixelBox {
  std::int64_t left = 0, top = 0, width = 0, height = 0;
  std::int64_t longer_side() const { return width > height ? width : height; }
  friend bool operator==(const PixelBox&, const PixelBox&) = default;
};

/// What is counted. Boxes of the grid with offset (r, c) begin at rows top + r + k side and columns left + c + k side of `part`, for
/// all integers k: with (0, 0) one begins at its corner.
struct BoxGrid {
  PixelBox part;                           // what lies outside is not looked at
  std::vector<std::int64_t> sides_px;      // any order, at most kBoxSidesMax
  /// Offsets an axis: floor(i side / n) for i < n, each once: a side below n has only `side` different ones. 1 is offset 0 alone.
  int offsets_per_axis = 8;
};

/// One box side, over all grid offsets.
struct BoxCount {
  std::int64_t side_px = 0;
  std::int64_t offset_count = 0;
  double count_mean = 0.0;                 // N(s): boxes with any mass, mean over the offsets
  std::uint64_t count_min = 0;             // the smallest cover
  std::uint64_t count_max = 0;
  double information_mean = 0.0;           // I(s) = -sum p ln p in nats, mean over the offsets
  double information_min = 0.0;
  friend bool operator==(const BoxCount&, const BoxCount&) = default;
};

/// The smallest box that holds all pixels that are not 0; width 0 if there are none.
PixelBox foreground_box(const BinaryImage& image);
PixelBox foreground_box(const ImageOf<std::uint32_t>& image);

/// In the order of `grid.sides_px`. Every foreground pixel has mass 1.
Result<std::vector<BoxCount>> count_boxes(const BinaryImage& image, const BoxGrid& grid, int threads,
                                          StopFlag stop = nullptr);

/// The same of a mass that is not uniform: a pixel's value is its mass. The whole mass must be below 2^53.
Result<std::vector<BoxCount>> count_boxes(const ImageOf<std::uint32_t>& mass, const BoxGrid& grid, int threads,
                                          StopFlag stop = nullptr);

}  // namespace colony
