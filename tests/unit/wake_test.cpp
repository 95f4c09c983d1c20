// Waking, founders, siblings' identity: rules that need more than one cell at the start or a neighbour that changes.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/growth/surroundings.hpp"
#include "engine/sim/simulator.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

// What the model says about the `woken` of one division or move, from the colonies before and after it and by brute force over all
// cells.
void check_woken(const RunSpec& spec, const Colony& before, const Colony& after, const Event& event, int& woken_count) {
  const std::vector<Woken>* woken = nullptr;
  if (const auto* divided = std::get_if<Divided>(&event.body)) woken = &divided->woken;
  if (const auto* moved = std::get_if<Moved>(&event.body)) {
    woken = &moved->woken;
    if (moved->cell.centre_um == before.cell(*event.cell_id).centre_um) {
      EXPECT_TRUE(woken->empty()) << "seq " << event.seq;
      return;
    }
  }
  if (woken == nullptr) return;
  for (const Cell& cell : before.cells()) {
    const bool sleeping = cell.activity == Activity::kPassive && !cell.due_h && cell.id != *event.cell_id;
    const auto found =
        std::find_if(woken->begin(), woken->end(), [&](const Woken& one) { return one.cell_id == cell.id; });
    if (!sleeping) {
      EXPECT_EQ(found, woken->end()) << "seq " << event.seq;
      continue;
    }
    const auto distance = [&](const Box& box) {
      const double dx = std::max({box.low.x() - cell.centre_um.x(), 0.0, cell.centre_um.x() - box.high.x()});
      const double dy = std::max({box.low.y() - cell.centre_um.y(), 0.0, cell.centre_um.y() - box.high.y()});
      const double dz = std::max({box.low.z() - cell.centre_um.z(), 0.0, cell.centre_um.z() - box.high.z()});
      return std::sqrt(dx * dx + dy * dy + (spec.params.layers == Layers::kMulti ? dz * dz : 0.0));
    };
    const Cell& daughter = event.kind() == EventKind::kDivided ? after.cells().back() : after.cell(*event.cell_id);
    const bool near = std::min({distance(before.body(*event.cell_id).box()), distance(after.body(*event.cell_id).box()),
                                distance(after.body(daughter.id).box())}) <= spec.params.wake.free_radius_um;
    // The share as it is after the event, from the colony as it is after the event.
    const double share = free_share(after, spec.params, spec.seed, cell, cell.ordinal, {});
    const bool gained = spec.params.wake.rule == WakeRule::kAlways || share >= *cell.free_share + spec.params.wake.gain;
    ASSERT_EQ(found != woken->end(), near && gained) << "seq " << event.seq << " cell " << cell.id.value;
    if (found == woken->end()) continue;
    ++woken_count;
    EXPECT_EQ(found->free_share, share);
    EXPECT_EQ(found->due_h, event.time_h + spec.params.wake.retry_h);
    EXPECT_EQ(after.cell(cell.id).due_h, found->due_h);
    EXPECT_EQ(after.cell(cell.id).try_count, 0);
    EXPECT_EQ(after.cell(cell.id).ordinal, cell.ordinal);
  }
}

// Every sleeper near any changed body is asked here; the engine skips those near which nothing went, and must wake the same ones.
TEST(Waking, WakesExactlyTheSleepersNearAChangeThatGainedRoom) {
  for (const auto& [rule, gain] : {std::pair{WakeRule::kShare, 0.02}, {WakeRule::kShare, 0.002}, {WakeRule::kAlways, 0.02}}) {
    RunSpec spec = testing::spec_of(4, testing::scaled(400, 1000));
    spec.params.wake.rule = rule;
    spec.params.wake.gain = gain;
    const testing::Run run = testing::run(spec);
    Colony before(spec.params), after(spec.params);
    int woken = 0;
    for (const Event& event : run.events) {
      after.apply(event);
      check_woken(spec, before, after, event, woken);
      before.apply(event);
    }
    std::printf("%s, gain %.3f: %d woken\n", rule == WakeRule::kShare ? "share" : "always", gain, woken);
    EXPECT_GT(woken, rule == WakeRule::kShare ? 3 : 100);
  }
}

TEST(Waking, WithLayersTheDistanceIsOneInSpace) {
  for (const WakeRule rule : {WakeRule::kShare, WakeRule::kAlways}) {
    RunSpec spec = testing::spec_of(4, testing::scaled(120, 300), *preset("tumour"));
    spec.params.wake.rule = rule;
    spec.params.wake.free_radius_um = 10.0;  // short of the top layer from the dish
    spec.params.wake.free_min = 0.5;
    const testing::Run run = testing::run(spec);
    Colony before(spec.params), after(spec.params);
    int woken = 0;
    for (const Event& event : run.events) {
      after.apply(event);
      check_woken(spec, before, after, event, woken);
      before.apply(event);
    }
    std::printf("layers, %s: %d woken\n", rule == WakeRule::kShare ? "share" : "always", woken);
    EXPECT_GT(woken, rule == WakeRule::kShare ? 3 : 100);
  }
}

