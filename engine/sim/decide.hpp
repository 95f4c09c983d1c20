// decide: what happens when something is due. Random and expensive; changes nothing: the event is applied afterwards.
// Random:  streams of the subject cell and its ordinal only.        Threads: pure.
// Reach:   a decision reads bodies whose box meets the square of search_reach_um about the nucleus (search), their neighbours (only
//          with neighbour_retained_min), and those within free_radius_um of sleepers there; it writes the subject, its daughter and
//          the sleepers it wakes.
// Source:  the paper, section 4; readings in engine/DESIGN.md.
#pragma once

#include "engine/base/stop.hpp"
#include "engine/growth/search.hpp"
#include "engine/growth/workspace.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"
#include "engine/model/params.hpp"
#include "engine/random/stream.hpp"

namespace colony {

/// What happens, and what it took to find out (shown by benchmarks; no part of any event).
struct Decision {
  EventBody body;
  Work work;
};

/// What a division attempt of `id` asks of the search (for benchmarks that ask others of it too).
SearchTask search_task(const Colony& colony, const Params& params, Seed seed, CellId id, Workspace& workspace);

/// A division attempt of `id` at `time_h`: Divided, Inhibited or Senesced. The daughter's id is left 0: it is given when the
/// event is committed, in serial order. Throws Stopped when asked to.
Decision decide_division(const Colony& colony, const Params& params, Seed seed, CellId id, double time_h, Workspace& workspace,
                         StopFlag stop = nullptr);

/// The nucleus of `id` comes to rest: Settled.
Decision decide_settling(const Colony& colony, const Params& params, Seed seed, CellId id, Workspace& workspace);

}  // namespace colony
