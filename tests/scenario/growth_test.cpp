// What must come out (section 6 of the model), measured over seeds: growth, inhibition, sizes, one layer.
// Reduced: 20 seeds to 200 cells. COLONY_TEST_FULL=1: 40 seeds to 500 cells.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <optional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "engine/analysis/series.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

constexpr double kMissing = -1.0;

/// The figures of one colony.
struct Figures {
  Seed seed = 0;
  double doubling_h = kMissing;  // while N <= 12
  double time_12_h = kMissing, time_end_h = kMissing;
  testing::Line radius;  // um on h, from 40 cells on
  double radius_end_um = 0.0;
  double active_share = 0.0;
  double active_radial = 0.0, passive_radial = 0.0;  // mean distance from the centre over the colony's radius
  double centre_volume_um3 = 0.0, edge_volume_um3 = 0.0;
  double volume_early_um3 = 0.0, volume_end_um3 = 0.0;  // mean volume at 8 cells and at the end
  double volume_slope_um3 = 0.0;                        // of the mean volume on ln N
  double searches_per_division = 0.0;
  std::uint64_t above_dish_count = 0;   // bodies that do not reach the dish
  double centre_distance_min_um = 0.0;  // of two cells' projections
};

struct Sample {
  double time_h = 0.0;
  SeriesRow row;
};

double doubling_of(const std::vector<std::pair<double, std::uint64_t>>& counts, double end_h) {
  std::vector<double> t, log2_n;
  std::size_t at = 0;
  for (double time = 0.0; time <= end_h; time += 0.5) {
    while (at + 1 < counts.size() && counts[at + 1].first <= time) ++at;
    t.push_back(time);
    log2_n.push_back(std::log2(static_cast<double>(counts[at].second)));
  }
  return 1.0 / testing::fit_line(t, log2_n).slope;
}

void measure_end(const Colony& colony, Figures& f) {
  Vec2 centre = Vec2::Zero();
  for (const Cell& cell : colony.cells())
    centre += cell.centre_um.head<2>() / static_cast<double>(colony.cells().size());
  std::vector<double> active, passive, inner, outer;
  f.centre_distance_min_um = 1e9;
  for (const Cell& cell : colony.cells()) {
    const double radial = (cell.centre_um.head<2>() - centre).norm() / f.radius_end_um;
    (cell.activity == Activity::kActive ? active : passive).push_back(radial);
    if (radial < 0.5) inner.push_back(cell.volume_um3);
    if (radial > 0.85) outer.push_back(cell.volume_um3);
    if (!(cell.centre_um.z() < colony.body(cell.id).half_width_um(Vec3::UnitZ()))) ++f.above_dish_count;
    for (const Cell& other : colony.cells()) {
      if (other.id.value >= cell.id.value) break;
      f.centre_distance_min_um =
          std::min(f.centre_distance_min_um, (cell.centre_um - other.centre_um).head<2>().norm());
    }
  }
  f.active_share = static_cast<double>(active.size()) / static_cast<double>(colony.cells().size());
  f.active_radial = testing::mean_of(active).value;
  f.passive_radial = testing::mean_of(passive).value;
  f.centre_volume_um3 = testing::mean_of(inner).value;
  f.edge_volume_um3 = testing::mean_of(outer).value;
}

