// The history is the checkpoint: any prefix, replayed into a new simulator, goes on with the same bytes.
#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/sim/simulator.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

struct Scene {
  std::string name;
  RunSpec spec;
};

std::vector<Scene> scenes() {
  std::vector<Scene> all;
  all.push_back({"paper", testing::spec_of(1, testing::scaled(32, 150))});
  all.push_back({"always, retained, max, uniform", testing::spec_of(2, testing::scaled(20, 60))});
  Params& p = all.back().spec.params;
  p.wake.rule = WakeRule::kAlways;
  p.contact.rule = ContactRule::kMax;
  p.contact.neighbour_retained_min = 0.3;
  p.cycle.distribution = CycleDistribution::kUniform;
  p.cycle.sibling_correlation = 0.6;
  all.push_back({"several founders in a dish", testing::spec_of(3, 100'000)});
  all.back().spec.until = {std::nullopt, 40.0};
  all.back().spec.params.founders.count = 6;
  all.back().spec.params.founders.radius_um = 50.0;
  all.back().spec.params.dish.radius_um = 75.0;
  all.push_back({"to the last senescent", testing::spec_of(4, 100'000)});
  all.back().spec.params.division.generation_limit = 5;
  all.push_back({"moves", testing::spec_of(5, testing::scaled(40, 120), *preset("young-colony"))});
  all.push_back({"many moves in a dish, always", testing::spec_of(6, 100'000, *preset("young-colony"))});
  Params& crowded = all.back().spec.params;
  crowded.motility = {0.5, 4.0, 0.8};
  crowded.wake.rule = WakeRule::kAlways;
  crowded.dish.radius_um = 25.0;
  all.back().spec.until = {std::nullopt, testing::scaled(90.0, 200.0)};
  all.push_back({"layers", testing::spec_of(7, testing::scaled(50, 200), *preset("tumour"))});
  return all;
}

TEST(Replay, EveryPrefixGoesOnWithTheSameBytes) {
  for (const Scene& scene : scenes()) {
    const testing::Run live = testing::run(scene.spec);
    for (std::size_t at = 0; at <= live.events.size(); at += 7) {
      Simulator again(scene.spec);
      for (std::size_t i = 0; i < at; ++i) again.replay(live.events[i]);
      // Two windows' worth of events at every place, all the rest at a few.
      const std::size_t end = at % 49 == 0 ? live.events.size() : std::min(live.events.size(), at + 12);
      for (std::size_t i = at; i < end; ++i) {
        const std::optional<Event> event = again.step();
        ASSERT_TRUE(event) << scene.name << ", replayed to seq " << at;
        ASSERT_TRUE(*event == live.events[i]) << scene.name << ", " << testing::name_of_run(scene.spec)
                                              << ", replayed to seq " << at << ", differs at seq " << i + 1;
      }
      if (end < live.events.size()) continue;
      ASSERT_FALSE(again.step()) << scene.name;
    }
  }
}

TEST(Replay, TheAgendaFoldedFromEventsEqualsTheLiveOneAndTheCellsDueTimes) {
  for (const Scene& scene : scenes()) {
    Simulator live(scene.spec);
    Colony folded(scene.spec.params);
    Agenda agenda;
    while (const std::optional<Event> event = live.step()) {
      folded.apply(*event);
      agenda.follow(*event, folded);
      ASSERT_EQ(agenda.items(), live.agenda().items()) << scene.name << " seq " << event->seq;
      std::set<AgendaItem> due;  // from the cells alone
      for (const Cell& cell : folded.cells()) {
        if (cell.settle_due_h) due.insert({*cell.settle_due_h, DueKind::kSettle, cell.id});
        if (cell.move_due_h) due.insert({*cell.move_due_h, DueKind::kMove, cell.id});
        if (cell.due_h) due.insert({*cell.due_h, DueKind::kDivide, cell.id});
      }
      ASSERT_EQ(agenda.items(), std::vector<AgendaItem>(due.begin(), due.end())) << scene.name << " seq " << event->seq;
      ASSERT_TRUE(std::equal(folded.cells().begin(), folded.cells().end(), live.colony().cells().begin(),
                             live.colony().cells().end()));
    }
  }
}

TEST(Replay, RefusesAHistoryOfAnotherSpecAsSoonAsItsDigestsDiffer) {
  const testing::Run live = testing::run(testing::spec_of(1, 5));
  Simulator other(testing::spec_of(1, 5));
  Event changed = live.events[0];
  std::get<Founded>(changed.body).cell.volume_um3 += 1.0;
  EXPECT_THROW(other.replay(changed), CheckFailure);
  EXPECT_THROW(other.replay(live.events[1]), CheckFailure);  // a gap
  EXPECT_NO_THROW(other.replay(live.events[0]));
}

// Kinds at equal times: settled, moved, then the division and what stands for it.
int rank(EventKind kind) { return kind == EventKind::kSettled ? 0 : kind == EventKind::kMoved ? 1 : 2; }

TEST(Events, ComeInSerialOrderWithDenseNumbersAndAnUnbrokenChain) {
  for (const Scene& scene : scenes()) {
    const testing::Run run = testing::run(scene.spec);
    Digest digest;
    for (std::size_t i = 0; i < run.events.size(); ++i) {
      const Event& event = run.events[i];
      ASSERT_EQ(event.seq, i + 1);
      digest = digest_after(digest, event);
      ASSERT_EQ(event.digest, digest) << scene.name;
      if (i == 0 || event.kind() == EventKind::kFounded || event.kind() == EventKind::kFinished) continue;
      const Event& before = run.events[i - 1];
      ASSERT_LE(before.time_h, event.time_h);
      if (before.time_h < event.time_h || before.kind() == EventKind::kFounded) continue;
      ASSERT_LE(rank(before.kind()), rank(event.kind())) << scene.name << " seq " << event.seq;
      if (rank(before.kind()) != rank(event.kind())) continue;
      ASSERT_LT(before.cell_id->value, event.cell_id->value) << scene.name << " seq " << event.seq;
    }
    EXPECT_EQ(run.events.back().kind(), EventKind::kFinished);
  }
}

}  // namespace
}  // namespace colony
