// One move at a time: when it comes, where it leads, and when it is not made.
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/sim/decide_move.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/moves.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

TEST(MoveDelay, IsAFixedRestAndAnExponentialTimeOfMeanOneOverTheRate) {
  for (const double rate : {0.02, 0.1, 0.5, 2.0}) {
    MotilityParams motility;
    motility.rate_per_h = rate;
    const double least = move_delay_min_h(motility);
    EXPECT_DOUBLE_EQ(least, std::min(1.0, 0.5 / rate));  // the default window fits every rate up to 0.5
    constexpr int kDraws = 100'000, kBins = 25;
    std::vector<double> counts(kBins), delays;
    for (int i = 0; i < kDraws; ++i) {
      Stream stream(11, CellId{static_cast<std::uint32_t>(i + 1)}, 3, Purpose::kMoveDelay);
      const double delay = draw_move_delay_h(motility, stream);
      ASSERT_GE(delay, least);
      delays.push_back(delay);
      const double cdf = 1.0 - std::exp(-(delay - least) / (1.0 / rate - least));
      ++counts[std::min(kBins - 1, static_cast<int>(cdf * kBins))];
    }
    const testing::Mean mean = testing::mean_of(delays);
    EXPECT_NEAR(mean.value, 1.0 / rate, 5.0 * mean.se) << "rate " << rate;
    EXPECT_LT(testing::chi_square_uniform(counts), testing::chi_square_bound(kBins - 1)) << "rate " << rate;
  }
  Stream stream(1, CellId{1}, 0, Purpose::kMoveDelay);
  EXPECT_THROW(draw_move_delay_h(MotilityParams{}, stream), CheckFailure);
}

TEST(MoveDelay, DueTimesAreGivenAtFoundingAtDivisionAndByEveryMoveAndOnlyWithARate) {
  RunSpec spec = testing::spec_of(2, 60, testing::crawling());
  const double least = move_delay_min_h(spec.params.motility);
  Colony before(spec.params);
  std::vector<double> first;
  for (const Event& event : testing::run(spec).events) {
    if (const auto* founded = std::get_if<Founded>(&event.body)) {
      ASSERT_TRUE(founded->cell.move_due_h);
      EXPECT_GE(*founded->cell.move_due_h, least);
    } else if (const auto* moved = std::get_if<Moved>(&event.body)) {
      EXPECT_EQ(before.cell(*event.cell_id).move_due_h, event.time_h);
      EXPECT_GE(*moved->cell.move_due_h, event.time_h + least);
    } else if (const auto* divided = std::get_if<Divided>(&event.body)) {
      // The mother's next move stays: an event takes nothing out of a window.
      EXPECT_EQ(divided->cells[0].move_due_h, before.cell(*event.cell_id).move_due_h);
      EXPECT_GE(*divided->cells[1].move_due_h, event.time_h + least);
      first.push_back(*divided->cells[1].move_due_h - event.time_h);
    }
    before.apply(event);
  }
  const testing::Mean mean = testing::mean_of(first);
  EXPECT_NEAR(mean.value, 10.0, 4.0 * mean.se);
  for (const Event& event : testing::run(testing::spec_of(2, 8)).events) {
    if (const auto* divided = std::get_if<Divided>(&event.body)) {
      EXPECT_FALSE(divided->cells[0].move_due_h || divided->cells[1].move_due_h);
    }
    EXPECT_NE(event.kind(), EventKind::kMoved);
  }
}

// Angle of a made move from the x axis; NaN where none was made.
double angle_of(const Moved& moved, const Cell& before) {
  const Vec3 step = moved.cell.centre_um - before.centre_um;
  return step.isZero() ? std::nan("") : std::atan2(step.y(), step.x());
}

TEST(MoveDirection, IsUniformForAnIsolatedCellWhateverTheBias) {
  for (const double bias : {0.0, 0.5, 1.0}) {
    const Params params = testing::crawling(0.1, bias);
    const Colony colony = testing::found(params, {testing::ball_at(3.0, -40.0, 5.0), testing::ball_at(80.0, 0.0, 5.0)});
    std::vector<double> sectors(24);
    for (Seed seed = 0; seed < 12'000; ++seed) {
      const double angle = angle_of(testing::move_of(colony, params, seed, CellId{1}), colony.cell(CellId{1}));
      ++sectors[std::min<std::size_t>(23, static_cast<std::size_t>((angle / (2.0 * maths::kPi) + 0.5) * 24.0))];
    }
    EXPECT_LT(testing::chi_square_uniform(sectors), testing::chi_square_bound(23)) << "bias " << bias;
  }
}

