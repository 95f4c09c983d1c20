#include "engine/sim/simulator.hpp"

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

}  // namespace

Simulator::Simulator(RunSpec spec, StopFlag stop, int threads)
    : spec_(checked(std::move(spec))),
      stop_(stop),
      founder_count_(colony::founder_count(spec_.params.founders)),
      colony_(spec_.params),
      workspace_(spec_.params) {
  CHECK(threads >= 1);
  check_floating_point_mode();
}

void Simulator::replay(const Event& stored) {
  colony_.apply(stored);
  agenda_.follow(stored, colony_);
  window_.clear();
  next_ = 0;
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

  if (next_ == window_.size()) {
    agenda_.due_before(agenda_.first().due_h + spec_.params.window_h, window_);
    next_ = 0;
  }
  const AgendaItem item = window_[next_];
  // Nothing that happens inside a window makes anything due inside it: every delay is at least as long as the window. So the
  // window, fixed when it began, is the serial order whatever its length.
  CHECK(item == agenda_.first());
  Event event;
  event.time_h = item.due_h;
  event.cell_id = item.cell_id;
  Decision decision;
  switch (item.kind) {
    case DueKind::kSettle:
      decision = decide_settling(colony_, spec_.params, spec_.seed, item.cell_id, workspace_);
      break;
    case DueKind::kDivide:
      decision = decide_division(colony_, spec_.params, spec_.seed, item.cell_id, item.due_h, workspace_, stop_);
      break;
    case DueKind::kMove:
      decision = decide_move(colony_, spec_.params, spec_.seed, item.cell_id, item.due_h, workspace_);
      break;
  }
  work_ += decision.work;
  event.body = std::move(decision.body);
  ++next_;  // only now: a stopped decision is made again
  return commit(std::move(event));
}

}  // namespace colony