// What it says about a sleeper that moves or fails to: its own share is asked on the points of its old ordinal.
void check_mover(const RunSpec& spec, const Colony& before, const Colony& after, const Event& event, int& woke, int& slept) {
  if (event.kind() != EventKind::kMoved) return;
  const Cell &was = before.cell(*event.cell_id), &is = after.cell(*event.cell_id);
  if (was.activity != Activity::kPassive || was.due_h) return;
  const bool made = is.centre_um != was.centre_um;
  const double share = free_share(after, spec.params, spec.seed, is, was.ordinal, {});
  const bool wakes = made && (spec.params.wake.rule == WakeRule::kAlways || share >= *was.free_share + spec.params.wake.gain);
  ASSERT_EQ(is.due_h.has_value(), wakes) << "seq " << event.seq;
  if (wakes) {
    ++woke;
    EXPECT_EQ(*is.free_share, share);
    EXPECT_EQ(*is.due_h, event.time_h + spec.params.wake.retry_h);
    EXPECT_EQ(is.try_count, 0);
  } else {
    ++slept;
    const double on_new_points = free_share(after, spec.params, spec.seed, is, is.ordinal, {});
    EXPECT_EQ(*is.free_share, std::clamp(*was.free_share + (on_new_points - share), 0.0, 1.0));
    EXPECT_EQ(is.try_count, was.try_count);
  }
}

TEST(Waking, AMoveWakesAsADivisionDoesAndTheMoverItself) {
  for (const WakeRule rule : {WakeRule::kShare, WakeRule::kAlways}) {
    RunSpec spec = testing::spec_of(4, testing::scaled(70, 200), *preset("young-colony"));
    spec.params.wake.rule = rule;
    const testing::Run run = testing::run(spec);
    Colony before(spec.params), after(spec.params);
    int woken = 0, woke = 0, slept = 0;
    for (const Event& event : run.events) {
      after.apply(event);
      if (event.kind() == EventKind::kMoved) check_woken(spec, before, after, event, woken);
      check_mover(spec, before, after, event, woke, slept);
      before.apply(event);
    }
    std::printf("%s: %d woken by moves, %d movers woke, %d slept on\n", rule == WakeRule::kShare ? "share" : "always", woken, woke, slept);
    EXPECT_GT(woken, 3);
    EXPECT_GT(woke + slept, 3);
  }
}

TEST(Waking, AlwaysCostsManyMoreSearchesThanShare) {
  const auto searches_per_division = [](WakeRule rule) {
    RunSpec spec = testing::spec_of(6, 160);
    spec.params.wake.rule = rule;
    const testing::Run run = testing::run(spec);
    double searches = 0.0, divisions = 0.0;
    for (const Event& event : run.events) {
      searches += event.kind() == EventKind::kDivided || event.kind() == EventKind::kInhibited ? 1.0 : 0.0;
      divisions += event.kind() == EventKind::kDivided ? 1.0 : 0.0;
    }
    return searches / divisions;
  };
  const double share = searches_per_division(WakeRule::kShare), always = searches_per_division(WakeRule::kAlways);
  std::printf("searches per division at 160 cells: share %.2f, always %.2f\n", share, always);
  EXPECT_LT(share, 5.0);
  EXPECT_GT(always, 2.0 * share);
}

TEST(Waking, ALuckyPlaceIsTriedAgainAtMostTriesMaxTimes) {
  // Nobody ever finds room: every founder has space around it but a fitness of 1 is out of reach.
  RunSpec spec = testing::spec_of(3, 100);
  spec.params.contact.fitness_min = 1.0;
  spec.params.contact.fitness_good = 1.0;
  spec.params.search.distance = {0.3, 0.3};  // the pair always overlaps itself
  spec.params.search.generations = 0;
  spec.params.search.corrector_generations = 0;
  for (const std::int64_t tries : {1, 3, 5}) {
    spec.params.wake.tries_max = tries;
    const testing::Run run = testing::run(spec);
    std::int64_t failed = 0;
    for (const Event& event : run.events) failed += event.kind() == EventKind::kInhibited ? 1 : 0;
    EXPECT_EQ(failed, tries + 1);  // the first search and tries_max repeats
    EXPECT_EQ(run.finished().reason, FinishReason::kExhausted);
  }
}