TEST(MoveDirection, LeadsToTheFreerHalfWithTheProbabilityOfTheBiasAndACosineThere) {
  for (const double bias : {0.0, 0.5, 1.0}) {
    const Params params = testing::crawling(0.1, bias);
    // The neighbour, at 60 degrees, lies in the surroundings but out of reach of a step.
    const Vec2 towards(0.5, std::sqrt(0.75));
    const Colony colony = testing::found(
        params, {testing::ball_at(0.0, 0.0, 5.0), testing::ball_at(16.0 * towards.x(), 16.0 * towards.y(), 5.0)});
    std::vector<double> away, guided_sines(10);
    constexpr int kDraws = 6000;
    for (Seed seed = 0; seed < kDraws; ++seed) {
      const Vec2 step = testing::move_of(colony, params, seed, CellId{1}).cell.centre_um.head<2>() / params.motility.step_um;
      ASSERT_NEAR(step.norm(), 1.0, 1e-9);
      away.push_back(-step.dot(towards));
      const double sine = step.x() * towards.y() - step.y() * towards.x();
      ++guided_sines[std::min<std::size_t>(9, static_cast<std::size_t>((sine + 1.0) * 5.0))];
    }
    double count = 0.0;
    for (const double cosine : away) count += cosine > 0.0 ? 1.0 : 0.0;
    EXPECT_NEAR(count / kDraws, 0.5 + 0.5 * bias, 0.02) << "bias " << bias;  // three standard errors
    // Uniform directions have mean cosine 0; density cos / 2 on the half has pi / 4.
    const testing::Mean mean = testing::mean_of(away);
    EXPECT_NEAR(mean.value, bias * maths::kPi / 4.0, 4.0 * mean.se + 0.005) << "bias " << bias;
    if (bias == 1.0) {  // the estimated half turns about the true one by a few degrees: only the outer bins feel it
      std::vector<double> inner(guided_sines.begin() + 1, guided_sines.end() - 1);
      EXPECT_LT(testing::chi_square_uniform(inner), testing::chi_square_bound(7));
    }
  }
}

TEST(MoveDirection, TheDishWallCountsAsCovered) {
  Params params = testing::crawling(0.1, 1.0);
  params.dish.radius_um = 100.0;
  const Colony colony = testing::found(params, {testing::ball_at(0.0, 88.0, 5.0)});
  for (Seed seed = 0; seed < 500; ++seed) {
    const Cell& before = colony.cell(CellId{1});
    const Moved moved = testing::move_of(colony, params, seed, CellId{1});
    ASSERT_LT(moved.cell.centre_um.y() - before.centre_um.y(), 0.6) << seed;  // 11 degrees of error of the estimate
  }
}

TEST(Move, ShiftsTheBodyRigidlyAndKeepsAllElse) {
  const Params params = testing::crawling();
  std::vector<Cell> cells = testing::scattered_cells(1, 10.0, 5);
  cells[0].nearest_membrane_um = Vec3(cells[0].centre_um + Vec3(4.0, -1.0, 0.2));
  cells[0].deformed_volume_um3 = 300.0;
  cells[0].due_h = 12.5;
  cells[0].ordinal = 7;
  cells[0].move_due_h = 10.0;
  const Colony colony = testing::found(params, cells);
  const Cell& before = colony.cell(CellId{1});
  const Moved moved = testing::move_of(colony, params, 3, CellId{1});
  const Vec3 step = moved.cell.centre_um - before.centre_um;
  EXPECT_NEAR(step.norm(), params.motility.step_um, 1e-9);
  EXPECT_EQ(moved.cell.centre_um.z(), before.centre_um.z());
  EXPECT_TRUE((moved.cell.nucleus_um - before.nucleus_um - step).isZero(1e-9));
  EXPECT_TRUE((*moved.cell.nearest_membrane_um - *before.nearest_membrane_um - step).isZero(1e-9));
  Cell expected = before;
  expected.centre_um = moved.cell.centre_um;
  expected.nucleus_um = moved.cell.nucleus_um;
  expected.nearest_membrane_um = moved.cell.nearest_membrane_um;
  expected.move_due_h = moved.cell.move_due_h;
  expected.ordinal = 8;
  EXPECT_EQ(moved.cell, expected);
  EXPECT_TRUE(moved.woken.empty());
}

