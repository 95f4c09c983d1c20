#include "engine/analysis/series.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/founding.hpp"

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

}  // namespace
}  // namespace colony
