// decide: what happens when something is due. Random and expensive; changes nothing: the event is applied afterwards.
// Random:  streams of the subject cell and its ordinal only.        Threads: pure.
// Reach:   a decision reads bodies whose box meets the square of search_reach_um about the nucleus (search), their neighbours (only
//          with neighbour_retained_min), and those within free_radius_um of sleepers there; it writes the subject, its daughter and
//          the sleepers it wakes.
// Source:  the paper, section 4; readings in engine/DESIGN.md.
#pragma once

#include "engine/base/stop.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"
#include "engine/model/params.hpp"
#include "engine/random/stream.hpp"

namespace colony {

/// The body of the event for a division attempt of `id` at `time_h`: Divided, Inhibited or Senesced.
/// Throws Stopped when asked to.
EventBody decide_division(const Colony& colony, const Params& params, Seed seed, CellId id, double time_h,
                          StopFlag stop = nullptr);

/// The nucleus of `id` comes to rest: Settled.
EventBody decide_settling(const Colony& colony, const Params& params, Seed seed, CellId id);

}  // namespace colony
