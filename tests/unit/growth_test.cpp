// The splitting plane, the chromosome and its bounds.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "engine/growth/chromosome.hpp"
#include "engine/growth/splitting.hpp"
#include "tests/support/any_params.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

TEST(SplittingPlane, AngleErrorAgainstTheShortAxisFallsWithElongation) {
  // A smooth, untilted, spread cell: the membrane nearest to its nucleus lies at the ends of the short axis, which
  // 4,096 points find to within this error. The model's 21 deg at 1.1 and 14 deg at 1.3 are what nine cells of ten stay
  // below.
  struct Row {
    double elongation, mean_deg, ninth_decile_deg;
  };
  const std::uint32_t repeats = testing::scaled(400U, 4000U);
  for (const Row& row : {Row{1.1, 9.9, 20.5}, Row{1.3, 7.0, 14.2}, Row{1.5, 6.3, 12.9}, Row{1.7, 5.8, 11.6}}) {
    std::vector<double> errors;
    for (std::uint32_t k = 1; k <= repeats; ++k) {
      Stream stream = testing::case_stream(k);
      BodyGeometry g;
      g.semiaxes_um = semiaxes_um(stream.uniform({400, 1800}), row.elongation, stream.uniform({0.3, 0.6}));
      const double turn = stream.uniform({0.0, maths::kPi});
      g.rotation_rad = Vec3(0.0, 0.0, turn);
      g.centre_um = Vec3(3.0, -2.0, spread_height_um(g.semiaxes_um));
      const Body body(g, testing::smooth());
      const Vec3 c = centroid_above_dish_um(g);
      const auto m = nearest_membrane_um(body, {}, ContactRule::kSum, c, testing::points(kSettlePoints, k));
      ASSERT_TRUE(m);
      ASSERT_FALSE(body.contains(*m));
      ASSERT_GE(m->z(), 0.0);
      ASSERT_LE(std::abs(m->z() - c.z()), 0.3 * g.semiaxes_um.z() + 1e-9);
      const Vec3 short_axis(-std::sin(turn), std::cos(turn), 0.0);
      const Vec3 normal = *splitting_normal(c, *m);
      errors.push_back(std::asin(std::min(1.0, std::abs(normal.dot(short_axis)))) * 180.0 / maths::kPi);
    }
    const testing::Mean mean = testing::mean_of(errors);
    std::sort(errors.begin(), errors.end());
    const double ninth_decile = errors[errors.size() * 9 / 10];
    std::printf("A/B %.1f: mean angle error %.2f +- %.2f deg, 90 %% below %.1f deg\n", row.elongation, mean.value,
                mean.se, ninth_decile);
    EXPECT_NEAR(mean.value, row.mean_deg, 1.0) << row.elongation;
    EXPECT_NEAR(ninth_decile, row.ninth_decile_deg, 2.0) << row.elongation;
  }
}

TEST(SplittingPlane, NormalIsHorizontalUnitAndAcrossTheLineToTheMembrane) {
  for (std::uint32_t number = 1; number <= 1000; ++number) {
    Stream stream = testing::case_stream(number);
    const Vec3 c(stream.uniform({-50, 50}), stream.uniform({-50, 50}), 3.0);
    const Vec3 m = c + stream.uniform({0.01, 10.0}) * testing::unit_vector(stream);
    const auto n = splitting_normal(c, m);
    ASSERT_TRUE(n);
    EXPECT_EQ(n->z(), 0.0);
    EXPECT_NEAR(n->norm(), 1.0, 1e-14);
    EXPECT_NEAR(n->dot(m - c), 0.0, 1e-12 * (m - c).norm() + 1e-13);
  }
  EXPECT_FALSE(splitting_normal(Vec3(1, 2, 3), Vec3(1, 2, 5)));
}

