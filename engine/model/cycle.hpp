// cycle: times between divisions.
// Method:  normal truncated at +-3 sd (by rejection) or uniform; siblings correlated through a common Gaussian component.
// Units:   h.        Random: Purpose::kCycle, kRetry.        Threads: pure.
// Source:  the paper, section 4.2 ("every 12 +- 2 h"); truncation, and the reading of +-2 as sd or half range, are ours.
#pragma once

#include <array>

#include "engine/model/params.hpp"
#include "engine/random/stream.hpp"

namespace colony {

/// One cycle, from `stream` on.
double draw_cycle_h(const CycleParams& cycle, Stream& stream);

/// The next cycles of the cell that keeps the id (lane 0) and of the daughter (lane 1) of a division of `parent`.
/// cycle.sibling_correlation is Pearson's correlation of the two (exact for uniform, before truncation for normal).
std::array<double, 2> draw_sibling_cycles_h(const CycleParams& cycle, Seed seed, CellId parent, std::uint32_t ordinal);

}  // namespace colony
