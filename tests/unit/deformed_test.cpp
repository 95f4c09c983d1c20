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
  const std::vector<float>& column(int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  kernel::PointColumns columns() const { return {x.data(), y.data(), z.data()}; }
  std::size_t pad(float with) {  // their number
    const std::size_t n = x.size();
    for (std::vector<float>* column : {&x, &y, &z}) column->resize(n + kernel::kPadding, with);
    return n;
  }
};

NoiseParams noise_of(std::uint32_t number) {
  return number % 4 == 0 ? testing::smooth() : number % 4 == 1 ? NoiseParams{0.45, 5.0, 6.0} : number % 4 == 2 ? NoiseParams{0.40, 8.0, 1.4} : testing::rough();
}

// The sums of the points' own coordinates, as multiples of 2^-24, say which points were counted.
TEST(SumDeformed, EqualsItsTwinWithBothRulesOnEveryTarget) {
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
    Points marks;
    const auto mark = [&] { return static_cast<float>(stream.next_u32() >> 8) * 0x1.0p-24F; };
    for (std::uint32_t i = 0; i < n; ++i) {
      const float x = mark(), y = mark();
      marks.add(x, y, mark());
    }
    marks.pad(0.5F);
    for (const bool largest_only : {false, true}) {
      kernel::DeformedSums expected;
      for (std::size_t i = 0; i < n; ++i) {
        const bool inside = kernel::is_in_deformed_reference(own, others, largest_only, points.x[i], points.y[i], points.z[i]);
        taken += !inside && kernel::is_inside_reference(own, points.x[i], points.y[i], points.z[i]) ? 1 : 0;
        if (!inside) continue;
        ++expected.count;
        for (int axis = 0; axis < 3; ++axis) expected.sum[axis] += static_cast<double>(marks.column(axis)[i]);
      }
      flagged += expected.count;
      looked_at += n;
      testing::on_every_target([&](const std::string& name) {
        const kernel::DeformedSums sums = kernel::sum_deformed(own, others, largest_only, points.columns(), marks.columns(), n);
        ASSERT_EQ(sums.count, expected.count) << name << " scene " << number << " largest only " << largest_only;
        for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(sums.sum[axis], expected.sum[axis]) << name << " scene " << number << " axis " << axis;
      }, number == scenes && largest_only);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(flagged, looked_at / 10);  // the scenes do exercise what they are made for
  EXPECT_GT(taken, looked_at / 50);
}

TEST(SumDeformed, IsExactOverManyPoints) {
  // A ball about all points: more of them than a whole number of 32 bits holds the sums of.
  const Body ball(testing::sphere(50.0, Vec3::Zero()), testing::smooth());
  Points points, marks;
  for (int i = 0; i < 65'536; ++i) {
    points.add(0.25F, 0.25F, 0.25F);
    marks.add(0x0.ffffffp0F, 0x1.0p-24F, 0.0F);
  }
  points.pad(0.0F);
  const std::size_t n = marks.pad(0.0F);
  testing::on_every_target([&](const std::string& name) {
    const kernel::DeformedSums sums = kernel::sum_deformed(kernel::FloatBody(ball, Vec3::Zero()), {}, false, points.columns(), marks.columns(), n);
    ASSERT_EQ(sums.count, 65'536U) << name;
    ASSERT_EQ(sums.sum[0], 65'536.0 - 0x1.0p-8) << name;
    ASSERT_EQ(sums.sum[1], 0x1.0p-8) << name;
    ASSERT_EQ(sums.sum[2], 0.0) << name;
  }, false);
}

TEST(NearestOutside, IsTheFirstOfTheNearestAndNoneWhereAllAreInside) {
  std::uint64_t by_neighbour = 0, inside_its_band = 0, tied = 0;
  for (std::uint32_t number = 1; number <= testing::scaled(600U, 6000U); ++number) {
    Stream stream = testing::case_stream(number);
    const NoiseParams noise = noise_of(number);
    const bool ties = number % 2 == 0;       // whole coordinates: many distances are equal, exactly
    const bool all_inside = number % 7 == 0;
    const Body body(all_inside ? testing::sphere(60.0, Vec3::Zero()) : testing::any_ellipsoid(stream, 2.0), noise);
    const kernel::FloatBody own(body, Vec3::Zero());
    std::vector<kernel::FloatBody> others;
    const std::uint32_t count = all_inside ? 0 : stream.below(5);
    for (std::uint32_t k = 0; k < count; ++k) others.emplace_back(Body(testing::any_ellipsoid(stream, 14.0), noise), Vec3::Zero());
    Points points;
    const std::uint32_t n = 1 + stream.below(300);
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto coordinate = [&] { return ties ? static_cast<float>(stream.below(21)) - 10.0F : static_cast<float>(stream.uniform({-12.0, 12.0})); };
      const float x = coordinate(), y = coordinate();
      points.add(x, y, coordinate());
    }
    points.pad(0.0F);  // nearer than any, but no points
    const bool largest_only = number % 3 == 0;
    const auto distance2 = [&](std::size_t i) { return (points.x[i] * points.x[i] + points.y[i] * points.y[i]) + points.z[i] * points.z[i]; };
    std::size_t expected = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (kernel::is_in_deformed_reference(own, others, largest_only, points.x[i], points.y[i], points.z[i])) continue;
      tied += expected != n && distance2(i) == distance2(expected) ? 1 : 0;
      if (expected == n || distance2(i) < distance2(expected)) expected = i;
    }
    if (all_inside) {
      EXPECT_EQ(expected, n);
    }
    if (expected < n) {
      by_neighbour += kernel::is_inside_reference(own, points.x[expected], points.y[expected], points.z[expected]) ? 1 : 0;
      inside_its_band += std::abs(kernel::smooth_reference(own, points.x[expected], points.y[expected], points.z[expected])) <= own.band ? 1 : 0;
    }
    testing::on_every_target([&](const std::string& name) {
      ASSERT_EQ(kernel::nearest_outside(own, others, largest_only, points.columns(), n), expected) << name << " case " << number;
    }, false);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(by_neighbour, 50U);
  EXPECT_GT(inside_its_band, 50U);
  EXPECT_GT(tied, 50U);
}

TEST(KeepInBall, KeepsWhatItsDefinitionSaysInTheirOrder) {
  for (std::uint32_t number = 1; number <= 100; ++number) {
    Stream stream = testing::case_stream(number);
    Points points;
    const std::uint32_t n = 1 + stream.below(300);
    const bool flat = number % 2 == 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto unit = [&] { return static_cast<float>(stream.uniform()); };
      const float x = unit(), y = unit();
      points.add(x, y, flat ? 0.5F : unit());
    }
    points.pad(0.5F);  // the centre: kept, if it were a point
    const float radius = 18.0F, low_z = flat ? -1.0F : static_cast<float>(stream.uniform({-18.0, 0.0}));
    Points expected;
    for (std::size_t i = 0; i < n; ++i) {
      const float x = 2.0F * points.x[i] - 1.0F, y = 2.0F * points.y[i] - 1.0F, z = 2.0F * points.z[i] - 1.0F;
      if ((x * x + y * y) + z * z <= 1.0F && radius * z >= low_z) expected.add(radius * x, radius * y, radius * z);
    }
    testing::on_every_target([&](const std::string& name) {
      Points found = points;
      const std::size_t kept = kernel::keep_in_ball(radius, low_z, found.x.data(), found.y.data(), found.z.data(), n);
      ASSERT_EQ(kept, expected.x.size()) << name << " case " << number;
      for (std::size_t i = 0; i < kept; ++i) {
        ASSERT_TRUE(found.x[i] == expected.x[i] && found.y[i] == expected.y[i] && found.z[i] == expected.z[i]) << name << " case " << number << " point " << i;
      }
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