TEST(SplittingPlane, NearestMembraneIsTheNearestOfThePointsOutside) {
  for (std::uint32_t number = 1; number <= 20; ++number) {
    Stream stream = testing::case_stream(number);
    const BodyGeometry g = testing::spread_cell(stream, 0, 0, 0);
    const Body body(g, testing::rough()), other(testing::spread_cell(stream, 9.0, 0, 0), testing::rough());
    const std::array<const Body*, 1> near = {&other};
    const Vec3 c = centroid_above_dish_um(g);
    const PointSet points = testing::points(1024, number);
    const auto found = nearest_membrane_um(body, near, ContactRule::kSum, c, points);
    const double low = std::max(0.0, c.z() - 0.3 * g.semiaxes_um.z()), high = c.z() + 0.3 * g.semiaxes_um.z();
    double least = 1e9;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Box& box = body.box();
      const Vec3 p(box.low.x() + points.x[i] * (box.high.x() - box.low.x()),
                   box.low.y() + points.y[i] * (box.high.y() - box.low.y()), low + points.z[i] * (high - low));
      if (deformed_field(body, near, ContactRule::kSum, p) < 0.0) least = std::min(least, (p - c).norm());
    }
    EXPECT_NEAR((*found - c).norm(), least, 1e-9) << "case " << number;
  }
}

RC_GTEST_PROP(GrayCode, RoundTripsAndNeighboursDifferInOneBit, (std::uint16_t raw)) {
  const std::uint32_t n = raw;
  RC_ASSERT(binary_from_gray(gray_from_binary(n)) == n);
  RC_ASSERT(gray_from_binary(binary_from_gray(n)) == n);
  RC_ASSERT(std::popcount(gray_from_binary(n) ^ gray_from_binary(n + 1)) == 1);
}

TEST(Chromosome, GenesCoverTheirIntervalAndCodesRoundTrip) {
  for (const Coding coding : {Coding::kGray, Coding::kBinary}) {
    for (int bits = 4; bits <= 16; ++bits) {
      Chromosome chromosome(kGeneCountMulti, bits);
      for (int gene = 0; gene < kGeneCountMulti; ++gene) {
        for (const double value : {0.0, 0.25, 0.5, 1.0}) {
          chromosome.set_code(gene, code_of(value, bits, coding));
          EXPECT_NEAR(chromosome.value(gene, coding), value, 0.5001 / ((1 << bits) - 1));
        }
      }
      EXPECT_EQ(chromosome.length(), 19 * bits);
      EXPECT_EQ(Chromosome(kGeneCountMono, bits).length(), 17 * bits);
    }
  }
}

TEST(Chromosome, FlipChangesOneBitCountedFromTheMostSignificantOfTheFirstGene) {
  for (const int bits : {4, 8, 16}) {
    for (int bit = 0; bit < kGeneCountMulti * bits; ++bit) {
      Chromosome chromosome(kGeneCountMulti, bits);
      chromosome.flip(bit);
      for (int gene = 0; gene < kGeneCountMulti; ++gene) {
        EXPECT_EQ(chromosome.code(gene), gene == bit / bits ? 1U << (bits - 1 - bit % bits) : 0U);
      }
      chromosome.flip(bit);
      EXPECT_EQ(chromosome, Chromosome(kGeneCountMulti, bits));
    }
  }
}

TEST(Chromosome, CrossoverTakesTheHeadOfOneAndTheTailOfTheOther) {
  Stream stream = testing::case_stream(1);
  for (const int bits : {4, 7, 8, 16}) {
    const Chromosome a = random_chromosome(kGeneCountMulti, bits, stream), b = random_chromosome(kGeneCountMulti, bits, stream);
    const auto bit_of = [&](const Chromosome& c, int bit) {
      return (c.code(bit / bits) >> (bits - 1 - bit % bits)) & 1U;
    };
    for (int cut = 0; cut <= a.length(); ++cut) {
      const Chromosome child = crossover(a, b, cut);
      for (int bit = 0; bit < a.length(); ++bit)
        ASSERT_EQ(bit_of(child, bit), bit_of(bit < cut ? a : b, bit)) << "cut " << cut;
    }
  }
}

bool within(const Interval& range, double value) {
  const double slack = 1e-9 * std::max(1.0, std::abs(range.high));
  return value >= range.low - slack && value <= range.high + slack;
}

