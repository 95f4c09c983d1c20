// One body: noise, rotation, the ellipsoid cut by the dish, projections and bounds, each against an independent
// computation.
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "engine/base/check.hpp"
#include "engine/shape/body.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

using testing::case_stream;

TEST(Noise, NeverExceedsItsBoundAndComesNearIt) {
  // Directed search: sin(q u) = 1 at u = (pi/2 + 2 pi k) / q; over k = 0..26 the second sine's phase takes 27 evenly
  // spaced values, so one k brings it within pi/27 of its maximum as well.
  for (const double phase : {0.0, 1.4, 3.0, 6.0}) {
    const NoiseParams p{0.40, 5.0, phase};
    double best = 0.0, best_g = -1.0;
    for (int k = 0; k < 27; ++k) {
      const double u = (0.5 + 2.0 * k) * maths::kPi / p.frequency;
      const double g = std::sin(p.frequency / 1.35 * u + phase);
      if (g > best_g) {
        best_g = g;
        best = u;
      }
    }
    const double near_worst = gardner_noise(best, best, best, p);
    EXPECT_LE(near_worst, noise_bound(p)) << phase;
    EXPECT_GE(near_worst, 0.985 * noise_bound(p)) << phase;
    Stream stream = case_stream(1);
    for (int i = 0; i < 20'000; ++i) {  // about the near-worst point
      const Vec3 at = Vec3::Constant(best) + 0.05 * Vec3(stream.normal(), stream.normal(), stream.normal());
      ASSERT_LE(std::abs(gardner_noise(at.x(), at.y(), at.z(), p)), noise_bound(p)) << at.transpose();
    }
  }
  EXPECT_DOUBLE_EQ(noise_bound({0.40, 5.0, 1.4}), 6.380 * 0.4 * 0.4 * 0.4);
}

