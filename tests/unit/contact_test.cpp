// Contact: where two and three bodies meet, by the rules `sum` and `max`.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

constexpr std::array<ContactRule, 2> kRules = {ContactRule::kSum, ContactRule::kMax};

TEST(Contact, TheFaceOfEqualParallelEllipsoidsIsThePlaneOfEqualFields) {
  // Noise-free and parallel: f_i - f_j is linear, the face lies half way, across the line of centres in the cells'
  // frame.
  for (std::uint32_t number = 1; number <= 20; ++number) {
    Stream stream = testing::case_stream(number);
    BodyGeometry g = testing::any_ellipsoid(stream, 0.0);
    g.centre_um = Vec3(0.0, 0.0, 60.0);
    const Body a(g, testing::smooth());
    const Mat3 from_unit = a.to_unit().inverse();
    const Vec3 shift = from_unit * (1.0 * testing::unit_vector(stream));  // overlapping: one semiaxis apart
    g.centre_um += shift;
    const Body b(g, testing::smooth());
    const Vec3 apart = a.to_unit() * shift;  // in the unit frame
    const Vec3 middle = 0.5 * (a.centre_um() + b.centre_um());
    const std::array<const Body*, 1> near_a = {&b}, near_b = {&a};
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p = middle + from_unit * (1.5 * stream.uniform() * testing::unit_vector(stream));
      const double side = apart.dot(a.to_unit() * (p - middle));  // > 0: nearer to b
      if (std::abs(side) < 1e-9) continue;
      for (const ContactRule rule : kRules) {
        ASSERT_EQ(deformed_contains(a, near_a, rule, p), a.contains(p) && (side < 0.0 || !b.contains(p)))
            << "case " << number;
        ASSERT_EQ(deformed_contains(b, near_b, rule, p), b.contains(p) && (side > 0.0 || !a.contains(p)))
            << "case " << number;
      }
    }
  }
}

TEST(Contact, EachOfTwoEqualParallelEllipsoidsLosesHalfTheLens) {
  const double x = 1.2;  // distance in semiaxes
  const double lens = (4.0 + x) * (2.0 - x) * (2.0 - x) / 16.0;
  const BodyGeometry g{Vec3(0, 0, 60), Vec3(12, 8, 5), Vec3(0.3, -0.2, 0.9), Vec3::Zero()};
  const Body a(g, testing::smooth());
  BodyGeometry h = g;
  h.centre_um += a.to_unit().inverse() * (x * Vec3(0.6, 0.0, 0.8));
  const Body b(h, testing::smooth());
  const std::array<const Body*, 1> near_a = {&b}, near_b = {&a};
  const PointSet points = testing::points(65'536, 1);
  const double full = testing::ellipsoid_volume_um3(g.semiaxes_um);
  for (const ContactRule rule : kRules) {
    EXPECT_NEAR(deformed_mass(a, near_a, rule, points).volume_um3 / full, 1.0 - 0.5 * lens, 0.002);
    EXPECT_NEAR(deformed_mass(b, near_b, rule, points).volume_um3 / full, 1.0 - 0.5 * lens, 0.002);
  }
}

TEST(Contact, NoisyNeighboursShareTheirFaceWithoutGapOrOverlap) {
  for (std::uint32_t number = 1; number <= 30; ++number) {
    Stream stream = testing::case_stream(number);
    const Body a(testing::spread_cell(stream, 0.0, 0.0, 0.0), testing::rough()),
        b(testing::spread_cell(stream, 10.0, 0.0, 2.0), testing::rough());
    const std::array<const Body*, 1> near_a = {&b}, near_b = {&a};
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p(stream.uniform({-15, 25}), stream.uniform({-15, 15}), stream.uniform({0, 8}));
      if (!a.contains(p) && !b.contains(p)) continue;
      for (const ContactRule rule : kRules) {
        const bool in_a = deformed_contains(a, near_a, rule, p), in_b = deformed_contains(b, near_b, rule, p);
        ASSERT_TRUE(in_a || in_b) << "a void between two cells, case " << number;
        ASSERT_FALSE(in_a && in_b) << "a point in both, case " << number;
      }
    }
  }
}