RC_GTEST_PROP(Decode, EveryStringIsAPairInsideAllRangesAndInsideTheSearchReach, (std::uint32_t number)) {
  Stream stream = testing::case_stream(number);
  const Params p = testing::any_params(stream);
  for (const FieldError& error : validate(p)) RC_ASSERT(error.pointer == "/cell/nucleus_radius_um");  // of no meaning here
  const double reach = search_reach_um(p), extent = body_half_extent_max_um(p);
  for (int i = 0; i < 20; ++i) {
    const Chromosome chromosome = testing::any_chromosome(p, stream);
    PairFrame frame;
    frame.pivot_um = Vec3(stream.uniform({-100, 100}), stream.uniform({-100, 100}), 3.0);
    const double angle = stream.uniform({0, 6.28});
    frame.direction = Vec3(std::cos(angle), std::sin(angle), 0.0);
    frame.noise_offsets = {Vec3(1, 2, 3), Vec3(4, 5, 6)};
    const Pair pair = decode(chromosome, frame, p);
    const double turn = std::acos(std::clamp(pair.direction.dot(frame.direction), -1.0, 1.0)) * 180.0 / maths::kPi;
    RC_ASSERT(turn <= p.search.turn_max_deg + 1e-5);
    RC_ASSERT(pair.direction.z() == 0.0 && std::abs(pair.direction.norm() - 1.0) < 1e-12);
    double volumes[2];
    for (std::size_t k = 0; k < 2; ++k) {
      const BodyGeometry& g = pair.bodies[k];
      const double mean = std::sqrt(g.semiaxes_um.x() * g.semiaxes_um.y());
      volumes[k] = testing::ellipsoid_volume_um3(g.semiaxes_um);
      RC_ASSERT(within(p.cell.elongation, g.semiaxes_um.x() / g.semiaxes_um.y()));
      RC_ASSERT(within(p.cell.flatness, g.semiaxes_um.z() / mean));
      RC_ASSERT(g.noise_offset == frame.noise_offsets[k]);
      RC_ASSERT(std::abs(g.centre_um.z() - 0.55 * g.semiaxes_um.z()) < 1e-12);
      const double upright = rotation_matrix(g.rotation_rad)(2, 2);  // cosine of the whole tilt
      const double tilt = p.search.tilt_max_deg * maths::kPi / 180.0;
      RC_ASSERT(upright >= std::cos(tilt) * std::cos(tilt) - 1e-9);
      const Body body(g, p.noise);
      const Vec3 offset = g.centre_um - frame.pivot_um;
      const double along = offset.dot(pair.direction),
                   across = offset.dot(Vec3(-pair.direction.y(), pair.direction.x(), 0.0));
      RC_ASSERT((k == 0) == (along < 0.0));  // the larger share on the side -n
      RC_ASSERT(within(p.search.distance, std::abs(along) / body.half_width_um(pair.direction)));
      RC_ASSERT(std::abs(across) <= p.search.sideways * mean + 1e-9);
      for (int axis = 0; axis < 2; ++axis) {
        RC_ASSERT(body.box().high[axis] <= frame.pivot_um[axis] + reach &&
                  body.box().low[axis] >= frame.pivot_um[axis] - reach);
        RC_ASSERT(body.box().high[axis] - g.centre_um[axis] <= extent &&
                  g.centre_um[axis] - body.box().low[axis] <= extent);
      }
    }
    RC_ASSERT(within(p.cell.pair_volume_um3, volumes[0] + volumes[1]));
    RC_ASSERT(within(p.cell.smaller_share, volumes[1] / (volumes[0] + volumes[1])));
  }
}

TEST(Decode, TheUnturnedCandidateStandsAcrossTheGivenPlane) {
  Params p;
  for (const Coding coding : {Coding::kGray, Coding::kBinary}) {
    p.search.coding = coding;
    Stream stream = testing::case_stream(5);
    Chromosome chromosome = random_chromosome(kGeneCountMono, 8, stream);
    chromosome.set_code(kTurn, code_of(0.5, 8, coding));
    PairFrame frame;
    frame.direction = Vec3(0.6, 0.8, 0.0);
    const double angle = std::acos(decode(chromosome, frame, p).direction.dot(frame.direction)) * 180.0 / maths::kPi;
    EXPECT_LE(angle, 90.0 / 255.0 + 1e-6);  // 8 bits have no exact middle: half a step of 180 deg / 255
  }
}

TEST(Orientation, TiltsThenTurnsAboutTheVertical) {
  const Mat3 m = rotation_matrix(orientation_rad(0.5 * maths::kPi, 0.0, 0.0));
  EXPECT_LT((m * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12);
  const Mat3 tilted = rotation_matrix(orientation_rad(0.3, 0.1, 0.0));
  EXPECT_NEAR(tilted(2, 2), std::cos(0.1), 1e-12);
  EXPECT_LT((tilted.col(0) - Vec3(std::cos(0.3), std::sin(0.3), 0.0)).norm(),
            1e-12);  // the tilt about x leaves the axis A level
}

}  // namespace
}  // namespace colony
