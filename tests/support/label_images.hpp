// label_images: small label images drawn as text or by a rule, for the tests of analysis.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/analysis/image.hpp"

namespace colony::testing {

/// '.' is background, a letter or digit its own code: 'a' is label 97.
inline LabelImage drawn(const std::vector<std::string>& rows) {
  LabelImage image(static_cast<std::int64_t>(rows.front().size()), static_cast<std::int64_t>(rows.size()));
  for (std::int64_t row = 0; row < image.height_px; ++row) {
    for (std::int64_t column = 0; column < image.width_px; ++column) {
      const char c = rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
      image.at(row, column) = c == '.' ? 0 : static_cast<std::uint32_t>(c);
    }
  }
  return image;
}

/// The label of every pixel from its centre.
inline LabelImage painted(std::int64_t width, std::int64_t height,
                          const std::function<std::uint32_t(double x, double y)>& label) {
  LabelImage image(width, height);
  for (std::int64_t row = 0; row < height; ++row) {
    for (std::int64_t column = 0; column < width; ++column) {
      image.at(row, column) = label(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
    }
  }
  return image;
}

/// A binary image as text, '#' set.
inline std::vector<std::string> text_of(const BinaryImage& image) {
  std::vector<std::string> rows;
  for (std::int64_t row = 0; row < image.height_px; ++row) {
    std::string text;
    for (std::int64_t column = 0; column < image.width_px; ++column) text += image.at(row, column) != 0 ? '#' : '.';
    rows.push_back(text);
  }
  return rows;
}

}  // namespace colony::testing
