#include "engine/analysis/growth_phases.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/random/stream.hpp"

namespace colony {
namespace {

/// N doubles every 12 h to 60 h, the radius then grows by 0.5 um/h to 300 h, then nothing; N is pi R^2 density throughout. `noise`: relative.
std::vector<GrowthPoint> three_phases(double end_h, double noise, Seed seed) {
  std::vector<GrowthPoint> rows;
  Stream stream(seed, CellId{1}, 0, Purpose::kFounder);
  const double radius_at_60 = 6.0 * std::sqrt(std::pow(2.0, 5.0));
  for (double t = 0.0; t <= end_h; t += 3.0) {
    const double radius = t <= 60.0 ? 6.0 * std::sqrt(std::pow(2.0, t / 12.0)) : radius_at_60 + 0.5 * (std::min(t, 300.0) - 60.0);
    const double size = radius * radius / 36.0;
    const double factor = 1.0 + noise * stream.normal();
    rows.push_back({t, size * factor, radius * std::sqrt(factor)});
  }
  return rows;
}

TEST(GrowthPhases, FindsThreePhasesWithTheirRates) {
  const GrowthPhases phases = *growth_phases(three_phases(420.0, 0.02, 1));
  ASSERT_TRUE(phases.exponential && phases.linear_radius && phases.plateau);
  EXPECT_NEAR(phases.exponential->value, 12.0, 0.3);
  EXPECT_LE(phases.exponential->interval.low, 12.0);
  EXPECT_GE(phases.exponential->interval.high, 12.0);
  EXPECT_NEAR(phases.exponential->to_h, 60.0, 6.0);
  EXPECT_NEAR(phases.linear_radius->value, 0.5, 0.01);
  EXPECT_NEAR(phases.linear_radius->to_h, 300.0, 15.0);
  EXPECT_GT(phases.linear_radius->r2, 0.99);
  EXPECT_NEAR(phases.plateau->value, std::pow((6.0 * std::sqrt(32.0) + 120.0) / 6.0, 2.0), 8.0);
  EXPECT_NEAR(phases.relative_sd, 0.02, 0.004);
}

TEST(GrowthPhases, IntervalsHoldWhatTheySay) {
  int exponential = 0, linear = 0;
  constexpr int kSeries = 100;
  for (int seed = 1; seed <= kSeries; ++seed) {
    const GrowthPhases phases = *growth_phases(three_phases(420.0, 0.02, static_cast<Seed>(seed)));
    if (!phases.exponential || !phases.linear_radius) continue;
    const Interval a = phases.exponential->interval, b = phases.linear_radius->interval;
    exponential += a.low <= 12.0 && a.high >= 12.0 ? 1 : 0;
    linear += b.low <= 0.5 && b.high >= 0.5 ? 1 : 0;
  }
  // 95 of 100 for given change points; finding them costs some.
  EXPECT_GE(exponential, 85);
  EXPECT_GE(linear, 85);
}

TEST(GrowthPhases, AMissingPhaseIsMissing) {
  const GrowthPhases young = *growth_phases(three_phases(57.0, 0.01, 3));
  EXPECT_TRUE(young.exponential);
  EXPECT_FALSE(young.linear_radius);
  EXPECT_FALSE(young.plateau);
  const GrowthPhases grown = *growth_phases(three_phases(280.0, 0.01, 3));
  EXPECT_TRUE(grown.exponential && grown.linear_radius);
  EXPECT_FALSE(grown.plateau);
  std::vector<GrowthPoint> still;
  for (int i = 0; i < 20; ++i) still.push_back({static_cast<double>(i), 100.0 + (i % 3), 50.0});
  const GrowthPhases rest = *growth_phases(still);
  EXPECT_FALSE(rest.exponential);
  EXPECT_FALSE(rest.linear_radius);
  ASSERT_TRUE(rest.plateau);
  EXPECT_NEAR(rest.plateau->value, 100.95, 0.1);
}

TEST(GrowthPhases, ACellThatHasNotDividedDoesNotGrow) {
  // One cell for 12 h, then two: as GET /series of a job at 13 h.
  std::vector<GrowthPoint> one;
  for (int i = 0; i < 200; ++i) one.push_back({13.0 * i / 199.0, i * 13 < 12 * 199 ? 1.0 : 2.0, 6.0 + 0.01 * i});
  for (const std::size_t rows : {std::size_t{100}, one.size()}) {
    const GrowthPhases phases = *growth_phases(std::span(one).first(rows));
    EXPECT_FALSE(phases.exponential) << rows;
    if (phases.lag) {
      EXPECT_EQ(phases.lag->from_h, 0.0);
      EXPECT_EQ(phases.lag->value, 1.0);
    }
    EXPECT_TRUE(phases.lag || phases.plateau) << rows;
  }
  // A slope that noise could have made is none; one beyond it is one, down as well as up.
  std::vector<GrowthPoint> shrinking;
  for (int i = 0; i < 30; ++i) shrinking.push_back({static_cast<double>(i), 1000.0 * std::pow(0.5, i / 10.0), 50.0});
  const GrowthPhases down = *growth_phases(shrinking);
  ASSERT_TRUE(down.exponential);
  EXPECT_NEAR(down.exponential->value, -10.0, 1e-6);
  EXPECT_FALSE(down.lag);
}

TEST(GrowthPhases, PerfectDataDivideByNothing) {
  const GrowthPhases phases = *growth_phases(three_phases(420.0, 0.0, 1));
  ASSERT_TRUE(phases.exponential && phases.linear_radius && phases.plateau);
  EXPECT_NEAR(phases.exponential->value, 12.0, 1e-6);
  EXPECT_NEAR(phases.linear_radius->value, 0.5, 1e-6);
}

TEST(GrowthPhases, RefusesByName) {
  const auto message = [](const std::vector<GrowthPoint>& rows) {
    const auto result = growth_phases(rows);
    return result ? "" : result.error().message;
  };
  std::vector<GrowthPoint> rows = three_phases(60.0, 0.0, 1);
  EXPECT_EQ(message({rows.begin(), rows.begin() + 5}), "series: 5 rows; at least 6 are needed");
  rows[4].time_h = rows[3].time_h;
  EXPECT_EQ(message(rows), "series: row 4: times must rise");
  rows = three_phases(60.0, 0.0, 1);
  rows[2].size = 0.0;
  EXPECT_EQ(message(rows), "series: row 2: the size must be above 0");
  rows = three_phases(60.0, 0.0, 1);
  rows[2].radius_um = std::nan("");
  EXPECT_EQ(message(rows), "series: row 2: the radius must be above 0");
  EXPECT_EQ(growth_phases(std::vector<GrowthPoint>(4001)).error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace colony
