// pixels: rounding to pixel indices without libm, and the one way to write into a picture.
// Errors:  none; the caller proves that the value fits an index (it is bounded by a picture's side).
// Threads: pure.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/picture/render.hpp"

namespace colony {

/// std::floor and std::ceil are calls into libm on plain x86-64; these are not.
inline std::int64_t floor_to_int(double value) {
  const auto truncated = static_cast<std::int64_t>(value);
  return static_cast<double>(truncated) > value ? truncated - 1 : truncated;
}
inline std::int64_t ceil_to_int(double value) {
  const auto truncated = static_cast<std::int64_t>(value);
  return static_cast<double>(truncated) < value ? truncated + 1 : truncated;
}

struct Rgb {
  std::uint8_t red = 0, green = 0, blue = 0;
  friend bool operator==(const Rgb&, const Rgb&) = default;
};

/// `from` at share 0, `to` at share 1, straight in the stored (sRGB) values.
inline Rgb blend(Rgb from, Rgb to, double share) {
  const auto mix = [share](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(static_cast<double>(a) +
                                     (static_cast<double>(b) - static_cast<double>(a)) * share + 0.5);
  };
  return {mix(from.red, to.red), mix(from.green, to.green), mix(from.blue, to.blue)};
}

/// `colour` at `brightness` >= 0; what would exceed white stays at 255.
inline Rgb lit(Rgb colour, double brightness) {
  const auto scale = [brightness](std::uint8_t value) {
    return static_cast<std::uint8_t>(std::min(static_cast<double>(value) * brightness + 0.5, 255.0));
  };
  return {scale(colour.red), scale(colour.green), scale(colour.blue)};
}

/// Pixels outside the picture, or outside the strip of it that is held, are not drawn.
inline void put_pixel(Picture& picture, std::int64_t row, std::int64_t column, Rgb colour) {
  if (row < picture.first_row || column < 0 || column >= picture.width_px) return;
  const std::size_t at = static_cast<std::size_t>(3 * ((row - picture.first_row) * picture.width_px + column));
  if (at >= picture.rgb.size()) return;
  picture.rgb[at] = colour.red;
  picture.rgb[at + 1] = colour.green;
  picture.rgb[at + 2] = colour.blue;
}

/// The rectangle of rows [row, row + height) and columns [column, column + width).
inline void fill_rectangle(Picture& picture, std::int64_t row, std::int64_t column, std::int64_t height,
                           std::int64_t width, Rgb colour) {
  for (std::int64_t r = row; r < row + height; ++r) {
    for (std::int64_t c = column; c < column + width; ++c) put_pixel(picture, r, c, colour);
  }
}

}  // namespace colony
