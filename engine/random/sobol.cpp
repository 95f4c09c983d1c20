#include "engine/random/sobol.hpp"

#include <algorithm>
#include <bit>
#include <mutex>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/random/sobol_kernel.hpp"

namespace colony {
namespace {

// One row of Joe and Kuo's table: the degree s and coefficients a of a primitive polynomial, and the initial m_1..m_s.
struct Direction {
  int s;
  std::uint32_t a;
  std::array<std::uint32_t, 7> m;
};

// Dimensions 2 to 21; dimension 1 is van der Corput's sequence.
constexpr std::array<Direction, kSobolDimensions - 1> kJoeKuo = {{
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
    {6, 19, {1, 1, 1, 15, 7, 5}},
    {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}},
    {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}},
}};

using Columns = std::array<std::array<std::uint32_t, 32>, kSobolDimensions>;

constexpr Columns make_columns() {
  Columns v{};
  for (std::size_t bit = 0; bit < 32; ++bit) v[0][bit] = std::uint32_t{1} << (31 - bit);
  for (std::size_t d = 1; d < v.size(); ++d) {
    const Direction& row = kJoeKuo[d - 1];
    const auto s = static_cast<std::size_t>(row.s);
    for (std::size_t bit = 0; bit < 32; ++bit) {
      if (bit < s) {
        v[d][bit] = row.m[bit] << (31 - bit);
        continue;
      }
      v[d][bit] = v[d][bit - s] ^ (v[d][bit - s] >> s);
      for (std::size_t k = 1; k < s; ++k) {
        if ((row.a >> (s - 1 - k)) & 1U) v[d][bit] ^= v[d][bit - k];
      }
    }
  }
  return v;
}

constexpr Columns kColumns = make_columns();

std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555U) | ((x & 0x55555555U) << 1);
  x = ((x >> 2) & 0x33333333U) | ((x & 0x33333333U) << 2);
  x = ((x >> 4) & 0x0f0f0f0fU) | ((x & 0x0f0f0f0fU) << 4);
  x = ((x >> 8) & 0x00ff00ffU) | ((x & 0x00ff00ffU) << 8);
  return (x >> 16) | (x << 16);
}

// Each output bit depends only on lower input bits: on reversed bits that is a nested scrambling.
std::uint32_t laine_karras(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  for (const std::uint32_t multiplier : kLaineKarras) x ^= x * multiplier;
  return x;
}

// The first three dimensions with their bits reversed, ready for scrambling.
using Reversed = std::array<std::vector<std::uint32_t>, 3>;

const Reversed& reversed_points() {
  static const Reversed points = [] {
    Reversed made;
    for (int d = 0; d < 3; ++d) {
      auto& column = made[static_cast<std::size_t>(d)];
      column.resize(kSobolPointsMax + kScramblePadding);
      // Point i is point i without its lowest bit, and that bit's direction.
      for (std::uint32_t i = 1; i < kSobolPointsMax; ++i) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(i));
        column[i] = column[i & (i - 1)] ^ reverse_bits(kColumns[static_cast<std::size_t>(d)][bit]);
      }
    }
    return made;
  }();
  return points;
}

// The first n points, tile by tile: a tile holds the 16 points (fewer if n is below 16) of one elementary interval of the first two
// coordinates. Scrambling moves elementary intervals as wholes, so the points of a tile stay together.
Reversed tiled_points(std::uint32_t n) {
  const int bits = std::countr_zero(n);
  const int tile_bits = std::max(bits - 4, 0);
  const int x_bits = (tile_bits + 1) / 2;
  const int y_bits = tile_bits / 2;
  const auto top = [](std::uint32_t value, int count) { return count == 0 ? 0U : value >> (32 - count); };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // tile, index
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t x = top(sobol_u32(i, 0), x_bits);
    const std::uint32_t y = top(sobol_u32(i, 1), y_bits);
    order.emplace_back((x << y_bits) | y, i);
  }
  std::sort(order.begin(), order.end());
  Reversed made;
  for (std::size_t d = 0; d < 3; ++d) {
    made[d].reserve(n + kScramblePadding);
    for (const auto& [tile, index] : order) made[d].push_back(reversed_points()[d][index]);
    made[d].resize(n + kScramblePadding);
  }
  return made;
}

const Reversed& tiled_points_of(std::uint32_t n) {
  static std::array<std::once_flag, 17> once;
  static std::array<Reversed, 17> sets;
  const auto k = static_cast<std::size_t>(std::countr_zero(n));
  std::call_once(once[k], [&] { sets[k] = tiled_points(n); });
  return sets[k];
}

void scramble(const Reversed& reversed, std::size_t dimension_count, std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out) {
  out.count = n;
  const std::array<std::vector<float>*, 3> columns = {&out.x, &out.y, &out.z};
  for (std::size_t d = 0; d < 3; ++d) {
    if (columns[d]->size() < n + kScramblePadding) columns[d]->resize(n + kScramblePadding);
    if (d < dimension_count) {
      scramble_column(reversed[d].data(), n, seeds[d], columns[d]->data());
    } else {
      std::fill_n(columns[d]->begin(), n, 0.0F);
    }
  }
}

}  // namespace

std::uint32_t sobol_u32(std::uint32_t index, int dimension) {
  CHECK(dimension >= 0 && dimension < kSobolDimensions);
  const auto& column = kColumns[static_cast<std::size_t>(dimension)];
  std::uint32_t value = 0;
  for (std::size_t bit = 0; index != 0; ++bit, index >>= 1) {
    if (index & 1U) value ^= column[bit];
  }
  return value;
}

std::uint32_t owen_scramble(std::uint32_t value, std::uint32_t seed) {
  return reverse_bits(laine_karras(reverse_bits(value), seed));
}

void scrambled_sobol(std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out) {
  CHECK(n >= 1 && n <= kSobolPointsMax && (n & (n - 1)) == 0);
  scramble(reversed_points(), 3, n, seeds, out);
}

void tiled_sobol(std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out) {
  CHECK(n >= 1 && n <= kSobolPointsMax && (n & (n - 1)) == 0);
  scramble(tiled_points_of(n), 3, n, seeds, out);
}

void tiled_sobol_plane(std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out) {
  CHECK(n >= 1 && n <= kSobolPointsMax && (n & (n - 1)) == 0);
  scramble(tiled_points_of(n), 2, n, seeds, out);
}

PointSet scrambled_sobol(std::uint32_t n, Stream& stream) {
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  PointSet points;
  scrambled_sobol(n, seeds, points);
  return points;
}

}  // namespace colony
