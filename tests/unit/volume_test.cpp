// Volumes on scrambled Sobol points: error against exact volumes of balls and lenses, and its slope against plain Monte
// Carlo.
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

constexpr double kRadius_um = 10.0;
const Vec3 kHigh(0.0, 0.0, 40.0);  // well above the dish

double relative_rms(const std::vector<double>& errors) {
  double squares = 0.0;
  for (const double e : errors) squares += e * e / static_cast<double>(errors.size());
  return std::sqrt(squares);
}

double ball_error_sobol(std::uint32_t n, std::uint32_t scramblings) {
  const Body ball(testing::sphere(kRadius_um, kHigh), testing::smooth());
  const double exact = testing::ellipsoid_volume_um3(ball.semiaxes_um());
  OverlapScratch scratch;
  OverlapCounts counts;
  std::vector<double> errors;
  for (std::uint32_t k = 1; k <= scramblings; ++k) {
    count_overlaps(ball, {}, std::nullopt, testing::points(n, k), scratch, counts);
    errors.push_back(ball.box().volume() * counts.hit_count / n / exact - 1.0);
  }
  return relative_rms(errors);
}

double ball_error_monte_carlo(std::uint32_t n, std::uint32_t repeats) {
  std::vector<double> errors;
  for (std::uint32_t k = 1; k <= repeats; ++k) {
    Stream stream = testing::case_stream(k);
    std::uint32_t hits = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const double x = stream.uniform({-1, 1}), y = stream.uniform({-1, 1}), z = stream.uniform({-1, 1});
      hits += x * x + y * y + z * z <= 1.0 ? 1 : 0;
    }
    errors.push_back(8.0 * hits / n / (4.0 / 3.0 * maths::kPi) - 1.0);
  }
  return relative_rms(errors);
}

TEST(BallVolume, ErrorFallsAsNToTheMinusTwoThirdsAgainstMinusOneHalf) {
  const std::vector<std::uint32_t> sizes = {64, 256, 1024, 4096};
  const std::vector<double> stated = {0.058, 0.034, 0.012, 0.0039};
  const std::uint32_t repeats = testing::scaled(400U, 4000U);
  std::vector<double> log_n, log_sobol, log_plain;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double sobol = ball_error_sobol(sizes[i], repeats), plain = ball_error_monte_carlo(sizes[i], repeats / 2);
    std::printf("N %5u  Owen-Sobol %.4f (stated %.4f)  Monte Carlo %.4f\n", sizes[i], sobol, stated[i], plain);
    EXPECT_NEAR(sobol / stated[i], 1.0, 0.25) << sizes[i];
    EXPECT_LT(sobol, plain);
    log_n.push_back(std::log(sizes[i]));
    log_sobol.push_back(std::log(sobol));
    log_plain.push_back(std::log(plain));
  }
  const testing::Line sobol = testing::fit_line(log_n, log_sobol), plain = testing::fit_line(log_n, log_plain);
  std::printf("slopes: Owen-Sobol %.3f, Monte Carlo %.3f\n", sobol.slope, plain.slope);
  EXPECT_NEAR(sobol.slope, -2.0 / 3.0, 0.06);
  EXPECT_NEAR(plain.slope, -0.5, 0.04);
}

TEST(LensVolume, EqualsTheFormulaByTheReferenceFormAndByTheRatioOfCounts) {
  OverlapScratch scratch;
  OverlapCounts counts;
  for (const double x : {0.0, 0.3, 0.7, 1.0, 1.4, 1.8}) {
    const Body a(testing::sphere(kRadius_um, kHigh), testing::smooth());
    const Body b(testing::sphere(kRadius_um, kHigh + Vec3(0.0, x * kRadius_um, 0.0)), testing::smooth());
    const double exact = (4.0 + x) * (2.0 - x) * (2.0 - x) / 16.0;
    const std::vector<const Body*> near = {&b};
    std::vector<double> by_domain, by_counts;
    for (std::uint32_t k = 1; k <= 40; ++k) {
      const PointSet points = testing::points(4096, k);
      by_domain.push_back(interpenetration_volume_um3(a, b, points) / testing::ellipsoid_volume_um3(a.semiaxes_um()));
      count_overlaps(a, near, std::nullopt, points, scratch, counts);
      by_counts.push_back(static_cast<double>(counts.shared_counts[0]) / counts.hit_count);
    }
    const testing::Mean domain = testing::mean_of(by_domain), ratio = testing::mean_of(by_counts);
    std::printf("x %.1f  exact %.5f  domain %.5f +- %.5f  ratio %.5f +- %.5f\n", x, exact, domain.value, domain.se,
                ratio.value, ratio.se);
    EXPECT_NEAR(domain.value, exact, 5.0 * domain.se + 1e-6) << x;
    EXPECT_NEAR(ratio.value, exact, 5.0 * ratio.se + 1e-6) << x;
    EXPECT_LE(ratio.se, 0.001);
  }
  const Body a(testing::sphere(kRadius_um, kHigh), testing::smooth());
  const Body apart(testing::sphere(kRadius_um, kHigh + Vec3(0.0, 2.0 * kRadius_um, 0.0)), testing::smooth());
  EXPECT_EQ(interpenetration_volume_um3(a, apart, testing::points(4096, 1)), 0.0);
  EXPECT_FALSE(touches(a, apart, testing::points(4096, 1)));
}

TEST(DishCut, CountedVolumeOfACutEllipsoidIsTheAnalyticOne) {
  std::vector<double> ratios;
  for (std::uint32_t number = 1; number <= 100; ++number) {
    Stream stream = testing::case_stream(number);
    const BodyGeometry g = testing::spread_cell(stream, 0.0, 0.0, 0.0);
    const Body body(g, testing::smooth());
    const MassEstimate mass = deformed_mass(body, {}, ContactRule::kSum, testing::points(4096, number));
    ratios.push_back(mass.volume_um3 / volume_above_dish_um3(g));
    EXPECT_NEAR(ratios.back(), 1.0, 0.025) << "case " << number;
    EXPECT_LT((mass.centre_um - centroid_above_dish_um(g)).norm(), 0.2) << "case " << number;
  }
  const testing::Mean mean = testing::mean_of(ratios);
  EXPECT_NEAR(mean.value, 1.0, 4.0 * mean.se);
}

}  // namespace
}  // namespace colony
