#include "engine/analysis/series.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/sim/simulator.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

using testing::ball_at;
using testing::found;
using testing::paper;
using testing::paper_without_noise;
using testing::scattered_cells;

/// The definition, point by point: centres of 1 um grid cells that lie in any footprint.
double brute_force_area_um2(const Colony& colony) {
  Box all = colony.body(CellId{1}).box();
  for (const Cell& cell : colony.cells()) {
    all.low = all.low.cwiseMin(colony.body(cell.id).box().low);
    all.high = all.high.cwiseMax(colony.body(cell.id).box().high);
  }
  double area_um2 = 0.0;
  for (double x = std::floor(all.low.x()) - 1.5; x < all.high.x() + 2.0; x += 1.0) {
    for (double y = std::floor(all.low.y()) - 1.5; y < all.high.y() + 2.0; y += 1.0) {
      for (const Cell& cell : colony.cells()) {
        if (!colony.body(cell.id).footprint_contains(x, y)) continue;
        area_um2 += 1.0;
        break;
      }
    }
  }
  return area_um2;
}

TEST(Series, NoCellsGiveZeros) {
  const SeriesRow row = measure_series(Colony(paper()), 7.5);
  EXPECT_EQ(row.time_h, 7.5);
  EXPECT_EQ(row.cell_count, 0u);
  EXPECT_EQ(row.volume_mean_um3, 0.0);
  EXPECT_EQ(row.volume_sd_um3, 0.0);
  EXPECT_EQ(row.area_um2, 0.0);
  EXPECT_EQ(row.radius_um, 0.0);
  EXPECT_EQ(row.density_per_mm2, 0.0);
}

TEST(Series, OneDiscHasItsAreaWithinTheGridsError) {
  for (const double radius_um : {3.0, 5.5, 8.0}) {
    const Colony colony = found(paper_without_noise(), {ball_at(0.3, -41.7, radius_um)});
    const SeriesRow row = measure_series(colony, 0.0);
    // Only grid cells that the rim crosses can be counted wrongly, and their errors mostly cancel.
    EXPECT_NEAR(row.area_um2, maths::kPi * radius_um * radius_um, 0.5 * maths::kPi * radius_um);
    EXPECT_EQ(row.radius_um, std::sqrt(row.area_um2 / maths::kPi));
    EXPECT_DOUBLE_EQ(row.density_per_mm2, 1e6 / row.area_um2);
  }
}

TEST(Series, AreaIsAUnionNotASum) {
  const Params params = paper_without_noise();
  const double one = measure_series(found(params, {ball_at(0.0, 0.0, 7.0)}), 0.0).area_um2;
  const double same = measure_series(found(params, {ball_at(0.0, 0.0, 7.0), ball_at(0.0, 0.0, 7.0)}), 0.0).area_um2;
  const double apart = measure_series(found(params, {ball_at(0.0, 0.0, 7.0), ball_at(40.0, 0.0, 7.0)}), 0.0).area_um2;
  const double overlapping =
      measure_series(found(params, {ball_at(0.0, 0.0, 7.0), ball_at(7.0, 0.0, 7.0)}), 0.0).area_um2;
  EXPECT_EQ(same, one);
  EXPECT_EQ(apart, 2.0 * one);  // by a whole number of grid cells
  // Two discs at distance d = R share 2 R^2 (pi/3 - sqrt(3)/4).
  EXPECT_NEAR(2.0 * one - overlapping, 2.0 * 49.0 * (maths::kPi / 3.0 - std::sqrt(3.0) / 4.0), 8.0);
}

TEST(Series, AreaEqualsBruteForce) {
  for (const Seed seed : {1u, 2u, 3u}) {
    const Colony crowded = found(paper(), scattered_cells(60, 70.0, seed));
    EXPECT_EQ(measure_series(crowded, 0.0).area_um2, brute_force_area_um2(crowded));
    const Colony sparse = found(paper(), scattered_cells(20, 300.0, seed));
    EXPECT_EQ(measure_series(sparse, 0.0).area_um2, brute_force_area_um2(sparse));
  }
}

