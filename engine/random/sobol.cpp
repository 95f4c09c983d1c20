#include "engine/random/sobol.hpp"

#include "engine/base/check.hpp"

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
constexpr std::uint32_t kPointsMax = 65536;

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
  x ^= x * 0x6c50b47cU;
  x ^= x * 0xb82f1e52U;
  x ^= x * 0xc7afe638U;
  x ^= x * 0x8d22f6e6U;
  return x;
}

// The first three dimensions with their bits reversed, ready for scrambling.
const std::array<std::vector<std::uint32_t>, 3>& reversed_points() {
  static const std::array<std::vector<std::uint32_t>, 3> points = [] {
    std::array<std::vector<std::uint32_t>, 3> made;
    for (int d = 0; d < 3; ++d) {
      auto& column = made[static_cast<std::size_t>(d)];
      column.resize(kPointsMax);
      for (std::uint32_t i = 0; i < kPointsMax; ++i) column[i] = reverse_bits(sobol_u32(i, d));
    }
    return made;
  }();
  return points;
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
  CHECK(n >= 1 && n <= kPointsMax && (n & (n - 1)) == 0);
  const auto& reversed = reversed_points();
  const std::array<std::vector<float>*, 3> columns = {&out.x, &out.y, &out.z};
  for (std::size_t d = 0; d < 3; ++d) {
    columns[d]->resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t bits = reverse_bits(laine_karras(reversed[d][i], seeds[d]));
      (*columns[d])[i] = static_cast<float>(bits >> 8) * 0x1.0p-24F;  // 24 bits: exact, below 1
    }
  }
}

PointSet scrambled_sobol(std::uint32_t n, Stream& stream) {
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  PointSet points;
  scrambled_sobol(n, seeds, points);
  return points;
}

}  // namespace colony
