#include "engine/sim/simulator.hpp"

#include <exception>
#include <mutex>
#include <string>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/base/float_mode.hpp"
#include "engine/sim/decide.hpp"
#include "engine/sim/decide_move.hpp"

namespace colony {
namespace {

RunSpec checked(RunSpec spec) {
  CHECK(validate(spec.params).empty());
  return spec;
}

// Items decided in one round, per thread: enough that waiting for the last is a small part of it, few enough that little is
// decided for nothing when the run ends, and that something is left to be decided beside the next item that everything
// waits for.
constexpr std::size_t kReadyPerThread = 32;
constexpr std::size_t kRefillBelow = Window::kLookAhead / 2;

std::string text_of(const AgendaItem& item) {
  const char* what = item.kind == DueKind::kSettle ? "settling" : item.kind == DueKind::kMove ? "move" : "division";
  return std::string("; deciding the ") + what + " of cell " + std::to_string(item.cell_id.value) + " due at " +
         std::to_string(item.due_h) + " h";
}

// On the calling thread, whose contexts a worker did not have.
[[noreturn]] void rethrow_here(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const CheckFailure& check) {
    throw CheckFailure(check.what() + failure_contexts());
  }
}

}  // namespace

Simulator::Simulator(RunSpec spec, StopFlag stop, int threads)
    : spec_(checked(std::move(spec))),
      stop_(stop),
      founder_count_(colony::founder_count(spec_.params.founders)),
      colony_(spec_.params),
      window_(spec_.params),
      crew_(threads),
      workspaces_(static_cast<std::size_t>(threads)) {
  check_floating_point_mode();
}

void Simulator::replay(const Event& stored) {
  colony_.apply(stored);
  agenda_.follow(stored, colony_);
  window_.clear();
}

Event Simulator::commit(Event event) {
  event.seq = colony_.last_seq() + 1;
  if (auto* divided = std::get_if<Divided>(&event.body)) {
    divided->cells[1].id = CellId{static_cast<std::uint32_t>(colony_.cells().size() + 1)};
  }
  canonicalise(event);
  event.digest = digest_after(colony_.digest(), event);
  colony_.apply(event);
  agenda_.follow(event, colony_);
  return event;
}

Event Simulator::finish(FinishReason reason) {
  Event event;
  event.time_h = colony_.time_h();
  if (reason == FinishReason::kTime) event.time_h = *spec_.until.time_h;
  event.body = Finished{reason, colony_.cells().size()};
  return commit(std::move(event));
}

std::optional<FinishReason> Simulator::reason_to_finish() const {
  if (spec_.until.cells && colony_.cells().size() >= *spec_.until.cells) return FinishReason::kCells;
  // Senescent cells may still crawl, for ever: nothing else can come of it, so the colony is at its end.
  if (colony_.count(Activity::kSenescent) == colony_.cells().size()) return FinishReason::kAllSenescent;
  if (agenda_.empty()) return FinishReason::kExhausted;
  if (spec_.until.time_h && agenda_.first().due_h > *spec_.until.time_h) return FinishReason::kTime;
  return std::nullopt;
}

std::optional<Event> Simulator::step() {
  if (colony_.finished()) return std::nullopt;
  throw_if_stopped(stop_);
  const std::size_t founded = colony_.last_seq();
  if (founded < founder_count_) {
    if (founders_.empty()) {
      Result<std::vector<Cell>> placed = place_founders(spec_, stop_);
      CHECK(bool(placed));  // tried before the spec became a job
      founders_ = std::move(*placed);
    }
    Event event;
    event.cell_id = founders_[founded].id;
    event.body = Founded{founders_[founded]};
    return commit(std::move(event));
  }
  if (const std::optional<FinishReason> reason = reason_to_finish()) return finish(*reason);

  if (window_.empty()) window_.refill(agenda_);
  // Nothing that happens makes anything due inside the horizon: so what is in front here is first in the agenda.
  CHECK(window_.first() == agenda_.first());
  if (!window_.first_outcome()) {
    check_floating_point_mode();
    if (crew_.size() > 1) {
      decide_ready();
    } else {
      auto outcome = std::make_unique<Outcome>();
      outcome->decision = decide(window_.first(), workspace_of(0));
      window_.first_outcome() = std::move(outcome);
    }
  }
  std::unique_ptr<Outcome>& outcome = window_.first_outcome();
  if (outcome->failure) {
    const std::exception_ptr failure = outcome->failure;
    window_.clear();  // whoever steps again decides again
    rethrow_here(failure);
  }
  Event event;
  event.time_h = window_.first().due_h;
  event.cell_id = window_.first().cell_id;
  event.body = std::move(outcome->decision.body);
  const Work work = outcome->decision.work;
  try {
    Event committed = commit(std::move(event));
    window_.pop(colony_);
    work_ += work;
    return committed;
  } catch (...) {
    window_.clear();
    throw;
  }
}