TEST(Move, IsNotMadeByAnEnclosedCellButIsAFactAllTheSame) {
  const Params params = testing::crawling();
  const Colony colony = testing::found(params, testing::ring(6, 9.2));
  int made = 0;
  for (Seed seed = 0; seed < 300; ++seed) {
    const Moved moved = testing::move_of(colony, params, seed, CellId{1});
    Cell expected = colony.cell(CellId{1});
    expected.ordinal += 1;
    expected.move_due_h = moved.cell.move_due_h;
    if (!(moved.cell == expected)) ++made;
    EXPECT_TRUE(moved.woken.empty());
  }
  EXPECT_EQ(made, 0);
}

TEST(Move, NeverCrossesTheWallEvenWhereFitnessIsNotAsked) {
  Params params = testing::crawling(0.1, 0.0);
  params.contact.fitness_min = 0.0;
  params.dish.radius_um = 50.0;
  const Colony colony = testing::found(params, {testing::ball_at(44.0, 0.0, 5.0)});
  int made = 0, refused = 0;
  for (Seed seed = 0; seed < 400; ++seed) {
    const Moved moved = testing::move_of(colony, params, seed, CellId{1});
    (moved.cell.centre_um == colony.cell(CellId{1}).centre_um ? refused : made) += 1;
    const Body body(geometry_of(moved.cell), params.noise);
    const OverlapCounts counts = count_overlaps_reference(body, {}, params.dish.radius_um, testing::points(4096, 1));
    // Seen by points: a sliver thinner than their distance may pass.
    ASSERT_LE(counts.outside_wall_count, counts.hit_count / 200) << seed;
  }
  EXPECT_GT(made, 100);
  EXPECT_GT(refused, 100);
}

TEST(Move, NoneOfACrowdedColonyEndsBelowTheLeastFitness) {
  RunSpec spec = testing::spec_of(6, testing::scaled(70, 200), testing::crawling(0.5));
  spec.params.dish.radius_um = 60.0;
  spec.until.time_h = 200.0;
  Colony before(spec.params), after(spec.params);
  int made = 0, refused = 0;
  for (const Event& event : testing::run(spec).events) {
    after.apply(event);
    if (event.kind() == EventKind::kMoved) {
      const CellId id = *event.cell_id;
      if (after.cell(id).centre_um == before.cell(id).centre_um) {
        ++refused;
      } else {
        ++made;
        const OverlapCounts counts = count_overlaps_reference(after.body(id), testing::neighbours_of(after, id),
                                                              spec.params.dish.radius_um, testing::points(4096, event.cell_id->value));
        // Fresh points: three standard errors of a share of about 3,000 hits.
        ASSERT_GE(1.0 - static_cast<double>(std::accumulate(counts.shared_counts.begin(), counts.shared_counts.end(), 0U)) / counts.hit_count,
                  spec.params.contact.fitness_min - 0.03)
            << "seq " << event.seq;
        ASSERT_LE(counts.outside_wall_count, counts.hit_count / 200) << "seq " << event.seq;
      }
    }
    before.apply(event);
  }
  EXPECT_GT(made, 300);
  EXPECT_GT(refused, 100);
}

TEST(Move, OfAnIsolatedCellIsARandomWalk) {
  Params params = testing::crawling();
  params.cycle = {CycleDistribution::kNormal, 200.0, 0.0, 0.0, 0.0};
  RunSpec spec;
  spec.params = params;
  spec.until.time_h = 150.0;
  std::vector<double> squares, counts;
  for (Seed seed = 0; seed < testing::scaled<Seed>(1500, 10'000); ++seed) {
    spec.seed = seed;
    const testing::Run run = testing::run(spec);
    ASSERT_EQ(run.colony().cells().size(), 1U);
    squares.push_back(run.colony().cell(CellId{1}).centre_um.head<2>().squaredNorm());
    counts.push_back(static_cast<double>(run.events.size() - 3));  // founded, settled, finished
  }
  // Renewal theory: mean count = t / mean + (variation^2 - 1) / 2, variation = (mean - rest) / mean = 0.9.
  const double expected = 15.0 + (0.81 - 1.0) / 2.0;
  const testing::Mean count = testing::mean_of(counts), square = testing::mean_of(squares);
  EXPECT_NEAR(count.value, expected, 4.0 * count.se);
  EXPECT_NEAR(square.value, 9.0 * expected, 4.0 * square.se);
  std::printf("figure: mean squared displacement of an isolated cell in 150 h: %.1f +- %.1f um2 (rate step2 t = %.1f)\n",
              square.value, square.se, 9.0 * 15.0);
}

}  // namespace
}  // namespace colony
