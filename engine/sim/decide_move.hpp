// decide_move: an amoeboid move, or that a cell could not make it. Random; changes nothing: the event is applied afterwards.
// Method:  a step of motility.step_um in the plane, in a uniformly random direction or (probability `bias`) towards the freer half of
//          the surroundings; the body moves rigidly, and only if its fitness at the new place is at least contact.fitness_min.
// Units:   um, h.
// Random:  Purpose::kMove, kMoveSurroundings, kMovePoints, kMoveDelay, kFreeShare of the subject cell and its ordinal only.
// Threads: pure.
// Reach:   squares about the cell's centre (half side, um, by axis); R = wake.free_radius_um:
//          - it reads the body of every cell whose box meets move_read_reach_um: the new body's neighbours lie within
//            move_body_reach_um, the surroundings that choose the direction within R, the sleepers that a changed body may wake have
//            their centres within move_wake_reach_um, and each of them looks R further. Of cells whose centre lies within
//            move_wake_reach_um it also reads the state (activity, due time, share, ordinal);
//          - it writes a body, its own, that stays within move_body_reach_um before and after, and the state of sleepers whose
//            centres lie within move_wake_reach_um.
// Source:  the paper's young colonies, whose cells "stand almost separately"; every rule is ours (engine/DESIGN.md).
#pragma once

#include "engine/growth/workspace.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/params.hpp"
#include "engine/random/stream.hpp"
#include "engine/sim/decide.hpp"

namespace colony {

/// What becomes of `id`, whose move is due at `time_h`: Moved, with the cell's complete new state. A move that is not made is a Moved
/// as well, because its next due time is a fact: then only ordinal, move_due_h and, for a sleeper, free_share differ, and nobody wakes.
Decision decide_move(const Colony& colony, const Params& params, Seed seed, CellId id, double time_h, Workspace& workspace);

/// Time from now to a cell's next move, h: move_delay_min_h plus an exponential time, so that the mean is 1 / rate_per_h.
/// `motility.rate_per_h` must be above 0 (CHECKed).
double draw_move_delay_h(const MotilityParams& motility, Stream& stream);

/// A cell's own body, before and after a move, lies within this distance (per axis x, y) of its centre before it, um.
double move_body_reach_um(const Params& params);
/// Every sleeper whose state a move may write has its centre within this distance (per axis), um.
double move_wake_reach_um(const Params& params);
/// A move reads no body whose box lies wholly beyond this distance (per axis), um.
double move_read_reach_um(const Params& params);

}  // namespace colony
