// fractals: images of sets and measures whose dimensions are known from mathematics, made by the tests themselves.
// Shapes:  the aligned ones fill a square whose side is a power of the fractal's own ratio, so that boxes of such a side with offset
//          (0, 0) hold either one copy of the set or nothing, and N(s) is an exact power law.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "engine/analysis/image.hpp"
#include "engine/base/maths.hpp"

namespace colony::testing {

inline std::int64_t power(std::int64_t base, int exponent) {
  std::int64_t result = 1;
  for (int i = 0; i < exponent; ++i) result *= base;
  return result;
}

/// base^0, ..., base^(count - 1), times `first`.
inline std::vector<std::int64_t> powers(std::int64_t base, int count, std::int64_t first = 1) {
  std::vector<std::int64_t> sides;
  for (int i = 0; i < count; ++i) sides.push_back(first * power(base, i));
  return sides;
}

/// A pixel is set if at every level the digits (row, column) in `base` satisfy `keep`.
inline BinaryImage digit_fractal(std::int64_t base, int levels,
                                 const std::function<bool(std::int64_t, std::int64_t)>& keep) {
  const std::int64_t side = power(base, levels);
  BinaryImage image(side, side);
  for (std::int64_t row = 0; row < side; ++row) {
    for (std::int64_t column = 0; column < side; ++column) {
      bool inside = true;
      for (std::int64_t r = row, c = column, level = 0; level < levels && inside; ++level, r /= base, c /= base) {
        inside = keep(r % base, c % base);
      }
      image.at(row, column) = inside ? 1 : 0;
    }
  }
  return image;
}

/// log 3 / log 2 = 1.58496. The right-angled gasket: an affine image of the equilateral one.
inline BinaryImage gasket(int levels) {
  return digit_fractal(2, levels, [](std::int64_t r, std::int64_t c) { return !(r == 0 && c == 1); });
}
/// log 8 / log 3 = 1.89279.
inline BinaryImage carpet(int levels) {
  return digit_fractal(3, levels, [](std::int64_t r, std::int64_t c) { return !(r == 1 && c == 1); });
}
/// log 5 / log 3 = 1.46497.
inline BinaryImage vicsek(int levels) {
  return digit_fractal(3, levels, [](std::int64_t r, std::int64_t c) { return r == 1 || c == 1; });
}

/// A measure: every pixel's mass is the product over the levels of the weight of its quadrant (row, column). Its D1 is
/// -sum p log2 p.
inline ImageOf<std::uint32_t> cascade(int levels, const std::array<std::uint32_t, 4>& weights) {
  const std::int64_t side = power(2, levels);
  ImageOf<std::uint32_t> mass(side, side);
  for (std::int64_t row = 0; row < side; ++row) {
    for (std::int64_t column = 0; column < side; ++column) {
      std::uint32_t value = 1;
      for (int level = 0; level < levels; ++level) {
        value *= weights[static_cast<std::size_t>(2 * (row >> level & 1) + (column >> level & 1))];
      }
      mass.at(row, column) = value;
    }
  }
  return mass;
}

/// log 4 / log 3 = 1.26186. Koch curves in the affine image that maps the triangular lattice onto pixels (unit vectors at 0 and 60
/// degrees become columns and rows): a pixel is set if one of the smallest pieces lies in it, and so is a box of 3^j pixels if a piece
/// of that size does. Two pieces that face each other share a box; so a snowflake alone (3 curves, bumps outwards) has
/// (7 4^k + 2) / 3 boxes, a hexagon (6 curves, bumps inwards) (14 4^k - 2) / 3, and the two in one image exactly 7 x 4^k,
/// k = levels - j.
inline BinaryImage koch_on_lattice(int levels) {
  using Point = std::pair<std::int64_t, std::int64_t>;
  const std::int64_t unit = power(3, levels);
  BinaryImage image(6 * unit, 3 * unit);
  // Turns by -60 and +60 degrees on the lattice: the side to which the bumps go.
  const auto turned = [](Point v, bool right) {
    return right ? Point{v.first + v.second, -v.first} : Point{-v.second, v.first + v.second};
  };
  const std::function<void(Point, Point, bool, int)> draw = [&](Point p, Point d, bool right, int level) {
    if (level == 0) {
      // The piece lies in the triangle (p, p + d, p + turned(d)), of which the centroid says the pixel.
      const Point t = turned(d, right);
      image.at((3 * p.second + d.second + t.second) / 3, (3 * p.first + d.first + t.first) / 3) = 1;
      return;
    }
    const Point third{d.first / 3, d.second / 3};
    const Point out = turned(third, right), back{third.first - out.first, third.second - out.second};
    const Point a{p.first + third.first, p.second + third.second};
    const Point top{a.first + out.first, a.second + out.second};
    draw(p, third, right, level - 1);
    draw(a, out, right, level - 1);
    draw(top, back, right, level - 1);
    draw({top.first + back.first, top.second + back.second}, third, right, level - 1);
  };
  const auto polygon = [&](Point origin, const std::vector<Point>& corners, bool right) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Point from = corners[i], to = corners[(i + 1) % corners.size()];
      draw({(origin.first + from.first) * unit, (origin.second + from.second) * unit},
           {(to.first - from.first) * unit, (to.second - from.second) * unit}, right, levels);
    }
  };
  polygon({1, 1}, {{0, 0}, {1, 0}, {0, 1}}, true);
  polygon({4, 1}, {{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}, false);
  return image;
}

