// The bounds by which events run at once, held against what events really write and read: a history is walked through
// serially, and for each event the bounds that the simulator would have used are checked.
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/sim/conflict.hpp"
#include "engine/sim/decide.hpp"
#include "engine/sim/decide_move.hpp"
#include "engine/sim/simulator.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

bool is_sleeper(const Cell& cell) { return cell.activity == Activity::kPassive && !cell.due_h; }

bool same_body(const Cell& a, const Cell& b) {
  return a.centre_um == b.centre_um && a.semiaxes_um == b.semiaxes_um && a.rotation_rad == b.rotation_rad &&
         a.noise_offset == b.noise_offset;
}

// By brute force: what is different after the event.
Writes written(const Colony& before, const Colony& after, CellId subject) {
  Writes out;
  out.cell_id = subject;
  for (const Cell& cell : after.cells()) {
    const Cell* was = before.contains(cell.id) ? &before.cell(cell.id) : nullptr;
    if (was == nullptr || !same_body(*was, cell)) out.bodies = hull(out.bodies, rect_of(after.body(cell.id).box()));
    if (was == nullptr) continue;
    if (!same_body(*was, cell)) out.bodies = hull(out.bodies, rect_of(before.body(cell.id).box()));
    if (is_sleeper(*was) != is_sleeper(cell)) out.sleepers = hull(out.sleepers, rect_of(cell.centre_um));
  }
  return out;
}

bool holds(const Writes& outer, const Writes& inner) {
  return contains(outer.bodies, inner.bodies) && contains(outer.sleepers, inner.sleepers);
}

DueKind kind_of(const Event& event) {
  if (event.kind() == EventKind::kSettled) return DueKind::kSettle;
  return event.kind() == EventKind::kMoved ? DueKind::kMove : DueKind::kDivide;
}

EventBody decision(const Colony& colony, const RunSpec& spec, const AgendaItem& item) {
  Workspace workspace(spec.params);
  if (item.kind == DueKind::kSettle) return decide_settling(colony, spec.params, spec.seed, item.cell_id, workspace).body;
  if (item.kind == DueKind::kMove) return decide_move(colony, spec.params, spec.seed, item.cell_id, item.due_h, workspace).body;
  return decide_division(colony, spec.params, spec.seed, item.cell_id, item.due_h, workspace).body;
}

// The same colony with all that `reads` says does not matter made different: bodies that do not meet it carried off, sleep
// turned into waking and back beyond it.
struct Other {
  Colony colony;
  int carried_off_count = 0;
  int turned_count = 0;
};

Other with_the_rest_changed(const Colony& colony, const RunSpec& spec, const Reads& reads) {
  Other other{Colony(spec.params)};
  for (const Cell& original : colony.cells()) {
    Cell cell = original;
    if (cell.id != reads.cell_id) {
      if (!meets(rect_of(colony.body(cell.id).box()), reads.bodies)) {
        cell.centre_um.x() += 1e5;
        cell.nucleus_um.x() += 1e5;
        ++other.carried_off_count;
      }
      if (!meets(rect_of(original.centre_um), reads.sleepers) && cell.activity != Activity::kSenescent) {
        const bool wakes = is_sleeper(cell);
        cell.activity = wakes ? Activity::kActive : Activity::kPassive;
        cell.due_h = wakes ? std::optional<double>(colony.time_h() + 5.0) : std::nullopt;
        cell.free_share = 0.0;  // whoever looks wakes it
        ++other.turned_count;
      }
    }
    Event event;
    event.seq = other.colony.last_seq() + 1;
    event.cell_id = cell.id;
    event.body = Founded{cell};
    event.digest = digest_after(other.colony.digest(), event);
    other.colony.apply(event);
  }
  return other;
}

