// The deformed body by vectors: flags, nearest point, covers, mass; each against its twin or its definition.
#include "engine/space/deformed_kernel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"
#include "tests/support/targets.hpp"

namespace colony {
namespace {

struct Points {
  std::vector<float> x, y, z;
  void add(float px, float py, float pz) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(pz);
  }
  std::size_t pad(float with) {  // their number
    const std::size_t n = x.size();
    for (std::vector<float>* column : {&x, &y, &z}) column->resize(n + kernel::kPadding, with);
    return n;
  }
};

NoiseParams noise_of(std::uint32_t number) {
  return number % 4 == 0 ? testing::smooth() : number % 4 == 1 ? NoiseParams{0.45, 5.0, 6.0} : number % 4 == 2 ? NoiseParams{0.40, 8.0, 1.4} : testing::rough();
}

TEST(FlagDeformed, EqualsItsTwinWithBothRulesOnEveryTarget) {
  const std::uint32_t scenes = testing::scaled(400U, 5000U);
  std::uint64_t flagged = 0, taken = 0, looked_at = 0;
  for (std::uint32_t number = 1; number <= scenes; ++number) {
    Stream stream = testing::case_stream(number);
    const NoiseParams noise = noise_of(number);
    const auto any = [&](double spread) {
      return Body(number % 2 == 0 ? testing::spread_cell(stream, 0.0, 0.0, spread) : testing::any_ellipsoid(stream, spread), noise);
    };
    const Body body = any(0.0);
    const kernel::FloatBody own(body, body.centre_um());
    std::vector<kernel::FloatBody> others;
    const std::uint32_t count = stream.below(8);
    for (std::uint32_t k = 0; k < count; ++k) others.emplace_back(any(14.0), body.centre_um());
    Points points;
    const std::uint32_t n = 1 + stream.below(300);  // mostly no whole number of vectors
    for (std::uint32_t i = 0; i < n; ++i) {
      const Vec3 p = 1.3 * Vec3(stream.uniform({-1, 1}), stream.uniform({-1, 1}), stream.uniform({-1, 1})).cwiseProduct(0.5 * (body.box().high - body.box().low));
      points.add(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
    }
    points.pad(0.0F);
    for (const bool largest_only : {false, true}) {
      std::vector<std::uint8_t> expected(n + 1, 7);
      for (std::size_t i = 0; i < n; ++i) {
        expected[i] = kernel::is_in_deformed_reference(own, others, largest_only, points.x[i], points.y[i], points.z[i]) ? 1 : 0;
        flagged += expected[i];
        taken += kernel::is_inside_reference(own, points.x[i], points.y[i], points.z[i]) && expected[i] == 0 ? 1 : 0;
      }
      looked_at += n;
      testing::on_every_target([&](const std::string& name) {
        std::vector<std::uint8_t> flags(n + 1, 7);  // the last must be left alone
        kernel::flag_deformed(own, others, largest_only, points.x.data(), points.y.data(), points.z.data(), n, flags.data());
        ASSERT_EQ(flags, expected) << name << " scene " << number << " largest only " << largest_only;
      }, number == scenes && largest_only);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(flagged, looked_at / 10);  // the scenes do exercise what they are made for
  EXPECT_GT(taken, looked_at / 50);
}

TEST(NearestUnflagged, IsTheFirstOfTheNearestAndNoneWhereAllAreFlagged) {
  for (std::uint32_t number = 1; number <= testing::scaled(400U, 4000U); ++number) {
    Stream stream = testing::case_stream(number);
    Points points;
    std::vector<std::uint8_t> flags;
    const std::uint32_t n = 1 + stream.below(100);
    const bool ties = number % 2 == 0;  // whole coordinates: many distances are equal, exactly
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto coordinate = [&] {
        return ties ? static_cast<float>(stream.below(5)) - 2.0F : static_cast<float>(stream.uniform({-9.0, 9.0}));
      };
      const float x = coordinate(), y = coordinate();
      points.add(x, y, coordinate());
      flags.push_back(number % 7 == 0 || stream.below(4) != 0 ? 1 : 0);
    }
    points.pad(0.0F);  // nearer than any, but no points
    flags.resize(n + kernel::kPadding, 0);
    std::size_t expected = n;
    const auto distance2 = [&](std::size_t i) { return (points.x[i] * points.x[i] + points.y[i] * points.y[i]) + points.z[i] * points.z[i]; };
    for (std::size_t i = 0; i < n; ++i) {
      if (flags[i] == 0 && (expected == n || distance2(i) < distance2(expected))) expected = i;
    }
    if (number % 7 == 0) {
      EXPECT_EQ(expected, n);
    }
    testing::on_every_target([&](const std::string& name) {
      ASSERT_EQ(kernel::nearest_unflagged(points.x.data(), points.y.data(), points.z.data(), n, flags.data()), expected)
          << name << " case " << number;
    }, false);
    if (HasFatalFailure()) return;
  }
}

TEST(CountUncovered, EqualsItsTwinAndAFlatCoverHoldsItsWholeColumn) {
  std::uint64_t open = 0, all = 0;
  for (std::uint32_t number = 1; number <= testing::scaled(400U, 4000U); ++number) {
    Stream stream = testing::case_stream(number);
    std::vector<kernel::Cover> covers;
    const std::uint32_t count = stream.below(7);
    for (std::uint32_t k = 0; k < count; ++k) {
      const Body body(testing::any_ellipsoid(stream, 18.0), testing::smooth());
      const bool ball = number % 2 == 0;
      const Mat3 q = body.to_unit().transpose() * body.to_unit();
      const Vec3 flat = body.footprint_form();
      const auto f = [](double v) { return static_cast<float>(v); };
      const Vec3& c = body.centre_um();
      covers.push_back(ball ? kernel::Cover{{f(c.x()), f(c.y()), f(c.z())}, f(q(0, 0)), f(q(1, 1)), f(q(2, 2)), f(q(0, 1)), f(q(0, 2)), f(q(1, 2))}
                            : kernel::Cover{{f(c.x()), f(c.y()), 0.0F}, f(flat[0]), f(flat[2]), 0.0F, f(flat[1]), 0.0F, 0.0F});
      if (!ball) {  // a column: by the definition of the shadow, at any height
        for (int i = 0; i < 20; ++i) {
          const double x = stream.uniform({-30, 30}), y = stream.uniform({-30, 30});
          const Vec2 d = Vec2(x, y) - c.head<2>();
          const double form = flat[0] * d.x() * d.x() + 2.0 * flat[1] * d.x() * d.y() + flat[2] * d.y() * d.y();
          if (std::abs(form - 1.0) < 1e-4) continue;  // rounding
          EXPECT_EQ(kernel::is_covered_reference(covers.back(), f(x), f(y), f(stream.uniform({-50, 50}))), body.footprint_contains(x, y));
        }
      }
    }
    Points points;
    const std::uint32_t n = 1 + stream.below(600);
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto coordinate = [&] { return static_cast<float>(stream.uniform({-25.0, 25.0})); };
      const float x = coordinate(), y = coordinate();
      points.add(x, y, coordinate());
    }
    points.pad(1e6F);  // uncovered, and no points
    std::uint32_t expected = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const bool covered = std::any_of(covers.begin(), covers.end(), [&](const kernel::Cover& cover) {
        return kernel::is_covered_reference(cover, points.x[i], points.y[i], points.z[i]);
      });
      expected += covered ? 0 : 1;
    }
    open += expected;
    all += n;
    testing::on_every_target([&](const std::string& name) {
      ASSERT_EQ(kernel::count_uncovered(covers, points.x.data(), points.y.data(), points.z.data(), n), expected) << name << " case " << number;
    }, false);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(open, all / 10);
  EXPECT_LT(open, all - all / 10);
}

TEST(DeformedMass, InSinglePrecisionIsThatOfTheDoubleField) {
  std::vector<double> off_um;
  std::uint64_t hits = 0, differing = 0;
  OverlapScratch scratch;  // kept from case to case
  for (std::uint32_t number = 1; number <= testing::scaled(60U, 600U); ++number) {
    Stream stream = testing::case_stream(number);
    const double x = stream.uniform({-3e4, 3e4}), y = stream.uniform({-3e4, 3e4});  // far out on a large dish
    const Body body(testing::spread_cell(stream, x, y, 0.0), testing::rough());
    std::vector<Body> others;
    for (int k = 0; k < 6; ++k) others.emplace_back(testing::spread_cell(stream, x, y, 12.0), testing::rough());
    std::vector<const Body*> near;
    for (const Body& other : others) near.push_back(&other);
    PointSet points;
    tiled_sobol(4096, {number, number + 1, number + 2}, points);
    for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
      const MassEstimate found = deformed_mass(body, near, rule, points, scratch);
      std::uint32_t count = 0;
      Vec3 sum = Vec3::Zero();
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 p = placed_um(body.box(), points, i);
        if (!(deformed_field(body, near, rule, p) >= 0.0)) continue;
        ++count;
        sum += p;
      }
      hits += count;
      differing += static_cast<std::uint64_t>(std::abs(static_cast<std::int64_t>(count) - static_cast<std::int64_t>(found.hit_count)));
      if (count == 0 || found.hit_count == 0) continue;
      off_um.push_back((sum / count - found.centre_um).norm());
      EXPECT_NEAR(found.volume_um3, body.box().volume() * count / 4096.0, 2e-3 * found.volume_um3 + body.box().volume() * 2.0 / 4096.0);
    }
  }
  const testing::Mean mean = testing::mean_of(off_um);
  std::printf("figure: deformed mass in single precision: %llu of %llu hits differ; centre off by %.1e um on average, %.1e at most\n",
              static_cast<unsigned long long>(differing), static_cast<unsigned long long>(hits), mean.value, *std::max_element(off_um.begin(), off_um.end()));
  EXPECT_LE(differing, hits / 5'000);  // sines of 3e-6 and rounding about a membrane met by few points
  EXPECT_LT(mean.value, 1e-3);
}

TEST(NearestOutside, IsTheNearestOfThePlacedPointsOutsideTheDeformedBodyAndNoneInsideAll) {
  OverlapScratch scratch;
  for (std::uint32_t number = 1; number <= 40; ++number) {
    Stream stream = testing::case_stream(number);
    const Body body(testing::spread_cell(stream, 500.0, -900.0, 0.0), testing::rough());
    const Body other(testing::spread_cell(stream, 500.0, -900.0, 10.0), testing::rough());
    const std::array<const Body*, 1> near = {&other};
    const PointSet points = testing::points(1024, number);
    const Vec3 from = body.centre_um() + Vec3(stream.uniform({-2, 2}), stream.uniform({-2, 2}), 0.0);
    const auto found = nearest_outside_um(body.box(), from, body, near, ContactRule::kMax, points, scratch);
    double least = 1e9;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 p = placed_um(body.box(), points, i);
      if (deformed_field(body, near, ContactRule::kMax, p) < 0.0) least = std::min(least, (p - from).norm());
    }
    ASSERT_TRUE(found);
    EXPECT_NEAR((*found - from).norm(), least, 1e-4) << "case " << number;
    // A small box in the middle of a ball without neighbours.
    const Body ball(testing::sphere(5.0, Vec3(0, 0, 6)), testing::smooth());
    EXPECT_FALSE(nearest_outside_um({Vec3(-2, -2, 4), Vec3(2, 2, 8)}, Vec3(0, 0, 6), ball, {}, ContactRule::kSum, points, scratch));
  }
}

}  // namespace
}  // namespace colony