TEST(Series, AreaDoesNotCareHowFarApartTheCellsLie) {
  const Params params = paper_without_noise();
  const double one = measure_series(found(params, {ball_at(0.0, 0.0, 7.0)}), 0.0).area_um2;
  const double far = 900'000'000.0;
  EXPECT_EQ(measure_series(found(params, {ball_at(-far, -far, 7.0), ball_at(far, far, 7.0)}), 0.0).area_um2, 2.0 * one);
}

TEST(Series, VolumesAndCounts) {
  std::vector<Cell> cells = {ball_at(0.0, 0.0, 5.0), ball_at(20.0, 0.0, 5.0), ball_at(40.0, 0.0, 5.0),
                             ball_at(60.0, 0.0, 5.0)};
  cells[0].volume_um3 = 400.0;
  cells[1].volume_um3 = 600.0;
  cells[2].volume_um3 = 800.0;
  cells[3].volume_um3 = 1000.0;
  cells[1].activity = Activity::kPassive;
  cells[2].activity = Activity::kPassive;
  cells[3].activity = Activity::kSenescent;
  const SeriesRow row = measure_series(found(paper_without_noise(), cells), 12.0);
  EXPECT_EQ(row.cell_count, 4u);
  EXPECT_EQ(row.active_count, 1u);
  EXPECT_EQ(row.passive_count, 2u);
  EXPECT_EQ(row.senescent_count, 1u);
  EXPECT_DOUBLE_EQ(row.volume_mean_um3, 700.0);
  EXPECT_DOUBLE_EQ(row.volume_sd_um3, std::sqrt(50000.0));  // of the population: (300^2 + 100^2) / 2
}

TEST(Series, SumsOfVolumesForgetNothingAndNoOrder) {
  VolumeSums sums;
  EXPECT_EQ(sums.mean_um3(), 0.0);
  EXPECT_EQ(sums.sd_um3(), 0.0);
  // In floating point the small ones would drown in the large, and leave a trace when they go.
  for (int i = 0; i < 1000; ++i) {
    sums.add(1.0 / 3.0);
    sums.add(16'000'000.0 + i);
  }
  for (int i = 999; i >= 0; --i) sums.remove(16'000'000.0 + i);
  VolumeSums small;
  for (int i = 0; i < 1000; ++i) small.add(1.0 / 3.0);
  EXPECT_EQ(sums.mean_um3(), small.mean_um3());
  EXPECT_NEAR(sums.mean_um3(), 1.0 / 3.0, 1.0 / 16'777'216.0);
  EXPECT_EQ(sums.sd_um3(), 0.0) << "all are equal";
  small.add(1.0 / 3.0 + 1.0 / 16'777'216.0);  // the least difference there is
  EXPECT_GT(small.sd_um3(), 0.0);
  EXPECT_THROW(small.add(-1.0), CheckFailure);
  EXPECT_THROW(small.add(16'777'216.0), CheckFailure);
  EXPECT_THROW(small.add(std::nan("")), CheckFailure);
}

TEST(Series, CoverageSurvivesAPileOfBodies) {
  Coverage coverage;
  const Body high(geometry_of(ball_at(-0.2, 15.9, 6.0)), paper().noise);
  const Body beside(geometry_of(ball_at(7.0, 15.0, 5.0)), paper().noise);
  coverage.add(high);
  const std::uint64_t one_um2 = coverage.area_um2();
  coverage.add(beside);
  const std::uint64_t both_um2 = coverage.area_um2();
  EXPECT_GT(both_um2, one_um2);
  for (int i = 0; i < 600; ++i) coverage.add(high);  // more than 8 bits hold
  EXPECT_EQ(coverage.area_um2(), both_um2);
  for (int i = 0; i < 600; ++i) coverage.remove(high);
  EXPECT_EQ(coverage.area_um2(), both_um2);
  coverage.remove(beside);
  EXPECT_EQ(coverage.area_um2(), one_um2);
  coverage.remove(high);
  EXPECT_EQ(coverage.area_um2(), 0u);
  EXPECT_EQ(coverage.tile_count(), 0u) << "memory follows the cells";
  EXPECT_THROW(coverage.remove(high), CheckFailure);
}

