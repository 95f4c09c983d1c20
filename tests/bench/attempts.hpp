// attempts: the division attempts of growing colonies, as the simulator sees them, for comparing searches on what they
// really meet.
// Threads: pure.
#pragma once

#include <optional>
#include <variant>

#include "engine/sim/decide.hpp"
#include "engine/sim/simulator.hpp"

namespace colony::bench {

/// Calls attempt(colony, task) before every attempt of the history of `spec`, with the colony as that attempt finds it, and
/// result(event) after it with what the engine itself came to.
template <class Attempt, class Result>
void for_each_attempt(const RunSpec& spec, Attempt&& attempt, Result&& result) {
  Simulator simulator(spec);
  Workspace workspace(spec.params);
  const std::uint64_t founders = founder_count(spec.params.founders);
  while (true) {
    const Colony& colony = simulator.colony();
    bool asked = false;
    if (colony.last_seq() >= founders && !simulator.agenda().empty()) {
      const AgendaItem item = simulator.agenda().first();
      const auto limit = spec.params.division.generation_limit;
      asked = item.kind == DueKind::kDivide && !(limit && colony.cell(item.cell_id).generation >= *limit);
      if (asked) attempt(colony, search_task(colony, spec.params, spec.seed, item.cell_id, workspace));
    }
    const std::optional<Event> event = simulator.step();
    if (!event || std::holds_alternative<Finished>(event->body)) return;
    if (asked) result(*event);
  }
}

}  // namespace colony::bench
