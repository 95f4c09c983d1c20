// The rules of reproduction, seen in the histories that the simulator writes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/growth/surroundings.hpp"
#include "engine/model/cycle.hpp"
#include "engine/sim/simulator.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

// Grown once: 80 cells with some failed searches, and what was there at each event.
const testing::Run& grown() {
  static const testing::Run run = testing::run(testing::spec_of(5, 80));
  return run;
}

TEST(Rules, GenerationLimitGivesAtMostTwoToTheLimitAndEndsAllSenescent) {
  for (std::int64_t limit = 1; limit <= 6; ++limit) {
    for (const bool inhibition : {false, true}) {
      RunSpec spec = testing::spec_of(static_cast<Seed>(limit), 1000);
      spec.params.division.generation_limit = limit;
      spec.params.division.inhibition = inhibition;
      const testing::Run run = testing::run(spec);
      const std::uint64_t most = std::uint64_t{1} << limit;
      if (!inhibition) {
        EXPECT_EQ(run.colony().cells().size(), most) << testing::name_of_run(spec);
        EXPECT_EQ(run.finished().reason, FinishReason::kAllSenescent);
      }
      EXPECT_LE(run.colony().cells().size(), most) << testing::name_of_run(spec);
      const bool all = run.colony().count(Activity::kSenescent) == run.colony().cells().size();
      EXPECT_EQ(run.finished().reason, all ? FinishReason::kAllSenescent : FinishReason::kExhausted)
          << testing::name_of_run(spec);
      for (const Cell& cell : run.colony().cells()) {
        EXPECT_LE(cell.generation, limit);
        EXPECT_EQ(cell.activity == Activity::kSenescent, cell.generation == limit && !cell.due_h);
      }
    }
  }
}

TEST(Rules, InhibitionOffAcceptsTheBestCandidateWhateverItsFitness) {
  RunSpec spec = testing::spec_of(2, 80);
  spec.params.division.inhibition = false;
  const testing::Run run = testing::run(spec);
  double least = 1.0;
  for (const Event& event : run.events) {
    EXPECT_NE(event.kind(), EventKind::kInhibited);
    if (const auto* divided = std::get_if<Divided>(&event.body)) least = std::min(least, divided->fitness);
  }
  EXPECT_EQ(run.colony().count(Activity::kPassive), 0U);
  EXPECT_LT(least, spec.params.contact.fitness_min);
}

TEST(Rules, EveryDivisionKeepsTheConditionsOfTheModel) {
  const RunSpec& spec = grown().simulator.spec();
  Colony before(spec.params);
  int divisions = 0, inhibitions = 0;
  for (const Event& event : grown().events) {
    if (const auto* divided = std::get_if<Divided>(&event.body)) {
      ++divisions;
      const Cell& parent = before.cell(*event.cell_id);
      const Cell &own = divided->cells[0], &daughter = divided->cells[1];
      EXPECT_GE(divided->fitness, spec.params.contact.fitness_min);
      EXPECT_EQ(own.id, parent.id);
      EXPECT_EQ(own.parent_id, parent.parent_id);
      EXPECT_EQ(daughter.parent_id, parent.id);
      EXPECT_EQ(daughter.id.value, before.cells().size() + 1);
      EXPECT_EQ(own.generation, parent.generation + 1);
      EXPECT_EQ(daughter.generation, parent.generation + 1);
      EXPECT_EQ(daughter.ordinal, 0U);
      const double v0 = testing::ellipsoid_volume_um3(own.semiaxes_um),
                   v1 = testing::ellipsoid_volume_um3(daughter.semiaxes_um);
      EXPECT_GE(v0, v1 * (1 - 1e-9));  // the larger share keeps the id
      EXPECT_GE(v1 / (v0 + v1), 0.40 - 1e-9);
      EXPECT_GE(v0 + v1, 800.0 - 1e-6);  // of the uncut ellipsoids
      EXPECT_LE(v0 + v1, 3600.0 + 1e-6);
      EXPECT_LT((own.centre_um - divided->plane_point_um).dot(divided->direction), 0.0);
      EXPECT_GT((daughter.centre_um - divided->plane_point_um).dot(divided->direction), 0.0);
      EXPECT_EQ(divided->plane_point_um, parent.nucleus_um);
      for (const Cell* cell : {&own, &daughter}) {
        EXPECT_EQ(cell->nucleus_radius_um, parent.nucleus_radius_um);
        EXPECT_EQ(cell->born_h, event.time_h);
        EXPECT_EQ(*cell->settle_due_h, event.time_h + 2.0);
        EXPECT_GE(*cell->due_h - event.time_h, 6.0 - 1e-9);
        EXPECT_LE(*cell->due_h - event.time_h, 18.0 + 1e-9);
        EXPECT_DOUBLE_EQ(cell->centre_um.z(), 0.55 * cell->semiaxes_um.z());
        EXPECT_EQ(cell->volume_um3,
                  volume_above_dish_um3({cell->centre_um, cell->semiaxes_um, cell->rotation_rad, cell->noise_offset}));
      }
    } else if (const auto* inhibited = std::get_if<Inhibited>(&event.body)) {
      ++inhibitions;
      EXPECT_LT(inhibited->fitness, spec.params.contact.fitness_min);
      EXPECT_EQ(inhibited->try_count, before.cell(*event.cell_id).try_count + 1);
      const bool room =
          inhibited->free_share > spec.params.wake.free_min && inhibited->try_count <= spec.params.wake.tries_max;
      EXPECT_EQ(inhibited->due_h.has_value(), room);
    }
    before.apply(event);
  }
  EXPECT_EQ(divisions, 79);
  EXPECT_GT(inhibitions, 20);
}

