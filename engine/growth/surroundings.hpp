// surroundings: how much room there is around a resting cell, and which sleepers a change wakes.
// Method:  share of a disc of free_radius_um about the cell's centre that no body's noise-free projection covers (its own
//          included), estimated on those of kFreeSharePoints scrambled Sobol points of its square that lie in it; with layers, share of
//          the ball above the dish that no noise-free body covers. While a cell sleeps its ordinal does not change, so
//          every later estimate uses the same points as the recorded one: a growth is a change of the colony, not of the sample.
// Units:   um; shares in [0, 1].
// Random:  Purpose::kFreeShare by (cell, ordinal).        Threads: pure.
// Source:  ours; part of the model, not an optimisation (engine/DESIGN.md).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/model/colony.hpp"
#include "engine/random/stream.hpp"
#include "engine/space/overlap_kernel.hpp"

namespace colony {

inline constexpr std::uint32_t kFreeSharePoints = 512;

/// A change of the colony that is about to be applied: `gone` is replaced by `bodies`.
struct BodyChange {
  std::optional<CellId> gone;
  std::span<const Body> bodies;
};

/// Free share around `cell` (its centre), on the points of `ordinal`, as it will be after `change`. Here and below: `work`, if any, grows
/// by what it takes.
double free_share(const Colony& colony, const Params& params, Seed seed, const Cell& cell, std::uint32_t ordinal,
                  const BodyChange& change, kernel::CountWork* work = nullptr);

/// The sleeping cells (passive, nothing due) with a changed body within free_radius_um of their centre (distance to its box, in the plane
/// or, with layers, in space), except `change.gone`, whose surroundings gained room by wake.gain (rule `share`) or at all events (rule `always`). Ascending.
std::vector<Woken> wake_sleepers(const Colony& colony, const Params& params, Seed seed, double time_h, const BodyChange& change,
                                 kernel::CountWork* work = nullptr);

}  // namespace colony