std::vector<std::pair<std::string, RunSpec>> scenes() {
  std::vector<std::pair<std::string, RunSpec>> all;
  all.emplace_back("paper", testing::spec_of(1, testing::scaled(110, 300)));
  RunSpec spec = testing::spec_of(2, 100'000, *preset("clonogenic"));
  spec.params.founders.count = 70;
  spec.params.founders.radius_um = 150.0;
  spec.params.dish.radius_um = 180.0;
  spec.params.window_h = 2.0;
  spec.until = {std::nullopt, testing::scaled(20.0, 40.0)};
  all.emplace_back("packed", spec);
  spec.params.wake.rule = WakeRule::kAlways;
  spec.until.time_h = testing::scaled(16.0, 40.0);
  all.emplace_back("packed, wake always", spec);
  spec.params.contact.neighbour_retained_min = 0.3;
  spec.params.wake.free_radius_um = 5.0;  // then the neighbours of neighbours reach further
  spec.params.founders.count = 40;
  spec.until.time_h = testing::scaled(10.0, 24.0);
  all.emplace_back("packed, retained", spec);
  spec.params.contact.neighbour_retained_min = 0.0;
  spec.params.search.distance = {0.3, 0.3};  // the reach is shorter than the dividing body
  spec.params.contact.fitness_min = 0.3;
  all.emplace_back("packed, near", spec);
  spec = testing::spec_of(4, testing::scaled(90, 200));
  spec.params.wake.rule = WakeRule::kAlways;
  spec.params.wake.free_radius_um = 45.0;  // longer than the reach: waking bounds what is read and written
  all.emplace_back("wide free radius", spec);
  // Moves, also of cells that divide before them in the same horizon.
  spec = testing::spec_of(2, 100'000, *preset("young-colony"));
  spec.params.motility.rate_per_h = 0.5;
  spec.params.founders.count = 60;
  spec.params.founders.radius_um = 150.0;
  spec.params.dish.radius_um = 180.0;
  spec.until = {std::nullopt, testing::scaled(20.0, 40.0)};
  all.emplace_back("packed, moving", spec);
  // Several layers: reach and free share are balls inside the same squares.
  all.emplace_back("layers", testing::spec_of(1, testing::scaled(120, 300), *preset("tumour")));
  spec = testing::spec_of(2, 100'000, *preset("tumour"));
  spec.params.founders.count = 40;
  spec.params.founders.radius_um = 110.0;
  spec.params.dish.radius_um = 140.0;
  spec.params.wake.rule = WakeRule::kAlways;
  spec.until = {std::nullopt, testing::scaled(18.0, 40.0)};
  all.emplace_back("layers, packed, wake always", spec);
  return all;
}

// Calls look(before, event) for each event that an agenda item led to; `before` has all earlier ones.
void walk(const RunSpec& spec, const std::function<void(const Colony&, const Agenda&, const Event&)>& look) {
  const testing::Run run = testing::run(spec);
  Colony colony(spec.params);
  Agenda agenda;
  for (const Event& event : run.events) {
    if (event.kind() != EventKind::kFounded && event.kind() != EventKind::kFinished) look(colony, agenda, event);
    colony.apply(event);
    if (event.kind() != EventKind::kFinished) agenda.follow(event, colony);
  }
}

// Bounds as they were when the item entered the horizon hold for what happens in the end, whatever came between.
TEST(ConflictBounds, HoldWhatIsWritten) {
  int all_sleeper_count = 0;
  for (const auto& [name, spec] : scenes()) {
    const ConflictBounds bounds(spec.params), half(spec.params, 0.5);
    std::map<AgendaItem, std::pair<Writes, Writes>> entered;
    std::vector<AgendaItem> due;
    int outside_half_count = 0, sleeper_count = 0;
    walk(spec, [&](const Colony& before, const Agenda& agenda, const Event& event) {
      agenda.due_before(agenda.first().due_h + spec.params.window_h, due);
      for (const AgendaItem& item : due) {
        if (entered.find(item) == entered.end()) {
          entered.emplace(item, std::pair(bounds.writes(before, item), half.writes(before, item)));
        }
      }
      const AgendaItem item = {event.time_h, kind_of(event), *event.cell_id};
      ASSERT_EQ(agenda.first(), item);
      Colony after = before;
      after.apply(event);
      const Writes real = written(before, after, item.cell_id);
      const Writes decided = bounds.writes(before, item, event.body);
      const auto& [bound, half_bound] = entered.at(item);
      ASSERT_TRUE(holds(decided, real)) << name << " seq " << event.seq;
      ASSERT_TRUE(holds(bound, decided)) << name << " seq " << event.seq;
      outside_half_count += holds(half_bound, real) ? 0 : 1;
      sleeper_count += real.sleepers.empty() ? 0 : 1;
    });
    std::printf("%s: %d events wrote outside half the bound, %d wrote sleepers\n", name.c_str(), outside_half_count,
                sleeper_count);
    EXPECT_GT(outside_half_count, 0) << name;  // the test can see a bound that is too small
    all_sleeper_count += sleeper_count;
  }
  EXPECT_GT(all_sleeper_count, 30);
}

// What lies outside the bound may be anything.
TEST(ConflictBounds, HoldWhatIsRead) {
  for (const auto& [name, spec] : scenes()) {
    const ConflictBounds bounds(spec.params), small(spec.params, 0.4);
    int compared_count = 0, differing_count = 0, carried_off_count = 0, turned_count = 0, index = 0;
    walk(spec, [&](const Colony& before, const Agenda&, const Event& event) {
      if (before.cells().size() < 30 || ++index % testing::scaled(5, 2) != 0) return;
      const AgendaItem item = {event.time_h, kind_of(event), *event.cell_id};
      const EventBody expected = decision(before, spec, item);
      const Other other = with_the_rest_changed(before, spec, bounds.reads(before, item));
      carried_off_count += other.carried_off_count;
      turned_count += other.turned_count;
      ++compared_count;
      ASSERT_TRUE(decision(other.colony, spec, item) == expected) << name << " seq " << event.seq;
      const Other too_much = with_the_rest_changed(before, spec, small.reads(before, item));
      differing_count += decision(too_much.colony, spec, item) == expected ? 0 : 1;
    });
    std::printf("%s: %d events, %d bodies carried off, %d sleeps turned; %d events differ with 0.4 of the bound\n",
                name.c_str(), compared_count, carried_off_count, turned_count, differing_count);
    EXPECT_GT(carried_off_count, compared_count) << name;
    EXPECT_GT(turned_count, compared_count) << name;
    EXPECT_GT(differing_count, 0) << name;
  }
}

// Cells as no scene makes them: the bounds at their edge.
class ConflictBoundsAtTheEdge : public ::testing::Test {
 protected:
  CellId add(double x_um, const Vec3& nucleus_offset_um, bool settles = false) {
    Cell cell;
    cell.id = CellId{static_cast<std::uint32_t>(colony_.cells().size() + 1)};
    cell.semiaxes_um = Vec3(14.0, 11.0, 6.0);
    cell.centre_um = Vec3(x_um, 0.0, 3.3);
    cell.nucleus_um = cell.centre_um + nucleus_offset_um;
    cell.due_h = 10.0;
    if (settles) cell.settle_due_h = 9.5;
    apply(cell.id, Founded{cell});
    return cell.id;
  }
  void apply(CellId id, EventBody body) {
    Event event;
    event.seq = colony_.last_seq() + 1;
    event.cell_id = id;
    event.body = std::move(body);
    event.digest = digest_after(colony_.digest(), event);
    colony_.apply(event);
  }
  static AgendaItem division(CellId id) { return {10.0, DueKind::kDivide, id}; }
  Rect box(CellId id) const { return rect_of(colony_.body(id).box()); }

  Params params_;
  Colony colony_{Params{}};
};

TEST_F(ConflictBoundsAtTheEdge, TheDividingBodyItselfGoes) {
  params_.search.distance = {0.3, 0.3};
  params_.search.sideways = 0.0;
  const CellId id = add(0.0, Vec3(14.0, 0.0, 0.0));
  const ConflictBounds bounds(params_);
  EXPECT_FALSE(contains(grown(rect_of(colony_.cell(id).nucleus_um), search_reach_um(params_)), box(id)));  // the case is one
  EXPECT_TRUE(contains(bounds.writes(colony_, division(id)).bodies, box(id)));
  EXPECT_TRUE(contains(bounds.reads(colony_, division(id)).bodies, box(id)));
}

TEST_F(ConflictBoundsAtTheEdge, ASettlingBeforeTheDivisionMovesTheNucleus) {
  const CellId id = add(0.0, Vec3(-14.0, 0.0, 0.0), true);
  const ConflictBounds bounds(params_);
  const Writes before = bounds.writes(colony_, division(id));
  Settled settled;
  settled.nucleus_um = colony_.cell(id).centre_um + Vec3(14.0, 0.0, 0.0);
  settled.nearest_membrane_um = settled.nucleus_um;
  settled.due_h = 10.0;
  apply(id, settled);
  const Writes after = bounds.writes(colony_, division(id));
  EXPECT_TRUE(holds(before, after));
}

TEST_F(ConflictBoundsAtTheEdge, AMoveTakesBodyAndSleepAlong) {
  const CellId id = add(0.0, Vec3::Zero());
  apply(id, Inhibited{});  // asleep
  const ConflictBounds bounds(params_);
  const AgendaItem move = {10.0, DueKind::kMove, id};
  Moved moved{colony_.cell(id), {}};
  moved.cell.centre_um.x() += params_.motility.step_um;
  const Writes bound = bounds.writes(colony_, move), decided = bounds.writes(colony_, move, moved);
  ++moved.cell.ordinal;
  const Vec3 from_um = colony_.cell(id).centre_um;
  const Rect old_box = box(id);
  apply(id, moved);
  for (const Writes& writes : {bound, decided}) {
    EXPECT_TRUE(contains(writes.bodies, hull(old_box, box(id))));
    EXPECT_TRUE(contains(writes.sleepers, hull(rect_of(from_um), rect_of(moved.cell.centre_um))));
  }
  EXPECT_TRUE(holds(bound, decided));
}

// The neighbours of the neighbours of a candidate: read where neighbours are asked what they retain.
TEST_F(ConflictBoundsAtTheEdge, ANeighboursNeighbourIsRead) {
  params_.wake.free_radius_um = 5.0;
  const CellId id = add(0.0, Vec3::Zero());
  const double half = box(id).high.x();
  const double edge = search_reach_um(params_);
  const CellId neighbour = add(edge + half - 0.01, Vec3::Zero());
  const CellId next = add(edge + 3.0 * half - 0.02, Vec3::Zero());
  ASSERT_TRUE(meets(box(neighbour), box(next)));
  EXPECT_FALSE(meets(ConflictBounds(params_).reads(colony_, division(id)).bodies, box(next)));
  params_.contact.neighbour_retained_min = 0.1;
  EXPECT_TRUE(meets(ConflictBounds(params_).reads(colony_, division(id)).bodies, box(next)));
}

// A sleeper as far as one is woken, and a body as far as its share is taken.
TEST_F(ConflictBoundsAtTheEdge, ASleeperAtTheEdgeReadsAsFarAgain) {
  const double f = params_.wake.free_radius_um;
  const CellId id = add(0.0, Vec3::Zero());
  const double edge = search_reach_um(params_);
  const CellId sleeper = add(edge + f, Vec3::Zero());
  const CellId beyond = add(edge + 2.0 * f + box(id).high.x(), Vec3::Zero());
  const ConflictBounds bounds(params_);
  const Vec3& centre_um = colony_.cell(sleeper).centre_um;
  EXPECT_TRUE(contains(bounds.writes(colony_, division(id)).sleepers, rect_of(centre_um)));
  EXPECT_TRUE(contains(bounds.reads(colony_, division(id)).sleepers, rect_of(centre_um)));
  EXPECT_TRUE(meets(bounds.reads(colony_, division(id)).bodies, box(beyond)));
  EXPECT_LE(bounds.reads(colony_, division(id)).bodies.high.x() - bounds.reads(colony_, division(id)).bodies.low.x(),
            bounds.side_max_um());
}

TEST(ConflictIndex, FindsWhatAPlainSearchFinds) {
  Stream random(1, CellId{1}, 0, Purpose::kFounder);
  const auto rect = [&](double side_um) {
    const Vec2 low(random.uniform({-400.0, 400.0}), random.uniform({-400.0, 400.0}));
    return Rect{low, low + Vec2(random.uniform({0.0, side_um}), random.uniform({0.0, side_um}))};
  };
  constexpr std::size_t kCapacity = 64;
  ConflictIndex index(50.0, kCapacity);
  std::map<std::uint64_t, Writes> alive;
  int found_count = 0;
  std::uint64_t first = 0;
  for (std::uint64_t number = 0; number < 3000; ++number) {
    if (number - first > 30 + random.below(30)) first += 1 + random.below(20);
    alive.erase(alive.begin(), alive.lower_bound(first));
    Writes writes{CellId{random.below(2000)}, rect(50.0), {}};
    if (number % 3 == 0) writes.sleepers = grown(rect_of(Vec3(writes.bodies.low.x(), writes.bodies.low.y(), 0.0)), 0.5);
    if (number % 5 == 0) writes.bodies = {};
    const Rect near = writes.bodies.empty() ? rect(1.0) : writes.bodies;
    index.add(number, first, writes, Vec3(near.low.x(), near.low.y(), 0.0));
    alive.emplace(number, writes);
    if (number % 4 == 0 && number > first) {
      Writes& narrowed = alive.at(number - 1);
      narrowed.bodies = {};
      index.narrow(number - 1, narrowed);
    }
    const Reads reads{CellId{random.below(2000) + 5000}, rect(50.0), rect(50.0)};
    const std::uint64_t end = number + 1 - random.below(3) % (number + 1 - first);
    const std::optional<std::uint64_t> found = index.find(reads, first, end);
    bool any = false;
    for (const auto& [one, what] : alive) any = any || (one < end && conflicts(what, reads));
    ASSERT_EQ(found.has_value(), any) << number;
    if (!found) continue;
    ++found_count;
    ASSERT_TRUE(*found >= first && *found < end && conflicts(alive.at(*found), reads)) << number;
  }
  EXPECT_GT(found_count, 100);
}

// A settling changes nothing for others, but everything for its own cell's division.
TEST(ConflictIndex, FindsAnEarlierItemOfTheSameCell) {
  const Simulator simulator = [] {
    Simulator one(testing::spec_of(1, 2));
    one.step();
    return one;
  }();
  const Colony& colony = simulator.colony();
  const ConflictBounds bounds(simulator.spec().params);
  const AgendaItem settling = {2.0, DueKind::kSettle, CellId{1}}, division = {2.5, DueKind::kDivide, CellId{1}};
  ConflictIndex index(bounds.side_max_um(), 4);
  const Writes writes = bounds.writes(colony, settling);
  EXPECT_TRUE(writes.bodies.empty() && writes.sleepers.empty());
  index.add(0, 0, writes, colony.cell(CellId{1}).centre_um);
  EXPECT_EQ(index.find(bounds.reads(colony, division), 0, 1), 0U);
  EXPECT_FALSE(index.find(bounds.reads(colony, division), 0, 0));
  EXPECT_FALSE(index.find(bounds.reads(colony, division), 1, 1));  // committed
}

}  // namespace
}  // namespace colony
