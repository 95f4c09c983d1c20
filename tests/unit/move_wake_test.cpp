// Moves and everything around them: whom a move wakes, what it reads and writes, how a colony that crawls ends.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/growth/chromosome.hpp"
#include "engine/growth/surroundings.hpp"
#include "engine/sim/decide_move.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/moves.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

TEST(MoveWaking, ASleeperThatCrawlsIntoTheOpenWakesItself) {
  const Params params = testing::crawling(0.1, 1.0);
  std::vector<Cell> cells = testing::ring(3, 9.5);
  cells.resize(3);
  const double share = free_share(testing::found(params, cells), params, 1, cells[0], 0, {});
  int woke = 0, made = 0;
  for (Seed seed = 0; seed < 60; ++seed) {
    std::vector<Cell> sleeping = cells;
    sleeping[0] = testing::asleep(cells[0], share - 0.05);
    const Colony colony = testing::found(params, sleeping);
    const Moved moved = testing::move_of(colony, params, seed, CellId{1}, 10.0);
    if (moved.cell.centre_um == colony.cell(CellId{1}).centre_um) {
      EXPECT_FALSE(moved.cell.due_h);
      continue;
    }
    ++made;
    if (!moved.cell.due_h) continue;
    ++woke;
    EXPECT_EQ(*moved.cell.due_h, 10.0 + params.wake.retry_h);
    EXPECT_EQ(moved.cell.try_count, 0);
    EXPECT_EQ(moved.cell.activity, Activity::kPassive);
    EXPECT_GE(*moved.cell.free_share, share - 0.05 + params.wake.gain);
  }
  EXPECT_GT(made, 30);
  EXPECT_GT(woke, made * 9 / 10);  // away from both neighbours the share only grows
}

TEST(MoveWaking, ASleeperThatCannotMoveKeepsItsGrowthSoFarThroughEveryChangeOfPoints) {
  const Params params = testing::crawling();
  std::vector<Cell> cells = testing::ring(5, 9.2);
  cells[0] = testing::asleep(cells[0], 0.40);
  cells[0].move_due_h = 0.0;
  Colony colony = testing::found(params, cells);
  const auto growth = [&] {
    const Cell& cell = colony.cell(CellId{1});
    return free_share(colony, params, 9, cell, cell.ordinal, {}) - *cell.free_share;
  };
  const double before = growth();
  int refused = 0;
  for (int k = 0; k < 60; ++k) {
    Event event;
    event.seq = colony.last_seq() + 1;
    event.time_h = 1.0 + k;
    event.cell_id = CellId{1};
    event.body = testing::move_of(colony, params, 9, CellId{1}, event.time_h);
    if (std::get<Moved>(event.body).cell.centre_um != colony.cell(CellId{1}).centre_um) continue;
    ++refused;
    canonicalise(event);
    event.digest = digest_after(colony.digest(), event);
    colony.apply(event);
    ASSERT_FALSE(colony.cell(CellId{1}).due_h);
    ASSERT_EQ(growth(), before) << k;  // multiples of 1/512: exact
  }
  EXPECT_GT(refused, 30);
}

TEST(MoveReach, NothingBeyondTheStatedDistanceIsReadOrWritten) {
  Params params = testing::crawling(0.1, 0.8);
  params.wake.gain = 0.0;
  params.contact.fitness_min = 0.0;  // every move is made: the more to be read
  params.motility.step_um = 9.0;
  // The largest cell that a division can make, across the axes in turn: the bound must hold for it.
  const double volume = params.cell.pair_volume_um3.high * (1.0 - params.cell.smaller_share.low);
  const Vec3 largest = semiaxes_um(volume, params.cell.elongation.high, params.cell.flatness.low);
  const double reach = move_read_reach_um(params), wake = move_wake_reach_um(params);
  ASSERT_LT(move_body_reach_um(params), wake);
  ASSERT_LT(wake, reach);
  int woken = 0, made = 0, beyond = 0;
  for (std::uint32_t scene = 0; scene < testing::scaled<std::uint32_t>(400, 4000); ++scene) {
    std::vector<Cell> cells = testing::scattered_cells(260, 260.0, scene + 1);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i % 2 == 0) cells[i] = testing::asleep(cells[i], 0.3);
    }
    const CellId id{1};
    cells[0] = testing::cell_at(0.0, 0.0, largest);
    cells[0].rotation_rad = Vec3(0.0, 0.0, scene % 2 == 0 ? 0.0 : 0.5 * maths::kPi);
    const Colony colony = testing::found(params, cells);
    const Vec3 c = colony.cell(id).centre_um;
    const Box square = {c - Vec3(reach, reach, 1e3), c + Vec3(reach, reach, 1e3)};
    // All that lies beyond the reach goes elsewhere: the decision must not change.
    for (const Cell& cell : colony.cells()) {
      if (meets(colony.body(cell.id).box(), square)) continue;
      ++beyond;
      cells[cell.id.value - 1].centre_um += Vec3(5000.0 + 31.0 * cell.id.value, 0.0, 0.0);
      cells[cell.id.value - 1].nucleus_um = cells[cell.id.value - 1].centre_um;
    }
    const Moved moved = testing::move_of(colony, params, scene, id);
    ASSERT_EQ(moved, testing::move_of(testing::found(params, cells), params, scene, id)) << "scene " << scene;
    if (moved.cell.centre_um != c) ++made;
    for (const Box& box : {colony.body(id).box(), Body(geometry_of(moved.cell), params.noise).box()}) {
      for (int axis = 0; axis < 2; ++axis) {
        ASSERT_LE(box.high[axis] - c[axis], move_body_reach_um(params));
        ASSERT_LE(c[axis] - box.low[axis], move_body_reach_um(params));
      }
    }
    for (const Woken& one : moved.woken) {
      ++woken;
      const Vec3 apart = colony.cell(one.cell_id).centre_um - c;
      ASSERT_LE(std::max(std::abs(apart.x()), std::abs(apart.y())), wake);
    }
  }
  EXPECT_GT(made, 300);
  EXPECT_GT(woken, 300);
  EXPECT_GT(beyond, 10'000);
}

TEST(MoveEnd, AColonyOfSenescentCellsIsOverThoughTheyCouldCrawl) {
  RunSpec spec = testing::spec_of(4, 100'000, testing::crawling());
  spec.params.division.generation_limit = 3;
  const testing::Run run = testing::run(spec);  // no bound in time: it must end by itself
  EXPECT_EQ(run.finished().reason, FinishReason::kAllSenescent);
  EXPECT_FALSE(run.simulator.agenda().empty());
}

TEST(MoveEnd, MovesGoOnToTheBoundInTimeWhereCellsOnlySleep) {
  RunSpec spec = testing::spec_of(3, 100, testing::crawling());
  spec.params.contact.fitness_min = 1.0;  // the pair always overlaps itself: nobody ever divides
  spec.params.contact.fitness_good = 1.0;
  spec.params.search.distance = {0.3, 0.3};
  spec.params.search.generations = 0;
  spec.params.search.corrector_generations = 0;
  spec.until.time_h = 400.0;
  const testing::Run run = testing::run(spec);
  EXPECT_EQ(run.finished().reason, FinishReason::kTime);
  EXPECT_GT(run.events.size(), 25U);
}

}  // namespace
}  // namespace colony