TEST(Founders, SeveralStandInTheDiscOutOfStepAndFreeEnough) {
  RunSpec spec = testing::spec_of(7, 1000);
  spec.params.founders.count = 60;
  spec.params.founders.radius_um = 80.0;
  const Result<std::vector<Cell>> placed = place_founders(spec);
  ASSERT_TRUE(placed);
  ASSERT_EQ(placed->size(), 60U);
  std::vector<Body> bodies;
  double early = 0.0;
  for (const Cell& cell : *placed) {
    EXPECT_EQ(cell.id.value, bodies.size() + 1);
    EXPECT_FALSE(cell.parent_id);
    EXPECT_EQ(cell.generation, 0);
    EXPECT_LE(cell.centre_um.head<2>().norm(), 80.0);
    EXPECT_LE(cell.born_h, 0.0);
    EXPECT_GE(*cell.due_h, 0.0);
    EXPECT_GE(*cell.due_h - cell.born_h, 6.0 - 1e-9);
    EXPECT_LE(*cell.due_h - cell.born_h, 18.0 + 1e-9);
    EXPECT_LE(*cell.settle_due_h, *cell.due_h);
    early += *cell.due_h < 6.0 ? 1.0 / 60.0 : 0.0;
    const double v = testing::ellipsoid_volume_um3(cell.semiaxes_um);
    EXPECT_GE(v, 400.0 - 1e-6);
    EXPECT_LE(v, 1800.0 + 1e-6);
    EXPECT_GE(cell.nucleus_radius_um, 2.5);
    EXPECT_LE(cell.nucleus_radius_um, 3.0);
    bodies.emplace_back(BodyGeometry{cell.centre_um, cell.semiaxes_um, cell.rotation_rad, cell.noise_offset},
                        spec.params.noise);
    std::vector<const Body*> earlier;
    for (std::size_t k = 0; k + 1 < bodies.size(); ++k) earlier.push_back(&bodies[k]);
    OverlapScratch scratch;
    OverlapCounts counts;
    count_overlaps(bodies.back(), earlier, std::nullopt, testing::points(4096, 1), scratch, counts);
    EXPECT_GE(counts.fitness(), 0.75 - 0.02) << "founder " << cell.id.value;
  }
  EXPECT_NEAR(early, 0.5, 0.25);  // due times uniform over the first cycle
  const Result<std::vector<Cell>> again = place_founders(spec);
  EXPECT_TRUE(*again == *placed);
}

TEST(Founders, OneStandsAtTheOriginAndWaitsAWholeCycle) {
  const Result<std::vector<Cell>> placed = place_founders(testing::spec_of(7, 10));
  ASSERT_TRUE(placed);
  EXPECT_EQ(placed->size(), 1U);
  EXPECT_EQ(placed->front().centre_um.head<2>(), Vec2(0, 0));
  EXPECT_EQ(placed->front().born_h, 0.0);
  EXPECT_GE(*placed->front().due_h, 6.0);
  EXPECT_EQ(placed->front().settle_due_h, 2.0);
}

TEST(Founders, PositionsAreKeptAndErrorsPointAtEachWrongOne) {
  RunSpec spec = testing::spec_of(7, 10);
  spec.params.dish.radius_um = 100.0;
  spec.params.founders.positions_um = {Vec2(0, 0),     Vec2(60, 0), Vec2(60.5, 0.5),
                                       Vec2(-50, -50), Vec2(0, 99), Vec2(300, 0)};
  const Result<std::vector<Cell>> placed = place_founders(spec);
  ASSERT_FALSE(placed);
  EXPECT_EQ(placed.error().code, ErrorCode::kInvalid);
  std::vector<std::string> pointers;
  for (const FieldError& error : placed.error().fields) pointers.push_back(error.pointer);
  EXPECT_EQ(pointers, (std::vector<std::string>{"/founders/positions_um/2", "/founders/positions_um/4",
                                                "/founders/positions_um/5"}));

  spec.params.founders.positions_um = {Vec2(3.25, -7.5), Vec2(60, 0)};
  const Result<std::vector<Cell>> good = place_founders(spec);
  ASSERT_TRUE(good);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ((*good)[k].centre_um.head<2>(), spec.params.founders.positions_um[k]);
}

TEST(Founders, TooManyForTheirDiscAreAnErrorThatNamesTheFirstWithoutPlace) {
  RunSpec spec = testing::spec_of(7, 1000);
  spec.params.founders.count = 200;
  spec.params.founders.radius_um = 20.0;
  const Result<std::vector<Cell>> placed = place_founders(spec);
  ASSERT_FALSE(placed);
  ASSERT_EQ(placed.error().fields.size(), 1U);
  EXPECT_EQ(placed.error().fields[0].pointer, "/founders");
  EXPECT_NE(placed.error().fields[0].message.find("1,000 tries"), std::string::npos);
  EXPECT_THROW(Simulator{spec}.step(), CheckFailure);
}

TEST(Founders, InvalidParametersNeverReachTheSimulator) {
  RunSpec spec = testing::spec_of(1, 10);
  spec.params.noise.amplitude = 0.46;
  EXPECT_THROW(Simulator{spec}.step(), CheckFailure);
}

}  // namespace
}  // namespace colony
