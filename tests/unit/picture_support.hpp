// picture_support: pictures for the handlers of analyses and comparisons, and how they are sent.
#pragma once

#include <string>
#include <vector>

#include "tests/support/image_files.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {

/// Light discs on a dark ground, in a square of tiles: `side` of them a row, each `radius` large, 4 radii apart.
inline std::string discs_png(int side, int radius) {
  const int size = 4 * radius * side;
  std::vector<std::uint8_t> rows(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), 20);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const int dx = x % (4 * radius) - 2 * radius, dy = y % (4 * radius) - 2 * radius;
      if (dx * dx + dy * dy <= radius * radius) rows[static_cast<std::size_t>(y * size + x)] = 200;
    }
  }
  return colony::testing::png_file(size, size, {}, rows);
}

inline std::string plain_png(int width, int height, std::uint8_t level) {
  return colony::testing::png_file(width, height, {},
                                   std::vector<std::uint8_t>(static_cast<std::size_t>(width * height), level));
}

inline http::Response send_picture(ApiFixture& fixture, const std::string& bytes, const std::string& query = "",
                            const std::string& type = "image/png") {
  return fixture.ask("POST", "/v1/analyses" + query, {{"Content-Type", type}}, bytes);
}

}  // namespace colony::server::testing