Figures grow(Seed seed, std::uint64_t cells) {
  Figures f;
  f.seed = seed;
  Simulator simulator(testing::spec_of(seed, cells));
  std::vector<std::pair<double, std::uint64_t>> counts = {{0.0, 1}};
  std::vector<Sample> samples;
  double next_sample_h = 0.0, searches = 0.0, divisions = 0.0;
  while (true) {
    std::optional<AgendaItem> first;
    if (!simulator.agenda().empty()) first = simulator.agenda().first();
    while (first && first->due_h > next_sample_h) {  // values after the last event <= the sample's time
      samples.push_back({next_sample_h, measure_series(simulator.colony(), next_sample_h)});
      next_sample_h += 4.0;
    }
    const std::optional<Event> event = simulator.step();
    if (!event) break;
    searches += event->kind() == EventKind::kDivided || event->kind() == EventKind::kInhibited ? 1.0 : 0.0;
    if (event->kind() != EventKind::kDivided) continue;
    divisions += 1.0;
    const std::uint64_t n = simulator.colony().cells().size();
    counts.emplace_back(event->time_h, n);
    if (n == 8) f.volume_early_um3 = measure_series(simulator.colony(), event->time_h).volume_mean_um3;
    if (n == 12) {
      f.time_12_h = event->time_h;
      f.doubling_h = doubling_of(counts, event->time_h);
    }
  }
  f.searches_per_division = searches / divisions;
  f.time_end_h = simulator.colony().time_h();
  const SeriesRow end = measure_series(simulator.colony(), f.time_end_h);
  f.radius_end_um = end.radius_um;
  f.volume_end_um3 = end.volume_mean_um3;
  std::vector<double> t, radius, log_n, volume;
  for (const Sample& sample : samples) {
    if (sample.row.cell_count >= 4) {
      log_n.push_back(std::log(static_cast<double>(sample.row.cell_count)));
      volume.push_back(sample.row.volume_mean_um3);
    }
    if (sample.row.cell_count < 40) continue;
    t.push_back(sample.time_h);
    radius.push_back(sample.row.radius_um);
  }
  f.radius = testing::fit_line(t, radius);
  f.volume_slope_um3 = testing::fit_line(log_n, volume).slope;
  measure_end(simulator.colony(), f);
  return f;
}

// Two threads take seeds in turn; every colony has its own slot, so the figures do not depend on who was first.
const std::vector<Figures>& all_figures() {
  static const std::vector<Figures> figures = [] {
    std::vector<Figures> made(testing::scaled<std::size_t>(20, 40));
    const std::uint64_t cells = testing::scaled<std::uint64_t>(200, 500);
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      for (std::size_t i = next++; i < made.size(); i = next++) made[i] = grow(static_cast<Seed>(i + 1), cells);
    };
    std::thread other(work);
    work();
    other.join();
    return made;
  }();
  return figures;
}

testing::Mean over_seeds(double (*figure)(const Figures&)) {
  std::vector<double> values;
  for (const Figures& f : all_figures()) values.push_back(figure(f));
  return testing::mean_of(values);
}

