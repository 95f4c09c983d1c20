// Cycle times: the doubling time that follows from the engine's own stream, truncation, correlation of siblings.
#include "engine/model/cycle.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

// Divisions of 500,000 parents: 10^6 draws by the very function that a division calls.
std::vector<double> draws(const CycleParams& cycle) {
  std::vector<double> times;
  for (std::uint32_t parent = 1; parent <= 500'000; ++parent) {
    const auto [own, daughter] = draw_sibling_cycles_h(cycle, 1, CellId{parent}, 2);
    times.push_back(own);
    times.push_back(daughter);
  }
  return times;
}

// ln 2 / lambda with 2 mean(exp(-lambda T)) = 1 (Euler-Lotka), by Newton's method.
double doubling_h(const std::vector<double>& times) {
  double lambda = std::log(2.0) / 12.0;
  for (int round = 0; round < 6; ++round) {
    double sum = 0.0, slope = 0.0;
    for (const double t : times) {
      const double e = std::exp(-lambda * t);
      sum += e;
      slope -= t * e;
    }
    lambda -= (2.0 * sum / static_cast<double>(times.size()) - 1.0) / (2.0 * slope / static_cast<double>(times.size()));
  }
  return std::log(2.0) / lambda;
}

TEST(Cycle, NormalCyclesDoubleThePopulationIn11887Hours) {
  const CycleParams cycle;
  const std::vector<double> times = draws(cycle);
  EXPECT_NEAR(doubling_h(times), 11.887, 0.02);
  const auto [low, high] = std::minmax_element(times.begin(), times.end());
  EXPECT_GE(*low, 6.0);
  EXPECT_LE(*high, 18.0);
  EXPECT_LT(*low, 6.1);  // the tails are cut, not missing
  EXPECT_GT(*high, 17.9);
  const testing::Mean mean = testing::mean_of(times);
  EXPECT_NEAR(mean.value, 12.0, 5.0 * mean.se);
  // sd of a normal truncated at 3 sd: 2 sqrt(1 - 2 * 3 phi(3) / (2 Phi(3) - 1)) = 1.97331.
  EXPECT_NEAR(mean.se * std::sqrt(static_cast<double>(times.size())), 1.9733, 0.007);
}

TEST(Cycle, UniformCyclesDoubleThePopulationIn11961Hours) {
  CycleParams cycle;
  cycle.distribution = CycleDistribution::kUniform;
  const std::vector<double> times = draws(cycle);
  EXPECT_NEAR(doubling_h(times), 11.961, 0.02);
  const auto [low, high] = std::minmax_element(times.begin(), times.end());
  EXPECT_GE(*low, 10.0);
  EXPECT_LT(*high, 14.0);
}

TEST(Cycle, SiblingsCorrelateAsAskedAndKeepTheMarginalDistribution) {
  const std::uint32_t pairs = testing::scaled(60'000U, 500'000U);
  for (const CycleDistribution distribution : {CycleDistribution::kNormal, CycleDistribution::kUniform}) {
    for (const double asked : {0.0, 0.3, 0.6, 0.9}) {
      CycleParams cycle;
      cycle.distribution = distribution;
      cycle.sibling_correlation = asked;
      std::vector<double> a, b;
      for (std::uint32_t parent = 1; parent <= pairs; ++parent) {
        const auto [own, daughter] = draw_sibling_cycles_h(cycle, 3, CellId{parent}, 1);
        a.push_back(own);
        b.push_back(daughter);
      }
      const testing::Mean ma = testing::mean_of(a), mb = testing::mean_of(b);
      double sab = 0.0, saa = 0.0, sbb = 0.0;
      for (std::size_t i = 0; i < a.size(); ++i) {
        sab += (a[i] - ma.value) * (b[i] - mb.value);
        saa += (a[i] - ma.value) * (a[i] - ma.value);
        sbb += (b[i] - mb.value) * (b[i] - mb.value);
      }
      const double found = sab / std::sqrt(saa * sbb);
      const bool normal = distribution == CycleDistribution::kNormal;
      std::printf("%s: correlation asked %.1f, found %.4f\n", normal ? "normal " : "uniform", asked, found);
      // Truncating both at 3 sd takes a little off the normal's correlation; the uniform's is exact.
      EXPECT_NEAR(found, asked, 5.0 / std::sqrt(static_cast<double>(pairs)) + (normal ? 0.01 : 0.0));
      EXPECT_NEAR(ma.value, 12.0, 5.0 * ma.se);
      EXPECT_NEAR(mb.value, 12.0, 5.0 * mb.se);
      const double sd = normal ? 1.97 : 2.0 / std::sqrt(3.0);
      EXPECT_NEAR(std::sqrt(saa / static_cast<double>(pairs)), sd, 0.03);
      const auto [low, high] = std::minmax_element(b.begin(), b.end());
      const Interval range = cycle_range_h([&] {
        Params p;
        p.cycle = cycle;
        return p;
      }());
      EXPECT_GE(*low, range.low);
      EXPECT_LE(*high, range.high);
    }
  }
}

TEST(Cycle, WithoutSpreadEveryCycleIsTheMean) {
  CycleParams cycle;
  cycle.sd_h = 0.0;
  cycle.half_range_h = 0.0;
  for (const double correlation : {0.0, 0.5}) {
    for (const CycleDistribution distribution : {CycleDistribution::kNormal, CycleDistribution::kUniform}) {
      cycle.distribution = distribution;
      cycle.sibling_correlation = correlation;
      EXPECT_EQ(draw_sibling_cycles_h(cycle, 1, CellId{1}, 1), (std::array<double, 2>{12.0, 12.0}));
    }
  }
}

}  // namespace
}  // namespace colony