TEST(Noise, IsBoundedOddAndPeriodicWithRms0804) {
  const int n = testing::scaled(100'000, 1'000'000);
  for (const NoiseParams& p : {NoiseParams{0.40, 5.0, 1.4}, NoiseParams{0.45, 2.0, 0.3}, NoiseParams{0.2, 8.0, 6.0}}) {
    const double period = noise_period(p);
    EXPECT_DOUBLE_EQ(period, 54.0 * maths::kPi / p.frequency);
    const double cube = p.amplitude * p.amplitude * p.amplitude;
    Stream stream = case_stream(2);
    double squares = 0.0;
    for (int i = 0; i < n; ++i) {
      const double u = period * stream.uniform(), v = period * stream.uniform(), w = period * stream.uniform();
      const double noise = gardner_noise(u, v, w, p);
      ASSERT_LE(std::abs(noise), 6.380 * cube);
      squares += noise * noise / n;
      if (i % 100 != 0) continue;
      ASSERT_NEAR(gardner_noise(-u, -v, -w, p), -noise, 1e-15);
      ASSERT_NEAR(gardner_noise(u + period, v, w, p), noise, 1e-12);
      ASSERT_NEAR(gardner_noise(u, v + period, w, p), noise, 1e-12);
      ASSERT_NEAR(gardner_noise(u, v, w + period, p), noise, 1e-12);
    }
    EXPECT_NEAR(std::sqrt(squares) / cube, 0.804, 0.02 * 0.804) << "q " << p.frequency;
  }
}

RC_GTEST_PROP(Rotation, VectorAndMatrixRoundTrip, (std::uint32_t number)) {
  Stream stream = case_stream(number);
  const Vec3 axis = testing::unit_vector(stream);
  for (const double angle : {0.0, 1e-13, 1e-9, 1e-6, 1e-3, 0.5, 1.0, 2.0, 3.0, maths::kPi - 1e-3, maths::kPi - 1e-7,
                             maths::kPi - 1e-12, maths::kPi * stream.uniform()}) {
    const Mat3 m = rotation_matrix(axis * angle);
    RC_ASSERT((m * m.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-14);
    const Vec3 back = rotation_vector(m);
    RC_ASSERT((rotation_matrix(back) - m).cwiseAbs().maxCoeff() < 1e-12);
    RC_ASSERT(std::abs(back.norm() - angle) < 1e-7);
    if (angle < 3.1) RC_ASSERT((back - axis * angle).norm() < 1e-12);
  }
}

TEST(Rotation, TurnsTheRightWay) {
  const Mat3 quarter = rotation_matrix(Vec3(0.0, 0.0, 0.5 * maths::kPi));
  EXPECT_LT((quarter * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-15);
  EXPECT_EQ(rotation_matrix(Vec3::Zero()), Mat3::Identity());
  for (int axis = 0; axis < 3; ++axis) {  // half a turn: the trace is -1
    const Vec3 half = maths::kPi * Vec3::Unit(axis);
    EXPECT_LT((rotation_matrix(rotation_vector(rotation_matrix(half))) - rotation_matrix(half)).cwiseAbs().maxCoeff(),
              1e-14);
  }
}

// Volume and first moment above the dish from vertical columns: each column meets an ellipsoid in an interval of z.
struct Columns {
  double volume = 0.0;
  Vec3 moment = Vec3::Zero();
};
Columns integrate_columns(const Body& body, int side) {
  const Vec2 half = body.footprint_half_extent_um();
  const Vec3 c = body.centre_um();
  const double dx = 2.0 * half.x() / side, dy = 2.0 * half.y() / side;
  Columns out;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const double x = c.x() - half.x() + (i + 0.5) * dx, y = c.y() - half.y() + (j + 0.5) * dy;
      // The smooth field is a quadratic in z: recovered from three values.
      const double f0 = body.smooth_field({x, y, c.z()}), f1 = body.smooth_field({x, y, c.z() + 1.0}),
                   f2 = body.smooth_field({x, y, c.z() - 1.0});
      const double a = 0.5 * (f1 + f2) - f0, b = 0.5 * (f1 - f2);
      const double discriminant = b * b - 4.0 * a * f0;
      if (!(discriminant > 0.0)) continue;
      const double root = std::sqrt(discriminant);
      const double low = std::max(0.0, c.z() + (-b + root) / (2.0 * a)),
                   high = std::max(0.0, c.z() + (-b - root) / (2.0 * a));
      out.volume += (high - low) * dx * dy;
      out.moment += Vec3(x * (high - low), y * (high - low), 0.5 * (high * high - low * low)) * dx * dy;
    }
  }
  return out;
}

TEST(DishCut, VolumeAndCentroidEqualTheirQuadratureForTiltedEllipsoids) {
  for (std::uint32_t number = 1; number <= 40; ++number) {
    Stream stream = case_stream(number);
    BodyGeometry g = testing::any_ellipsoid(stream, 20.0);
    const Body whole(g, testing::smooth());
    g.centre_um.z() = stream.uniform({-0.8, 1.3}) * whole.half_width_um(Vec3::UnitZ());
    const Body body(g, testing::smooth());
    const Columns exact = integrate_columns(body, 300);
    EXPECT_NEAR(volume_above_dish_um3(g) / exact.volume, 1.0, 2e-3) << "case " << number;
    EXPECT_LT((centroid_above_dish_um(g) - exact.moment / exact.volume).norm(), 0.02) << "case " << number;
  }
}

TEST(DishCut, FullHalfAndEmptyBodiesAreExact) {
  BodyGeometry g = testing::sphere(5.0, Vec3(1.0, 2.0, 5.0));
  const double full = testing::ellipsoid_volume_um3(g.semiaxes_um);
  EXPECT_DOUBLE_EQ(volume_above_dish_um3(g), full);
  EXPECT_EQ(centroid_above_dish_um(g), g.centre_um);
  g.centre_um.z() = 100.0;
  EXPECT_DOUBLE_EQ(volume_above_dish_um3(g), full);
  g.centre_um.z() = 0.0;
  EXPECT_DOUBLE_EQ(volume_above_dish_um3(g), 0.5 * full);
  EXPECT_NEAR(centroid_above_dish_um(g).z(), 0.375 * 5.0, 1e-14);  // of a half ball
  g.centre_um.z() = -5.0;
  EXPECT_EQ(volume_above_dish_um3(g), 0.0);
  EXPECT_EQ(centroid_above_dish_um(g), g.centre_um);
  // Spread on the dish, untilted: the centre at 0.55 C keeps (2 + 3d - d^3)/4 with d = 0.55.
  const Vec3 s(10.0, 8.0, 4.0);
  const BodyGeometry spread = {Vec3(0, 0, spread_height_um(s)), s, Vec3::Zero(), Vec3::Zero()};
  EXPECT_NEAR(volume_above_dish_um3(spread) / testing::ellipsoid_volume_um3(s),
              (2.0 + 3.0 * 0.55 - 0.55 * 0.55 * 0.55) / 4.0, 1e-14);
}

TEST(Footprint, IsTheVerticalProjectionOfTheSmoothEllipsoid) {
  for (std::uint32_t number = 1; number <= 200; ++number) {
    Stream stream = case_stream(number);
    const Body body(testing::any_ellipsoid(stream, 5.0), testing::smooth());
    const Vec2 half = body.footprint_half_extent_um();
    for (int i = 0; i < 100; ++i) {
      const double x = body.centre_um().x() + 1.2 * half.x() * stream.uniform({-1.0, 1.0});
      const double y = body.centre_um().y() + 1.2 * half.y() * stream.uniform({-1.0, 1.0});
      const double z = body.centre_um().z();
      const double f0 = body.smooth_field({x, y, z}), f1 = body.smooth_field({x, y, z + 1.0}),
                   f2 = body.smooth_field({x, y, z - 1.0});
      const double a = 0.5 * (f1 + f2) - f0, b = 0.5 * (f1 - f2);
      const double highest = f0 - b * b / (4.0 * a);
      if (std::abs(highest) < 1e-9) continue;  // on the rim, to rounding
      ASSERT_EQ(body.footprint_contains(x, y), highest >= 0.0) << "case " << number << " at " << x << " " << y;
    }
    EXPECT_NEAR(half.x(), body.half_width_um(Vec3::UnitX()), 1e-10);
    EXPECT_NEAR(half.y(), body.half_width_um(Vec3::UnitY()), 1e-10);
  }
}

TEST(HalfWidth, IsTheFurthestPointAlongADirection) {
  for (std::uint32_t number = 1; number <= 50; ++number) {
    Stream stream = case_stream(number);
    const Body body(testing::any_ellipsoid(stream, 0.0), testing::smooth());
    const Vec3 unit = testing::unit_vector(stream);
    const Mat3 from_unit = body.to_unit().inverse();
    double furthest = 0.0;
    for (int i = 0; i < 5000; ++i) furthest = std::max(furthest, unit.dot(from_unit * testing::unit_vector(stream)));
    EXPECT_LE(furthest, body.half_width_um(unit) * (1.0 + 1e-12)) << "case " << number;
    EXPECT_GE(furthest, body.half_width_um(unit) * 0.995) << "case " << number;
  }
}

RC_GTEST_PROP(BodyBox, HoldsEveryPointOfTheNoisyBodyAboveTheDish, (std::uint32_t number)) {
  Stream stream = case_stream(number);
  const NoiseParams noise{stream.uniform({0.0, 0.40}), stream.uniform({2.0, 8.0}), stream.uniform({0.0, 6.28})};
  const Body body(testing::any_ellipsoid(stream, 5.0), noise);
  const double reach = 1.5 * body.semiaxes_um().maxCoeff() * body.noisy_scale();
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p =
        body.centre_um() + reach * Vec3(stream.uniform({-1, 1}), stream.uniform({-1, 1}), stream.uniform({-1, 1}));
    const bool inside = p.z() >= 0.0 && body.field(p) >= 0.0;
    RC_ASSERT(body.contains(p) == inside);  // the shortcut by the noise bound decides nothing differently
    if (!inside) continue;
    RC_ASSERT((p.array() >= body.box().low.array()).all() && (p.array() <= body.box().high.array()).all());
  }
}