/// Row and definition, with every bit, at the colony's time.
void expect_follows(const SeriesTracker& tracker, const Colony& colony, const std::string& where) {
  EXPECT_EQ(tracker.row(colony.time_h()), measure_series(colony, colony.time_h())) << where;
}

RunSpec grown(Seed seed, std::int64_t founders, double radius_um, std::uint64_t cells) {
  RunSpec spec;
  spec.seed = seed;
  spec.params = paper();
  spec.params.founders.count = founders;
  spec.params.founders.radius_um = radius_um;
  spec.params.division.generation_limit = 7;  // senescence too
  // Speed matters here, and quality does not.
  spec.params.search.population = 8;
  spec.params.search.generations = 2;
  spec.params.search.points = 64;
  spec.params.search.points_final = 256;
  spec.until.cells = cells;
  return spec;
}

TEST(SeriesTracker, EqualsTheMeasurementAfterEveryEventOfARun) {
  const std::uint64_t cells = testing::scaled<std::uint64_t>(120, 400);
  for (const RunSpec& spec : {grown(1, 1, 500.0, cells), grown(2, 5, 60.0, cells), grown(3, 30, 2000.0, cells)}) {
    Simulator simulator(spec);
    SeriesTracker tracker(simulator.colony());
    Colony replayed(spec.params);
    SeriesTracker of_replay(replayed);
    while (const std::optional<Event> event = simulator.step()) {
      tracker.follow(*event, simulator.colony());
      replayed.apply(*event);
      of_replay.follow(*event, replayed);
      const std::string where = "seed " + std::to_string(spec.seed) + ", event " + std::to_string(event->seq);
      expect_follows(tracker, simulator.colony(), where);
      ASSERT_EQ(tracker.row(1.0), of_replay.row(1.0)) << where;
      if (event->seq % 50 != 0) continue;
      // One that starts here, as after a restart, knows the same.
      ASSERT_EQ(tracker.row(2.0), SeriesTracker(simulator.colony()).row(2.0)) << where;
    }
  }
}

TEST(SeriesTracker, FollowsCellsThatMove) {
  Colony colony = found(paper(), scattered_cells(40, 80.0, 9));
  SeriesTracker tracker(colony);
  Stream stream(4, CellId{1}, 0, Purpose::kFounder);
  for (int i = 0; i < 200; ++i) {
    Moved moved;
    moved.cell = colony.cells()[static_cast<std::size_t>(stream.uniform({0.0, 39.99}))];
    ++moved.cell.ordinal;
    for (int axis = 0; axis < 2; ++axis) moved.cell.centre_um[axis] += stream.uniform({-30.0, 30.0});
    Event event;
    event.seq = colony.last_seq() + 1;
    event.cell_id = moved.cell.id;
    event.body = moved;
    canonicalise(event);
    event.digest = digest_after(colony.digest(), event);
    colony.apply(event);
    tracker.follow(event, colony);
    expect_follows(tracker, colony, "move " + std::to_string(i));
  }
  Event event;
  event.seq = colony.last_seq() + 2;
  EXPECT_THROW(tracker.follow(event, colony), CheckFailure) << "an event that was not seen before";
}

TEST(SeriesTracker, KeepsLittleForCellsThatLieFarApart) {
  Coverage coverage;
  for (int i = 0; i < 100; ++i) {
    coverage.add(Body(geometry_of(ball_at(1000.0 * i, -777.7 * i, 8.0)), paper().noise));
  }
  EXPECT_LE(coverage.tile_count(), 900u);
}

}  // namespace
}  // namespace colony
