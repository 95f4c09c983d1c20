// no_simulator: stand-ins for the two functions of the simulator that the codec of a spec names, so that its fuzzer need not build the simulator.
// What they cannot say is not asked: decoding never places a founder.
#include <cstdlib>

#include "engine/sim/simulator.hpp"

namespace colony {

std::uint64_t founder_count(const FounderParams& founders) {
  return founders.positions_um.empty() ? static_cast<std::uint64_t>(founders.count) : founders.positions_um.size();
}

Result<std::vector<Cell>> place_founders(const RunSpec&, StopFlag) { std::abort(); }

}  // namespace colony
