// image: the plain rasters that are analysed: grey, binary and label images, from a colony or from a microscope alike.
// Shapes:  row-major from the top row, height_px x width_px values, no padding. Row 0 is the top, y grows downwards.
// Units:   pixels; um_per_px where it is known. Grey: 0 black. Binary: 0 background, anything else foreground. Labels: 0 background,
//          else the number of a cell (a CellId in a simulated colony); a label need not be one connected piece.
// Errors:  check_image names what is wrong: a side outside 1..20,000, a scale that is no length, a size that does not fit.
// Threads: plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/result.hpp"

namespace colony {

/// The largest side that any analysis takes: 400 MB as a binary image, 1.6 GB as labels.
inline constexpr std::int64_t kImageSideMax_px = 20'000;

/// Pixels closer together or further apart than these are a wrong unit, not a microscope.
inline constexpr double kImageScaleMin_um_per_px = 1e-3;
inline constexpr double kImageScaleMax_um_per_px = 1e4;

template <class T>
struct ImageOf {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::optional<double> um_per_px = {};  // square pixels; none: not known, and then nothing is reported in um
  std::vector<T> values = {};

  ImageOf() = default;
  /// All pixels `value`. CHECKs that the sides are in range.
  ImageOf(std::int64_t width, std::int64_t height, std::optional<double> scale_um_per_px = {}, T value = T{})
      : width_px(width), height_px(height), um_per_px(scale_um_per_px) {
    CHECK(width >= 1 && width <= kImageSideMax_px && height >= 1 && height <= kImageSideMax_px);
    values.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value);
  }

  std::size_t index(std::int64_t row, std::int64_t column) const {
    return static_cast<std::size_t>(row * width_px + column);
  }
  T& at(std::int64_t row, std::int64_t column) { return values[index(row, column)]; }
  T at(std::int64_t row, std::int64_t column) const { return values[index(row, column)]; }
  const T* row(std::int64_t row_index) const { return values.data() + index(row_index, 0); }
  T* row(std::int64_t row_index) { return values.data() + index(row_index, 0); }
  bool contains(std::int64_t row_index, std::int64_t column) const {
    return row_index >= 0 && row_index < height_px && column >= 0 && column < width_px;
  }
  /// The value at a pixel, or `outside` beyond the frame.
  T at_or(std::int64_t row_index, std::int64_t column, T outside) const {
    return contains(row_index, column) ? at(row_index, column) : outside;
  }
  friend bool operator==(const ImageOf&, const ImageOf&) = default;
};

using GreyImage = ImageOf<std::uint8_t>;
using Grey16Image = ImageOf<std::uint16_t>;
/// 0 or not 0.
using BinaryImage = ImageOf<std::uint8_t>;
using LabelImage = ImageOf<std::uint32_t>;

/// kLimit or kInvalid (field: `name`) unless the sides are in 1..kImageSideMax_px, `values` has that many, and the scale, if any, is finite
/// and within kImageScaleMin..Max_um_per_px. Every analysis calls it first.
Status check_image_shape(std::int64_t width_px, std::int64_t height_px, std::size_t value_count,
                         std::optional<double> um_per_px, const std::string& name);
template <class T>
Status check_image(const ImageOf<T>& image, const std::string& name) {
  return check_image_shape(image.width_px, image.height_px, image.values.size(), image.um_per_px, name);
}

}  // namespace colony