TEST(Rules, PairVolumesAndSharesOfManyDivisionsSpanTheirRanges) {
  double least = 1e9, most = 0.0;
  for (const Event& event : grown().events) {
    const auto* divided = std::get_if<Divided>(&event.body);
    if (divided == nullptr) continue;
    const double v = testing::ellipsoid_volume_um3(divided->cells[0].semiaxes_um) +
                     testing::ellipsoid_volume_um3(divided->cells[1].semiaxes_um);
    least = std::min(least, v);
    most = std::max(most, v);
  }
  EXPECT_LT(least, 1000.0);
  EXPECT_GT(most, 2000.0);
}

TEST(Nucleus, SettlesInsideItsDeformedCellAtTheCentreOfMass) {
  const RunSpec& spec = grown().simulator.spec();
  Colony colony(spec.params);
  std::vector<double> distances, volume_ratios;
  int outside = 0, membrane_inside = 0;
  for (const Event& event : grown().events) {
    colony.apply(event);
    const auto* settled = std::get_if<Settled>(&event.body);
    if (settled == nullptr) continue;
    const CellId id = *event.cell_id;
    const Body& body = colony.body(id);
    const std::vector<const Body*> near = testing::neighbours_of(colony, id);
    outside += deformed_field(body, near, spec.params.contact.rule, settled->nucleus_um) >= 0.0 ? 0 : 1;
    membrane_inside +=
        deformed_field(body, near, spec.params.contact.rule, settled->nearest_membrane_um) >= 0.0 ? 1 : 0;
    // Midpoints of a regular lattice: nothing in common with the engine's points.
    const int side = 22;
    const Vec3 step = (body.box().high - body.box().low) / side;
    Vec3 sum = Vec3::Zero();
    int hits = 0;
    for (int i = 0; i < side * side * side; ++i) {
      const Vec3 cell(i % side + 0.5, (i / side) % side + 0.5, i / (side * side) + 0.5);
      const Vec3 p = body.box().low + step.cwiseProduct(cell);
      if (deformed_field(body, near, spec.params.contact.rule, p) < 0.0) continue;
      sum += p;
      ++hits;
    }
    ASSERT_GT(hits, 0);
    distances.push_back((settled->nucleus_um - sum / hits).norm());
    volume_ratios.push_back(settled->deformed_volume_um3 / (hits * step.prod()));
  }
  ASSERT_GT(distances.size(), 100U);
  const double worst = *std::max_element(distances.begin(), distances.end());
  const testing::Mean mean = testing::mean_of(distances), ratio = testing::mean_of(volume_ratios);
  std::printf(
      "%zu settled nuclei: %d outside f~; distance from the lattice's centre of mass %.3f +- %.3f um, worst %.3f; "
      "volume ratio %.4f +- %.4f\n",
      distances.size(), outside, mean.value, mean.se, worst, ratio.value, ratio.se);
  EXPECT_EQ(membrane_inside, 0);
  EXPECT_LE(outside,
            static_cast<int>(distances.size() / 50));  // a bay pressed into the middle puts the centre of mass outside
  EXPECT_LT(mean.value, 0.1);
  EXPECT_LT(worst, 0.4);
  EXPECT_NEAR(ratio.value, 1.0, 0.005);
}