TEST(Contact, DeformedContainsIsTheSignOfTheDeformedField) {
  for (std::uint32_t number = 1; number <= 200; ++number) {
    Stream stream = testing::case_stream(number);
    const Body body(testing::spread_cell(stream, 0.0, 0.0, 0.0), testing::rough());
    std::vector<Body> others;
    for (int k = 0; k < 4; ++k) others.emplace_back(testing::spread_cell(stream, 0.0, 0.0, 12.0), testing::rough());
    std::vector<const Body*> near;
    for (const Body& other : others) near.push_back(&other);
    for (int i = 0; i < 200; ++i) {
      const Vec3 p(stream.uniform({-15, 15}), stream.uniform({-15, 15}), stream.uniform({-1, 8}));
      for (const ContactRule rule : kRules) {
        double taken = 0.0;  // the definition, every field evaluated
        for (const Body* other : near) {
          const double f = std::max(0.0, other->field(p));
          taken = rule == ContactRule::kSum ? taken + f : std::max(taken, f);
        }
        ASSERT_EQ(deformed_field(body, near, rule, p), body.field(p) - taken);
        ASSERT_EQ(deformed_contains(body, near, rule, p), p.z() >= 0.0 && body.field(p) - taken >= 0.0)
            << "case " << number;
      }
    }
  }
}

// Share of the union of hexagonally packed discs that belongs to no deformed cell. Discs: the plane through the centres
// of spheres. Spacing up to sqrt(3) R the discs cover the plane, so the share of the union is the share of the plane:
// one unit cell suffices.
double void_share(double spacing, ContactRule rule, int side) {
  const double radius = 1.0, z = 10.0;
  std::vector<Body> discs;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      const Vec3 centre(spacing * (i + 0.5 * j), spacing * std::sqrt(0.75) * j, z);
      discs.emplace_back(testing::sphere(radius, centre), testing::smooth());
    }
  }
  int covered = 0, empty = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const double s = (i + 0.5) / side, t = (j + 0.5) / side;
      const Vec3 p(spacing * (s + 0.5 * t), spacing * std::sqrt(0.75) * t, z);
      std::vector<const Body*> here;
      for (const Body& disc : discs) {
        if (disc.contains(p)) here.push_back(&disc);
      }
      if (here.empty()) continue;
      ++covered;
      int owners = 0;
      for (const Body* disc : here) {
        std::vector<const Body*> others;
        for (const Body* other : here) {
          if (other != disc) others.push_back(other);
        }
        owners += deformed_contains(*disc, others, rule, p) ? 1 : 0;
      }
      if (owners == 0) ++empty;
    }
  }
  return static_cast<double>(empty) / covered;
}

TEST(Contact, SumLeavesTheStatedVoidsBetweenHexagonalDiscs) {
  const int side = testing::scaled(150, 600);
  EXPECT_EQ(void_share(1.80, ContactRule::kSum, side), 0.0);
  EXPECT_EQ(void_share(std::sqrt(3.0), ContactRule::kSum, side), 0.0);
  EXPECT_NEAR(void_share(1.60, ContactRule::kSum, side), 0.007, 0.001);
  EXPECT_NEAR(void_share(1.50, ContactRule::kSum, side), 0.026, 0.001);
  EXPECT_NEAR(void_share(1.30, ContactRule::kSum, side), 0.127, 0.001);
}

TEST(Contact, MaxIsAnExactPartition) {
  for (const double spacing : {1.80, 1.60, 1.50, 1.30, 1.0})
    EXPECT_EQ(void_share(spacing, ContactRule::kMax, 100), 0.0) << spacing;
}

}  // namespace
}  // namespace colony
