// Events, canonical bytes and the digest chain; Colony::apply as the only way a colony changes, and what it refuses.
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"
#include "tests/support/bodies.hpp"

namespace colony {
namespace {

Cell full_cell(std::uint32_t id) {
  Cell cell;
  cell.id = CellId{id};
  cell.generation = 3;
  cell.ordinal = 1;
  cell.centre_um = Vec3(1.0, 2.0, 3.0);
  cell.nucleus_um = Vec3(1.5, 2.5, 2.0);
  cell.nucleus_radius_um = 2.7;
  cell.semiaxes_um = Vec3(9.0, 7.0, 4.0);
  cell.rotation_rad = Vec3(0.1, 0.2, 0.3);
  cell.noise_offset = Vec3(4.0, 5.0, 6.0);
  cell.born_h = 7.0;
  cell.due_h = 19.0;
  cell.settle_due_h = 9.0;
  cell.move_due_h = 8.0;
  cell.free_share = 0.3;
  cell.try_count = 2;
  cell.volume_um3 = 800.0;
  cell.deformed_volume_um3 = 700.0;
  cell.nearest_membrane_um = Vec3(5.0, 6.0, 7.0);
  return cell;
}

Event event_of(EventBody body) {
  Event event;
  event.time_h = 10.0;
  event.cell_id = CellId{1};
  event.body = std::move(body);
  return event;
}

struct Change {
  std::string name;
  std::function<void(Event&)> make;
};

// One change for each field of a cell reached through `at`.
void add_cell_changes(std::vector<Change>& changes, const std::string& prefix, std::function<Cell&(Event&)> at) {
  const auto add = [&](const std::string& name, std::function<void(Cell&)> change) {
    changes.push_back({prefix + name, [at, change](Event& event) { change(at(event)); }});
  };
  add("id", [](Cell& c) { c.id.value += 1; });
  add("parent_id", [](Cell& c) { c.parent_id = CellId{9}; });
  add("generation", [](Cell& c) { c.generation += 1; });
  add("ordinal", [](Cell& c) { c.ordinal += 1; });
  add("activity", [](Cell& c) { c.activity = Activity::kPassive; });
  for (int i = 0; i < 3; ++i) {
    add("centre", [i](Cell& c) { c.centre_um[i] += 1e-12; });
    add("nucleus", [i](Cell& c) { c.nucleus_um[i] += 1e-12; });
    add("semiaxes", [i](Cell& c) { c.semiaxes_um[i] += 1e-12; });
    add("rotation", [i](Cell& c) { c.rotation_rad[i] += 1e-12; });
    add("noise_offset", [i](Cell& c) { c.noise_offset[i] += 1e-12; });
    add("nearest_membrane", [i](Cell& c) { (*c.nearest_membrane_um)[i] += 1e-12; });
  }
  add("nucleus_radius", [](Cell& c) { c.nucleus_radius_um += 1e-12; });
  add("born", [](Cell& c) { c.born_h += 1e-12; });
  add("due", [](Cell& c) { *c.due_h += 1e-12; });
  add("no due", [](Cell& c) { c.due_h.reset(); });
  add("settle_due", [](Cell& c) { *c.settle_due_h += 1e-12; });
  add("no settle_due", [](Cell& c) { c.settle_due_h.reset(); });
  add("move_due", [](Cell& c) { *c.move_due_h += 1e-12; });
  add("no move_due", [](Cell& c) { c.move_due_h.reset(); });
  add("free_share", [](Cell& c) { *c.free_share += 1e-12; });
  add("no free_share", [](Cell& c) { c.free_share.reset(); });
  add("try_count", [](Cell& c) { c.try_count += 1; });
  add("volume", [](Cell& c) { c.volume_um3 += 1e-12 * c.volume_um3; });
  add("deformed_volume", [](Cell& c) { *c.deformed_volume_um3 += 1e-12 * 700.0; });
  add("no deformed_volume", [](Cell& c) { c.deformed_volume_um3.reset(); });
  add("no nearest_membrane", [](Cell& c) { c.nearest_membrane_um.reset(); });
}

void add_woken_changes(std::vector<Change>& changes, std::function<std::vector<Woken>&(Event&)> at) {
  changes.push_back({"woken id", [at](Event& e) { at(e)[0].cell_id.value += 1; }});
  changes.push_back({"woken share", [at](Event& e) { at(e)[0].free_share += 1e-12; }});
  changes.push_back({"woken due", [at](Event& e) { at(e)[0].due_h += 1e-12; }});
  changes.push_back({"one woken less", [at](Event& e) { at(e).pop_back(); }});
  changes.push_back({"one woken more", [at](Event& e) { at(e).push_back({CellId{8}, 0.5, 20.0}); }});
}

struct Case {
  Event event;
  std::vector<Change> changes;
};

std::vector<Case> cases() {
  const std::vector<Woken> woken = {{CellId{3}, 0.4, 14.0}, {CellId{5}, 0.5, 15.0}};
  std::vector<Case> all;
  all.push_back({event_of(Founded{full_cell(1)}), {}});
  add_cell_changes(all.back().changes, "founded ", [](Event& e) -> Cell& { return std::get<Founded>(e.body).cell; });

  Divided divided;
  divided.cells = {full_cell(1), full_cell(2)};
  divided.woken = woken;
  divided.evaluation_count = 100;
  all.push_back({event_of(divided), {}});
  auto& changes = all.back().changes;
  for (std::size_t k = 0; k < 2; ++k) {
    add_cell_changes(changes, "divided " + std::to_string(k) + " ",
                     [k](Event& e) -> Cell& { return std::get<Divided>(e.body).cells[k]; });
  }
  for (int i = 0; i < 3; ++i) {
    changes.push_back({"plane point", [i](Event& e) { std::get<Divided>(e.body).plane_point_um[i] += 1; }});
    changes.push_back({"plane normal", [i](Event& e) { std::get<Divided>(e.body).plane_normal[i] += 1; }});
    changes.push_back({"direction", [i](Event& e) { std::get<Divided>(e.body).direction[i] += 1; }});
  }
  changes.push_back({"fitness", [](Event& e) { std::get<Divided>(e.body).fitness += 1e-12; }});
  changes.push_back({"evaluations", [](Event& e) { std::get<Divided>(e.body).evaluation_count += 1; }});
  changes.push_back({"corrected", [](Event& e) { std::get<Divided>(e.body).corrected = true; }});
  add_woken_changes(changes, [](Event& e) -> std::vector<Woken>& { return std::get<Divided>(e.body).woken; });

  all.push_back({event_of(Inhibited{0.5, 0.2, 1, 544, false, 22.0}),
                 {{"fitness", [](Event& e) { std::get<Inhibited>(e.body).fitness += 1e-12; }},
                  {"free share", [](Event& e) { std::get<Inhibited>(e.body).free_share += 1e-12; }},
                  {"tries", [](Event& e) { std::get<Inhibited>(e.body).try_count += 1; }},
                  {"evaluations", [](Event& e) { std::get<Inhibited>(e.body).evaluation_count += 1; }},
                  {"corrected", [](Event& e) { std::get<Inhibited>(e.body).corrected = true; }},
                  {"due", [](Event& e) { *std::get<Inhibited>(e.body).due_h += 1e-12 * 22; }},
                  {"no due", [](Event& e) { std::get<Inhibited>(e.body).due_h.reset(); }}}});
  all.push_back({event_of(Settled{Vec3(1, 2, 3), Vec3(4, 5, 6), 700.0, 12.0}),
                 {{"nucleus", [](Event& e) { std::get<Settled>(e.body).nucleus_um[1] += 1; }},
                  {"membrane", [](Event& e) { std::get<Settled>(e.body).nearest_membrane_um[2] += 1; }},
                  {"volume", [](Event& e) { std::get<Settled>(e.body).deformed_volume_um3 += 1; }},
                  {"due", [](Event& e) { *std::get<Settled>(e.body).due_h += 1; }},
                  {"no due", [](Event& e) { std::get<Settled>(e.body).due_h.reset(); }}}});
  all.push_back({event_of(Moved{full_cell(1), woken}), {}});
  add_cell_changes(all.back().changes, "moved ", [](Event& e) -> Cell& { return std::get<Moved>(e.body).cell; });
  add_woken_changes(all.back().changes, [](Event& e) -> std::vector<Woken>& { return std::get<Moved>(e.body).woken; });
  all.push_back({event_of(Senesced{}), {}});
  for (Case& one : all) {
    one.changes.push_back({"time", [](Event& e) { e.time_h += 1e-12; }});
    one.changes.push_back({"subject", [](Event& e) { e.cell_id->value += 1; }});
  }
  return all;
}

TEST(Digest, EveryFieldOfEveryEventChangesIt) {
  const Digest previous = *Digest::from_hex("00112233445566778899aabbccddeeff");
  std::set<std::string> all;
  std::size_t expected = 0;
  for (const Case& one : cases()) {
    const Digest before = digest_after(previous, one.event);
    all.insert(before.hex());
    ++expected;
    for (const Change& change : one.changes) {
      Event event = one.event;
      change.make(event);
      ASSERT_FALSE(event == one.event) << change.name;
      EXPECT_NE(digest_after(previous, event), before) << name_of(one.event.kind()) << ": " << change.name;
    }
    EXPECT_NE(digest_after(Digest{}, one.event), before) << "the link before";
    Event renumbered = one.event;  // outside the bytes: the place in the chain says it
    renumbered.seq = 99;
    EXPECT_EQ(digest_after(previous, renumbered), before);
  }
  EXPECT_EQ(all.size(), expected);
}

TEST(Digest, FinishedStaysOutsideTheChain) {
  const Digest previous = *Digest::from_hex("00112233445566778899aabbccddeeff");
  Event finished;
  finished.time_h = 12.0;
  finished.body = Finished{FinishReason::kTime, 7};
  EXPECT_EQ(digest_after(previous, finished), previous);
}

TEST(Digest, HexRoundTripsAndRefusesAnythingElse) {
  const std::string hex = "00112233445566778899aabbccddeeff";
  EXPECT_EQ(Digest::from_hex(hex)->hex(), hex);
  for (const char* bad : {"", "0", "00112233445566778899aabbccddeef", "00112233445566778899aabbccddeeff0",
                          "00112233445566778899AABBCCDDEEFF", "0011223344556677 899aabbccddeeff"}) {
    EXPECT_FALSE(Digest::from_hex(bad)) << bad;
  }
}

TEST(Canonicalise, NegativeZeroBecomesZeroEverywhereAndNanOrInfinityFailsACheck) {
  for (const double zero : {-0.0}) {
    Event event = event_of(Settled{Vec3(zero, 1, 1), Vec3(1, zero, 1), zero, zero});
    event.time_h = zero;
    EXPECT_THROW(digest_after(Digest{}, event), CheckFailure);  // raw -0.0 never enters the bytes
    canonicalise(event);
    const auto& settled = std::get<Settled>(event.body);
    for (const double value : {event.time_h, settled.nucleus_um.x(), settled.nearest_membrane_um.y(),
                               settled.deformed_volume_um3, *settled.due_h}) {
      EXPECT_FALSE(std::signbit(value));
    }
    EXPECT_NO_THROW(digest_after(Digest{}, event));
  }
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (const Case& one : cases()) {
      Event event = one.event;
      event.time_h = bad;
      EXPECT_THROW(canonicalise(event), CheckFailure);
    }
    Cell cell = full_cell(1);
    cell.nearest_membrane_um->z() = bad;
    Event founded = event_of(Founded{cell});
    EXPECT_THROW(canonicalise(founded), CheckFailure);
    Event divided = event_of([&] {
      Divided d;
      d.cells = {full_cell(1), cell};
      return d;
    }());
    EXPECT_THROW(canonicalise(divided), CheckFailure);
    Event woken = event_of(Moved{full_cell(1), {{CellId{2}, bad, 1.0}}});
    EXPECT_THROW(canonicalise(woken), CheckFailure);
  }
}

TEST(EventNames, RoundTrip) {
  for (int k = 0; k < kEventKindCount; ++k)
    EXPECT_EQ(event_kind_from(name_of(static_cast<EventKind>(k))), static_cast<EventKind>(k));
  for (int r = 0; r < 8; ++r)
    EXPECT_EQ(finish_reason_from(name_of(static_cast<FinishReason>(r))), static_cast<FinishReason>(r));
  EXPECT_FALSE(event_kind_from("born"));
  EXPECT_FALSE(finish_reason_from(""));
}

class Apply : public ::testing::Test {
 protected:
  Event next(EventBody body, std::uint32_t subject, double time_h = 0.0) const {
    Event event;
    event.seq = colony_.last_seq() + 1;
    event.time_h = time_h;
    if (body.index() != static_cast<std::size_t>(EventKind::kFinished)) event.cell_id = CellId{subject};
    event.body = std::move(body);
    event.digest = digest_after(colony_.digest(), event);
    return event;
  }
  void expect_refused(const Event& event) {
    const Digest digest = colony_.digest();
    const std::uint64_t seq = colony_.last_seq();
    EXPECT_THROW(colony_.apply(event), CheckFailure);
    EXPECT_EQ(colony_.digest(), digest);
    EXPECT_EQ(colony_.last_seq(), seq);
  }
  Colony colony_{Params{}};
};

TEST_F(Apply, FoldsFactsAndCountsActivities) {
  colony_.apply(next(Founded{full_cell(1)}, 1));
  EXPECT_EQ(colony_.count(Activity::kActive), 1U);
  colony_.apply(next(Settled{Vec3(1, 1, 1), Vec3(2, 2, 2), 650.0, 19.0}, 1, 9.0));
  EXPECT_EQ(colony_.cell(CellId{1}).nucleus_um, Vec3(1, 1, 1));
  EXPECT_EQ(colony_.cell(CellId{1}).nearest_membrane_um, Vec3(2, 2, 2));
  EXPECT_EQ(colony_.cell(CellId{1}).deformed_volume_um3, 650.0);
  EXPECT_FALSE(colony_.cell(CellId{1}).settle_due_h);
  EXPECT_EQ(colony_.cell(CellId{1}).ordinal, 2U);
  colony_.apply(next(Inhibited{0.2, 0.1, 1, 544, true, std::nullopt}, 1, 19.0));
  EXPECT_EQ(colony_.count(Activity::kPassive), 1U);
  EXPECT_FALSE(colony_.cell(CellId{1}).due_h);
  EXPECT_EQ(colony_.cell(CellId{1}).free_share, 0.1);
  colony_.apply(next(Senesced{}, 1, 20.0));
  EXPECT_EQ(colony_.count(Activity::kSenescent), 1U);
  EXPECT_EQ(colony_.count(Activity::kPassive), 0U);
  colony_.apply(next(Finished{FinishReason::kAllSenescent, 1}, 0, 20.0));
  EXPECT_TRUE(colony_.finished());
  expect_refused(next(Senesced{}, 1, 20.0));  // nothing after the end
}

TEST_F(Apply, RefusesWhatDoesNotFitTheHistory) {
  expect_refused(next(Founded{full_cell(2)}, 2));  // ids are dense
  expect_refused(next(Founded{full_cell(1)}, 2));  // subject and cell differ
  colony_.apply(next(Founded{full_cell(1)}, 1, 5.0));
  Event event = next(Senesced{}, 1, 6.0);
  event.seq += 1;
  expect_refused(event);  // a gap
  event.seq -= 2;
  expect_refused(event);                     // a repeat
  expect_refused(next(Senesced{}, 1, 4.9));  // back in time
  event = next(Senesced{}, 1, 6.0);
  event.digest.bytes[7] ^= 1;
  expect_refused(event);                     // another chain
  expect_refused(next(Senesced{}, 2, 6.0));  // unknown subject
  expect_refused(next(Inhibited{}, 0, 6.0));
  event = next(Senesced{}, 1, 6.0);
  event.cell_id.reset();
  event.digest = digest_after(colony_.digest(), event);
  expect_refused(event);                                           // no subject
  expect_refused(next(Finished{FinishReason::kTime, 2}, 0, 6.0));  // a wrong count of cells
  Divided divided;
  divided.cells = {full_cell(1), full_cell(2)};
  divided.cells[0].ordinal = 2;
  divided.cells[1].parent_id = CellId{1};
  Divided wrong = divided;
  wrong.cells[1].id = CellId{3};
  expect_refused(next(wrong, 1, 6.0));  // the daughter's id is not the next
  wrong = divided;
  wrong.cells[0].ordinal = 1;
  expect_refused(next(wrong, 1, 6.0));  // the parent's ordinal did not rise
  wrong = divided;
  wrong.cells[1].parent_id.reset();
  expect_refused(next(wrong, 1, 6.0));
  colony_.apply(next(divided, 1, 6.0));
  EXPECT_EQ(colony_.cells().size(), 2U);
}

}  // namespace
}  // namespace colony