// One test, because the colonies are grown once a process.
TEST(Growth, IsExponentialThenLimitedByContactWithSmallPassiveCellsInTheMiddleOfOneLayer) {
  std::printf(
      "seed  12 cells h  doubling h  end h  R um  um/h    R2   active  r active  r passive  V centre  V edge  V 8 "
      "cells  V end  searches/division  least distance um\n");
  for (const Figures& f : all_figures()) {
    std::printf(
        "%4u  %10.1f  %10.2f  %5.0f  %4.0f  %.3f  %.3f  %6.2f  %8.2f  %9.2f  %8.0f  %6.0f  %9.0f  %5.0f  %17.2f  "
        "%17.2f\n",
        static_cast<unsigned>(f.seed), f.time_12_h, f.doubling_h, f.time_end_h, f.radius_end_um, f.radius.slope,
        f.radius.r2, f.active_share, f.active_radial, f.passive_radial, f.centre_volume_um3, f.edge_volume_um3,
        f.volume_early_um3, f.volume_end_um3, f.searches_per_division, f.centre_distance_min_um);
  }
  const auto print = [](const char* name, const testing::Mean& mean) {
    std::printf("figure: %-42s %9.3f +- %.3f (%zu seeds)\n", name, mean.value, mean.se, all_figures().size());
  };
  const testing::Mean doubling = over_seeds([](const Figures& f) { return f.doubling_h; });
  const testing::Mean speed = over_seeds([](const Figures& f) { return f.radius.slope; });
  const testing::Mean rim = over_seeds([](const Figures& f) { return f.active_radial - f.passive_radial; });
  const testing::Mean size = over_seeds([](const Figures& f) { return f.edge_volume_um3 - f.centre_volume_um3; });
  const testing::Mean volume = over_seeds([](const Figures& f) { return f.volume_slope_um3; });
  const testing::Mean fall = over_seeds([](const Figures& f) { return f.volume_early_um3 - f.volume_end_um3; });
  const testing::Mean searches = over_seeds([](const Figures& f) { return f.searches_per_division; });
  const testing::Mean active = over_seeds([](const Figures& f) { return f.active_share; });
  print("doubling while N <= 12, h", doubling);
  print("radius, um/h, from 40 cells on", speed);
  print("R of active less R of passive, of radius", rim);
  print("volume at the edge less in the centre, um3", size);
  print("mean volume on ln N, um3", volume);
  print("mean volume at 8 cells less at the end", fall);
  print("searches per division", searches);
  print("share active at the end", active);

  EXPECT_NEAR(doubling.value, 12.0, 1.5);
  EXPECT_GT(speed.value, 0.25);
  EXPECT_LT(speed.value, 0.60);
  EXPECT_GT(rim.value, 3.0 * rim.se);
  EXPECT_GT(size.value, 3.0 * size.se);
  EXPECT_LT(volume.value, -3.0 * volume.se);
  EXPECT_GT(fall.value, 0.0);  // eight cells differ much: over seeds, not in each; the slope above is the test
  EXPECT_LT(searches.value, 5.0);
  for (const Figures& f : all_figures()) {
    EXPECT_GT(f.radius.r2, 0.95) << "seed " << f.seed;
    EXPECT_GT(f.active_radial, f.passive_radial) << "seed " << f.seed;
    EXPECT_EQ(f.above_dish_count, 0U) << "seed " << f.seed;
    EXPECT_GT(f.active_share, 0.02) << "seed " << f.seed;
    EXPECT_LT(f.active_share, 0.6) << "seed " << f.seed;
  }
}

// Preset paper has no other end than the Hayflick limit: rim lineages divide nearly every cycle while the rim advances by less than a
// cell, so the colony ends far below 2^40 cells. Reduced: a limit of 10 divisions; full: the preset's 40.
TEST(Growth, OfALoneColonyIsEndedByTheGenerationLimit) {
  const std::int64_t limit = testing::scaled<std::int64_t>(10, 40);
  std::vector<double> sizes, times;
  const Seed seeds = testing::scaled<Seed>(3, 40);
  for (Seed seed = 1; seed <= seeds; ++seed) {
    RunSpec spec;
    spec.seed = seed;
    spec.params.division.generation_limit = limit;
    Simulator simulator(spec);
    while (simulator.step()) {
    }
    const Colony& colony = simulator.colony();
    const FinishReason reason = colony.finished()->reason;
    EXPECT_TRUE(reason == FinishReason::kExhausted || reason == FinishReason::kAllSenescent) << "seed " << seed;
    EXPECT_EQ(colony.count(Activity::kActive), 0U) << "seed " << seed;
    for (const Cell& cell : colony.cells()) {
      ASSERT_LE(cell.generation, limit);
      ASSERT_EQ(cell.activity == Activity::kSenescent && cell.generation < limit, false);
    }
    sizes.push_back(static_cast<double>(colony.cells().size()));
    times.push_back(colony.time_h());
  }
  const testing::Mean size = testing::mean_of(sizes);
  const testing::Mean time = testing::mean_of(times);
  std::printf("figure: a lone colony of limit %d ends at %.0f +- %.0f cells after %.0f +- %.0f h (%d seeds)\n",
              static_cast<int>(limit), size.value, size.se, time.value, time.se, static_cast<int>(seeds));
  // Between no more than a rim that never widens and a colony that doubles every generation to confluence of the same radius.
  EXPECT_GT(size.value, 0.4 * static_cast<double>(limit * limit));
  EXPECT_LT(size.value, 1.2 * static_cast<double>(limit * limit));
}

}  // namespace
}  // namespace colony