/// Sets the pixels of the straight line from (x0, y0) to (x1, y1), one a row or column, whichever is more.
inline void draw_segment(BinaryImage& image, double x0, double y0, double x1, double y1) {
  const double longer = std::max(std::abs(x1 - x0), std::abs(y1 - y0));
  const auto steps = static_cast<std::int64_t>(std::ceil(longer)) + 1;
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    const auto column = static_cast<std::int64_t>(std::floor(x0 + share * (x1 - x0)));
    const auto row = static_cast<std::int64_t>(std::floor(y0 + share * (y1 - y0)));
    if (image.contains(row, column)) image.at(row, column) = 1;
  }
}

/// Koch's curve as everybody draws it, `width` pixels wide with a margin, refined below a pixel.
inline BinaryImage koch_curve(std::int64_t width) {
  BinaryImage image(width, width / 3 + 20);
  const std::function<void(double, double, double, double)> draw = [&](double x, double y, double dx, double dy) {
    if (dx * dx + dy * dy <= 1.0) {
      draw_segment(image, x, y, x + dx, y + dy);
      return;
    }
    const double tx = dx / 3.0, ty = dy / 3.0, h = std::sqrt(3.0) / 2.0;
    const double ux = tx / 2.0 + h * ty, uy = ty / 2.0 - h * tx;  // upwards, where rows grow downwards
    draw(x, y, tx, ty);
    draw(x + tx, y + ty, ux, uy);
    draw(x + tx + ux, y + ty + uy, tx - ux, ty - uy);
    draw(x + 2.0 * tx, y + 2.0 * ty, tx, ty);
  };
  draw(5.3, static_cast<double>(width) / 3.0 + 8.6, static_cast<double>(width) - 10.7, 0.0);
  return image;
}

inline void draw_circle(BinaryImage& image, double x, double y, double radius) {
  const int pieces = static_cast<int>(8.0 * radius);
  for (int i = 0; i < pieces; ++i) {
    const double angle = 2.0 * maths::kPi * i / pieces;
    const auto column = static_cast<std::int64_t>(std::floor(x + radius * std::cos(angle)));
    const auto row = static_cast<std::int64_t>(std::floor(y + radius * std::sin(angle)));
    if (image.contains(row, column)) image.at(row, column) = 1;
  }
}

/// The control that passes for a fractal: `across` x `across` smooth circles, packed hexagonally so that they touch.
inline BinaryImage hexagonal_circles(int across, double radius) {
  const double height = std::sqrt(3.0) * radius;
  BinaryImage image(static_cast<std::int64_t>(2.0 * radius * (across + 0.5)) + 12,
                    static_cast<std::int64_t>(height * (across - 1) + 2.0 * radius) + 12);
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < across; ++j) {
      draw_circle(image, 6.0 + radius * (1.0 + 2.0 * j + i % 2), 6.0 + radius + height * i, radius);
    }
  }
  return image;
}

}  // namespace colony::testing
