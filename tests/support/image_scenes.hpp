// image_scenes: grey pictures whose answer is known because they were drawn. For tests of analysis/.
// Random:  engine streams, fixed seed: the same picture everywhere.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "engine/analysis/image.hpp"
#include "engine/random/stream.hpp"

namespace colony::testing {

struct Disc {
  double x = 0.0, y = 0.0, radius = 0.0;
  bool holds(std::int64_t row, std::int64_t column) const {
    const double dx = static_cast<double>(column) - x, dy = static_cast<double>(row) - y;
    return dx * dx + dy * dy <= radius * radius;
  }
};

inline void draw(GreyImage& image, const Disc& disc, std::uint8_t value) {
  for (std::int64_t row = 0; row < image.height_px; ++row) {
    for (std::int64_t column = 0; column < image.width_px; ++column) {
      if (disc.holds(row, column)) image.at(row, column) = value;
    }
  }
}

/// Adds -amplitude..amplitude, evenly, held to 0..255.
inline void add_noise(GreyImage& image, int amplitude, std::uint64_t seed) {
  Stream stream(seed, CellId{1}, 0, Purpose::kFounder);
  for (std::uint8_t& value : image.values) {
    const int step = static_cast<int>(stream.uniform() * (2 * amplitude + 1)) - amplitude;
    value = static_cast<std::uint8_t>(std::clamp(value + step, 0, 255));
  }
}

/// Bytes of a file of the real data, or nothing where this machine has none.
inline std::optional<std::string> real_file(const std::string& name) {
  const char* folder = std::getenv("COLONY_DATA");
  if (folder == nullptr) return std::nullopt;
  std::ifstream stream(std::string(folder) + "/" + name, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

}  // namespace colony::testing
