// Philox, addressed streams, Sobol points and their scrambling.
#include <algorithm>
#include <bit>
#include <map>
#include <set>
#include <span>
#include <vector>

#include <boost/random/sobol.hpp>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "engine/base/check.hpp"
#include "engine/random/philox_kernel.hpp"
#include "engine/random/sobol.hpp"
#include "engine/random/sobol_kernel.hpp"
#include "engine/random/stream.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"
#include "tests/support/targets.hpp"

namespace colony {
namespace {

using Words4 = std::array<std::uint32_t, 4>;

TEST(Philox, GivesRandom123sKnownAnswers) {
  const std::uint32_t f = 0xffffffffU;
  EXPECT_EQ(philox4x32_10({0, 0, 0, 0}, {0, 0}), (Words4{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32_10({f, f, f, f}, {f, f}), (Words4{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words4{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Stream, CounterWordsAreCellOrdinalPurposeWithLaneAndBlock) {
  const Seed seed = 0x0012345689abcdefULL;
  testing::on_every_target([&](const std::string& name) {
    Stream stream(seed, CellId{77}, 5, Purpose::kSearch, 0xabcdef);
    for (std::uint32_t block = 0; block < 2 + 3 * kPhiloxBlocks; ++block) {  // blocks are made one, then many at a time
      const Words4 words = philox4x32_10({77, 5, (7U << 24) | 0xabcdefU, block}, {0x89abcdef, 0x00123456});
      for (const std::uint32_t word : words) ASSERT_EQ(stream.next_u32(), word) << name << " block " << block;
    }
  });
}

TEST(Stream, NoTwoAddressesShareABlock) {
  std::set<Words4> seen;
  std::size_t drawn = 0;
  for (std::uint32_t cell = 1; cell <= 12; ++cell) {
    for (std::uint32_t ordinal = 0; ordinal < 6; ++ordinal) {
      for (int purpose = 1; purpose <= 13; ++purpose) {
        for (std::uint32_t lane = 0; lane < 4; ++lane) {
          Stream stream(1, CellId{cell}, ordinal, static_cast<Purpose>(purpose), lane);
          for (int block = 0; block < 3; ++block, ++drawn) {
            seen.insert({stream.next_u32(), stream.next_u32(), stream.next_u32(), stream.next_u32()});
          }
        }
      }
    }
  }
  EXPECT_EQ(seen.size(), drawn);
}

TEST(Stream, SeedZeroAndTheLargestSeedAreSeedsLikeAnyOther) {
  EXPECT_NE(Stream(0, CellId{1}, 0, Purpose::kCycle).next_u64(), Stream(1, CellId{1}, 0, Purpose::kCycle).next_u64());
  EXPECT_NO_THROW(Stream(kSeedMax, CellId{1}, 0, Purpose::kCycle));
  EXPECT_THROW(Stream(kSeedMax + 1, CellId{1}, 0, Purpose::kCycle), CheckFailure);
  EXPECT_THROW(Stream(1, CellId{1}, 0, Purpose::kCycle, 1U << 24), CheckFailure);
}

TEST(Stream, UniformHasMeanAndVarianceOfTheUnitInterval) {
  const int n = testing::scaled(200'000, 2'000'000);
  Stream stream(11, CellId{1}, 0, Purpose::kCycle);
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < n; ++i) {
    const double u = stream.uniform();
    ASSERT_TRUE(u >= 0.0 && u < 1.0);
    sum += u;
    squares += (u - 0.5) * (u - 0.5);
  }
  EXPECT_NEAR(sum / n, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / n));
  EXPECT_NEAR(squares / n, 1.0 / 12.0, 5.0 * std::sqrt(1.0 / 180.0 / n));
  EXPECT_EQ(stream.uniform({3.0, 3.0}), 3.0);
}

TEST(Stream, BelowIsUnbiasedAlsoWhereTheRangeDoesNotDivideTheWord) {
  const int n = testing::scaled(60'000, 1'000'000);
  for (const std::uint32_t range : {2U, 3U, 7U, 10U}) {
    Stream stream(12, CellId{range}, 0, Purpose::kCycle);
    std::vector<double> counts(range, 0.0);
    for (int i = 0; i < n; ++i) counts[stream.below(range)] += 1.0;
    EXPECT_LT(testing::chi_square_uniform(counts), testing::chi_square_bound(range - 1)) << range;
  }
  // With 3 * 2^30 results four words fall on three results: without rejection one residue would come twice as often.
  Stream stream(12, CellId{99}, 0, Purpose::kCycle);
  std::vector<double> residues(3, 0.0);
  for (int i = 0; i < n; ++i) residues[stream.below(3U << 30) % 3] += 1.0;
  EXPECT_LT(testing::chi_square_uniform(residues), testing::chi_square_bound(2));
  EXPECT_EQ(stream.below(1), 0U);
  EXPECT_THROW(stream.below(0), CheckFailure);
}

TEST(Stream, NormalHasTheFirstFourMoments) {
  const int n = testing::scaled(200'000, 2'000'000);
  Stream stream(13, CellId{1}, 0, Purpose::kCycle);
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  for (int i = 0; i < n; ++i) {
    const double z = stream.normal();
    m1 += z / n;
    m2 += z * z / n;
    m3 += z * z * z / n;
    m4 += z * z * z * z / n;
  }
  // Variances of z, z^2, z^3, z^4: 1, 2, 15, 96.
  EXPECT_NEAR(m1, 0.0, 5.0 * std::sqrt(1.0 / n));
  EXPECT_NEAR(m2, 1.0, 5.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(m3, 0.0, 5.0 * std::sqrt(15.0 / n));
  EXPECT_NEAR(m4, 3.0, 5.0 * std::sqrt(96.0 / n));
}

double fraction(std::uint32_t bits) { return bits * 0x1.0p-32; }

TEST(Sobol, StartsWithTheOriginAndJoeKuosFirstPoints) {
  // The first eight of new-joe-kuo-6.21201 in three dimensions, in their Gray-code order.
  const std::vector<std::array<double, 3>> published = {{0, 0, 0},
                                                        {0.5, 0.5, 0.5},
                                                        {0.75, 0.25, 0.25},
                                                        {0.25, 0.75, 0.75},
                                                        {0.375, 0.375, 0.625},
                                                        {0.875, 0.875, 0.125},
                                                        {0.625, 0.125, 0.875},
                                                        {0.125, 0.625, 0.375}};
  for (std::uint32_t k = 0; k < published.size(); ++k) {
    for (int d = 0; d < 3; ++d)
      EXPECT_EQ(fraction(sobol_u32(k ^ (k >> 1), d)), published[k][static_cast<std::size_t>(d)]) << k << " " << d;
  }
}

TEST(Sobol, EqualsBoostsJoeKuoTableInAllDimensions) {
  boost::random::sobol engine(kSobolDimensions);
  for (std::uint32_t k = 1; k <= 4096; ++k) {  // Boost leaves the origin out and goes in Gray-code order
    for (int d = 0; d < kSobolDimensions; ++d) {
      ASSERT_EQ(sobol_u32(k ^ (k >> 1), d), static_cast<std::uint32_t>(engine() >> 32))
          << "point " << k << " dimension " << d;
    }
  }
}

TEST(Sobol, DimensionsOutsideTheTableFailACheck) {
  EXPECT_THROW(sobol_u32(1, -1), CheckFailure);
  EXPECT_THROW(sobol_u32(1, kSobolDimensions), CheckFailure);
  PointSet out;
  for (const std::uint32_t n : {0U, 3U, 65'535U, 131'072U})
    EXPECT_THROW(scrambled_sobol(n, {1, 2, 3}, out), CheckFailure) << n;
}

RC_GTEST_PROP(OwenScrambling, KeepsElementaryIntervals, (std::uint32_t x, std::uint32_t y, std::uint32_t seed)) {
  // Two fractions in one elementary interval stay together and part at the same bit: nested, and a bijection.
  const std::uint32_t a = owen_scramble(x, seed);
  const std::uint32_t b = owen_scramble(y, seed);
  RC_ASSERT(std::countl_zero(x ^ y) == std::countl_zero(a ^ b));
}

TEST(OwenScrambling, DiffersBySeedAndFillsTheInterval) {
  std::vector<double> counts(16, 0.0);
  for (std::uint32_t seed = 0; seed < 16'000; ++seed) counts[owen_scramble(0, seed * 2654435761U) >> 28] += 1.0;
  EXPECT_LT(testing::chi_square_uniform(counts), testing::chi_square_bound(15));
}

// The first n: point sets are padded.
std::vector<std::uint32_t> column(const std::vector<float>& values, std::size_t n) {
  std::vector<std::uint32_t> bits;
  for (const float v : std::span(values).first(n)) bits.push_back(static_cast<std::uint32_t>(v * 16777216.0F) << 8);
  return bits;
}

// How often each number of points falls into an elementary rectangle 2^-a x 2^-(m-a).
std::map<int, int> occupancy(const std::vector<std::uint32_t>& x, const std::vector<std::uint32_t>& y, int m, int a) {
  std::vector<int> cells(std::size_t{1} << m, 0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::uint64_t column_index = static_cast<std::uint64_t>(x[i]) >> (32 - a);
    const std::uint64_t row = static_cast<std::uint64_t>(y[i]) >> (32 - (m - a));
    ++cells[(column_index << (m - a)) | row];
  }
  std::map<int, int> histogram;
  for (const int count : cells) ++histogram[count];
  return histogram;
}

TEST(ScrambledSobol, EverySetIsANetInEachCoordinateAndStratifiedInPairsLikeTheUnscrambledOne) {
  for (int m = 6; m <= 12; m += 2) {
    const std::uint32_t n = 1U << m;
    std::array<std::vector<std::uint32_t>, 3> plain;
    for (int d = 0; d < 3; ++d) {
      for (std::uint32_t i = 0; i < n; ++i) plain[static_cast<std::size_t>(d)].push_back(sobol_u32(i, d));
    }
    for (std::uint32_t set = 0; set < 8; ++set) {
      PointSet points;
      Stream stream(14, CellId{set + 1}, 0, Purpose::kSearchPoints);
      scrambled_sobol(n, {stream.next_u32(), stream.next_u32(), stream.next_u32()}, points);
      const std::array<std::vector<std::uint32_t>, 3> scrambled = {column(points.x, n), column(points.y, n),
                                                                   column(points.z, n)};
      for (std::size_t d = 0; d < 3; ++d) {
        std::set<std::uint32_t> intervals;
        for (const std::uint32_t bits : scrambled[d]) intervals.insert(bits >> (32 - m));
        EXPECT_EQ(intervals.size(), n) << "dimension " << d << " set " << set;
      }
      for (const auto& [d, e] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}}) {
        for (int a = 0; a <= m; ++a) {
          EXPECT_EQ(occupancy(scrambled[d], scrambled[e], m, a), occupancy(plain[d], plain[e], m, a))
              << d << e << " split " << a;
          if (e == 1) {  // the first two dimensions are a (0, m, 2)-net: one point in every rectangle
            EXPECT_EQ(occupancy(plain[0], plain[1], m, a), (std::map<int, int>{{1, static_cast<int>(n)}}));
          }
        }
      }
    }
  }
}

TEST(ScrambledSobol, IsOwenScramblingOfTheSequenceCutTo24Bits) {
  PointSet points;
  scrambled_sobol(1024, {5, 6, 7}, points);
  for (std::uint32_t i = 0; i < 1024; ++i) {
    EXPECT_EQ(points.x[i], static_cast<float>(owen_scramble(sobol_u32(i, 0), 5) >> 8) * 0x1.0p-24F);
    EXPECT_EQ(points.y[i], static_cast<float>(owen_scramble(sobol_u32(i, 1), 6) >> 8) * 0x1.0p-24F);
    EXPECT_EQ(points.z[i], static_cast<float>(owen_scramble(sobol_u32(i, 2), 7) >> 8) * 0x1.0p-24F);
  }
}

TEST(TiledSobol, IsTheSameSetInRunsOfOneElementaryInterval) {
  using Point = std::array<float, 3>;
  for (int m = 0; m <= 12; ++m) {
    const std::uint32_t n = 1U << m;
    for (std::uint32_t set = 1; set <= 4; ++set) {
      PointSet plain, tiled;
      scrambled_sobol(n, {set, set + 7, 99 * set}, plain);
      tiled_sobol(n, {set, set + 7, 99 * set}, tiled);
      PointSet plane = plain;  // what it held before must not matter
      tiled_sobol_plane(n, {set, set + 7, 99 * set}, plane);
      for (std::size_t i = 0; i < n; ++i) ASSERT_TRUE(plane.x[i] == tiled.x[i] && plane.y[i] == tiled.y[i] && plane.z[i] == 0.0F) << n << " point " << i;
      std::vector<Point> a, b;
      for (std::size_t i = 0; i < n; ++i) a.push_back({plain.x[i], plain.y[i], plain.z[i]});
      for (std::size_t i = 0; i < n; ++i) b.push_back({tiled.x[i], tiled.y[i], tiled.z[i]});
      // 2^(m-4) tiles of 16 points: half of their bits, rounded up, along x, the others along y.
      const int tile_bits = std::max(m - 4, 0);
      const float columns = static_cast<float>(1U << ((tile_bits + 1) / 2)), rows = static_cast<float>(1U << (tile_bits / 2));
      std::set<std::pair<int, int>> tiles;
      for (std::size_t first = 0; first < n; first += 16) {
        const auto tile_of = [&](const Point& p) { return std::pair{static_cast<int>(p[0] * columns), static_cast<int>(p[1] * rows)}; };
        tiles.insert(tile_of(b[first]));
        for (std::size_t i = first; i < std::min<std::size_t>(n, first + 16); ++i) ASSERT_EQ(tile_of(b[i]), tile_of(b[first])) << n << " point " << i;
      }
      EXPECT_EQ(tiles.size(), std::size_t{1} << tile_bits);
      std::sort(a.begin(), a.end());
      std::sort(b.begin(), b.end());
      ASSERT_EQ(a, b) << n;
    }
  }
  PointSet out;
  EXPECT_THROW(tiled_sobol(48, {1, 2, 3}, out), CheckFailure);
}

std::uint32_t reversed(std::uint32_t x) {
  std::uint32_t y = 0;
  for (int bit = 0; bit < 32; ++bit) y |= ((x >> bit) & 1U) << (31 - bit);
  return y;
}

TEST(ScrambleColumn, IsOwenScramblingOnEveryTarget) {
  Stream stream(15, CellId{1}, 0, Purpose::kSearchPoints);
  for (const std::size_t n : {1U, 5U, 16U, 100U, 1000U}) {
    std::vector<std::uint32_t> words(n + kScramblePadding, 0);
    for (std::size_t i = 0; i < n; ++i) words[i] = stream.next_u32();
    const std::uint32_t seed = stream.next_u32();
    testing::on_every_target([&](const std::string& name) {
      std::vector<float> found(n + kScramblePadding);
      scramble_column(words.data(), n, seed, found.data());
      for (std::size_t i = 0; i < n; ++i) {
        const float expected = static_cast<float>(owen_scramble(reversed(words[i]), seed) >> 8) * 0x1.0p-24F;
        ASSERT_EQ(found[i], expected) << name << " word " << i;
      }
    }, n == 1000);
  }
}

}  // namespace
}  // namespace colony