RC_GTEST_PROP(Separated, NeverSeparatesBodiesThatShareAPoint, (std::uint32_t number)) {
  Stream stream = case_stream(number);
  const Body a(testing::any_ellipsoid(stream, 3.0), testing::rough());
  BodyGeometry other = testing::any_ellipsoid(stream, 3.0);
  const Vec3 direction = testing::unit_vector(stream);
  const double gap = stream.uniform({0.7, 1.3}) * (a.noisy_scale() * a.half_width_um(direction) + 8.0);
  other.centre_um += gap * direction;
  const Body b(other, testing::rough());
  RC_CLASSIFY(separated(a, b), "separated");
  RC_ASSERT(separated(a, b) == separated(b, a));
  if (separated(a, b)) RC_ASSERT(!touches(a, b, testing::points(4096, number)));
}

TEST(Body, RefusesWhatIsNotABody) {
  const double nan = std::nan("");
  EXPECT_THROW(Body(testing::sphere(0.0, Vec3::Zero()), testing::smooth()), CheckFailure);
  EXPECT_THROW(Body(testing::sphere(-1.0, Vec3::Zero()), testing::smooth()), CheckFailure);
  EXPECT_THROW(Body(testing::sphere(nan, Vec3::Zero()), testing::smooth()), CheckFailure);
  EXPECT_THROW(Body(testing::sphere(5.0, Vec3(0.0, nan, 0.0)), testing::smooth()), CheckFailure);
}

}  // namespace
}  // namespace colony