TEST(Isolation, LoneCellsDivideInUniformDirections) {
  RunSpec spec = testing::spec_of(9, 100'000);
  const int side = testing::scaled(16, 40);
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) spec.params.founders.positions_um.emplace_back(150.0 * i, 150.0 * j);
  }
  spec.params.division.generation_limit = 1;
  spec.params.search.turn_max_deg = 0.0;
  const testing::Run run = testing::run(spec);
  std::vector<double> bins(12, 0.0);
  for (const Event& event : run.events) {
    const auto* divided = std::get_if<Divided>(&event.body);
    if (divided == nullptr) continue;
    EXPECT_EQ(divided->plane_normal.z(), 0.0);
    EXPECT_NEAR(divided->plane_normal.norm(), 1.0, 1e-12);
    const double angle = std::atan2(divided->plane_normal.y(), divided->plane_normal.x()) + maths::kPi;
    bins[std::min<std::size_t>(11, static_cast<std::size_t>(angle / (2.0 * maths::kPi) * 12.0))] += 1.0;
  }
  EXPECT_EQ(run.colony().cells().size(), static_cast<std::size_t>(2 * side * side));
  EXPECT_EQ(run.finished().reason, FinishReason::kAllSenescent);
  EXPECT_LT(testing::chi_square_uniform(bins), testing::chi_square_bound(11)) << testing::name_of_run(spec);
}

TEST(Direction, CellsInContactDivideAcrossTheLineFromNucleusToMembrane) {
  const RunSpec& spec = grown().simulator.spec();
  Colony before(spec.params);
  int in_contact = 0;
  for (const Event& event : grown().events) {
    if (const auto* divided = std::get_if<Divided>(&event.body)) {
      const Cell& parent = before.cell(*event.cell_id);
      EXPECT_EQ(divided->plane_normal.z(), 0.0);
      EXPECT_NEAR(divided->plane_normal.norm(), 1.0, 1e-12);
      const Vec3 across = *parent.nearest_membrane_um - parent.nucleus_um;
      bool touching = false;
      for (const Body* other : testing::neighbours_of(before, parent.id)) {
        touching = touching || touches(before.body(parent.id), *other, testing::points(256, 1));
      }
      if (touching) {
        ++in_contact;
        EXPECT_NEAR(divided->plane_normal.dot(across) / across.norm(), 0.0, 1e-12) << "seq " << event.seq;
      }
      const double turn = std::acos(std::clamp(divided->direction.dot(divided->plane_normal), -1.0, 1.0));
      EXPECT_LE(turn, 0.5 * maths::kPi + 1e-6);
    }
    before.apply(event);
  }
  EXPECT_GT(in_contact, 50);
}

TEST(Bounds, CellsAndTimeAreExact) {
  const testing::Run by_cells = testing::run(testing::spec_of(1, 37));
  EXPECT_EQ(by_cells.colony().cells().size(), 37U);
  EXPECT_EQ(by_cells.finished().reason, FinishReason::kCells);
  EXPECT_EQ(by_cells.finished().cell_count, 37U);
  EXPECT_EQ((by_cells.events.end() - 2)->kind(), EventKind::kDivided);  // ended by the very event that reached it

  RunSpec timed = testing::spec_of(1, 37);
  timed.until = {std::nullopt, 60.0};
  const testing::Run by_time = testing::run(timed);
  EXPECT_EQ(by_time.finished().reason, FinishReason::kTime);
  EXPECT_EQ(by_time.events.back().time_h, 60.0);
  for (const Event& event : by_time.events) EXPECT_LE(event.time_h, 60.0);
  EXPECT_GT(by_time.simulator.agenda().first().due_h, 60.0);

  RunSpec edge = timed;  // an event due exactly at the bound still happens
  edge.until.time_h = (by_time.events.end() - 2)->time_h;
  EXPECT_EQ(testing::run(edge).events.size(), by_time.events.size());

  EXPECT_EQ(testing::run(testing::spec_of(1, 1)).events.size(), 2U);
}

TEST(Bounds, HistoriesEndOnceAndFinishFromOutsideEndsThem) {
  Simulator simulator(testing::spec_of(1, 20));
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(simulator.step());
  const Event event = simulator.finish(FinishReason::kCancelled);
  EXPECT_EQ(std::get<Finished>(event.body).reason, FinishReason::kCancelled);
  EXPECT_EQ(event.digest, simulator.colony().digest());
  EXPECT_FALSE(simulator.step());
  EXPECT_THROW(simulator.finish(FinishReason::kCancelled), CheckFailure);
}

TEST(Exhaustion, EveryJobEndsInsideASmallDish) {
  for (const Seed seed : {1, 2, 3}) {
    RunSpec spec = testing::spec_of(seed, 100'000);
    spec.params.dish.radius_um = 28.0;
    spec.params.division.generation_limit.reset();
    const testing::Run run = testing::run(spec);
    EXPECT_EQ(run.finished().reason, FinishReason::kExhausted) << testing::name_of_run(spec);
    EXPECT_GT(run.colony().count(Activity::kPassive), 0U);
    EXPECT_LT(run.colony().cells().size(), 60U);
    for (const Cell& cell : run.colony().cells()) {
      EXPECT_EQ(cell.activity, Activity::kPassive);
      EXPECT_FALSE(cell.due_h);
      EXPECT_LE(cell.centre_um.head<2>().norm(), 28.0);
    }
  }
}

}  // namespace
}  // namespace colony