Workspace& Simulator::workspace_of(std::size_t worker) {
  std::unique_ptr<Workspace>& own = workspaces_[worker];
  if (!own) own = std::make_unique<Workspace>(spec_.params, crew_.size());
  return *own;
}

Decision Simulator::decide(const AgendaItem& item, Workspace& workspace) const {
  try {
    switch (item.kind) {
      case DueKind::kSettle: return decide_settling(colony_, spec_.params, spec_.seed, item.cell_id, workspace);
      case DueKind::kDivide:
        return decide_division(colony_, spec_.params, spec_.seed, item.cell_id, item.due_h, workspace, stop_);
      case DueKind::kMove: return decide_move(colony_, spec_.params, spec_.seed, item.cell_id, item.due_h, workspace);
    }
    CHECK(false && "no such kind");
  } catch (const CheckFailure& failure) {
    // Workers have no context of their own: the item says what to replay.
    throw CheckFailure(failure.what() + text_of(item));
  }
}

void Simulator::decide_ready() {
  // A small window follows the first item closely; a large one (a dish) is used up by half before the agenda is asked again.
  if (window_.size() < kRefillBelow) window_.refill(agenda_);
  const std::size_t count_max = kReadyPerThread * static_cast<std::size_t>(crew_.size());
  std::mutex mutex;  // guards window_ and stopped during the round
  bool stopped = false;
  const std::size_t ready_count = window_.begin_round(colony_, count_max, spec_.until.time_h);
  CHECK(ready_count > 0);

  // Why the outcome cannot depend on who finished first. Each decision is a pure function of (colony, item): it reads a
  // colony that nobody changes before the last of this round is done. And the colony it reads may lack earlier events, but
  // only such as do not conflict with it: none of them, decided or not, writes anything that it reads (conflict.cpp). So it
  // is the decision that the serial order would have made. Which items are decided in which round may differ from run to
  // run; committing in serial order, between rounds, makes that invisible: later items cannot matter, and nothing new comes
  // between (window.hpp).
  crew_.run(ready_count, [&](std::size_t worker) -> std::size_t {
    std::unique_lock lock(mutex);
    if (stopped) return 0;
    const Window::Number number = window_.take();
    const AgendaItem item = window_.item(number);
    lock.unlock();
    std::unique_ptr<Outcome> outcome = try_to_decide(item, workspace_of(worker));
    lock.lock();
    if (!outcome) {
      stopped = true;
      window_.give_back(number);
      return 0;
    }
    const std::size_t freed_count = window_.finish(colony_, number, std::move(outcome));
    return stopped ? 0 : freed_count;
  });
  const std::lock_guard lock(mutex);
  if (stopped) throw Stopped();
}

// None if it was stopped.
std::unique_ptr<Outcome> Simulator::try_to_decide(const AgendaItem& item, Workspace& workspace) const {
  auto outcome = std::make_unique<Outcome>();
  try {
    check_floating_point_mode();
    outcome->decision = decide(item, workspace);
    outcome->writes = window_.bounds().writes(colony_, item, outcome->decision.body);
  } catch (const Stopped&) {
    return nullptr;
  } catch (...) {
    // Kept until its turn: which of several fails first is the serial order's choice. Until then it counts as writing all
    // it may.
    outcome->failure = std::current_exception();
    outcome->writes = window_.bounds().writes(colony_, item);
  }
  return outcome;
}

}  // namespace colony
