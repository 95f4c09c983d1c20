// runs: colonies grown by the simulator, with their histories, and the way to name one in a failure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/sim/simulator.hpp"

namespace colony::testing {

struct Run {
  Simulator simulator;
  std::vector<Event> events;
  const Colony& colony() const { return simulator.colony(); }
  const Finished& finished() const { return std::get<Finished>(events.back().body); }
};

inline RunSpec spec_of(Seed seed, std::uint64_t cells, Params params = {}) {
  RunSpec spec;
  spec.seed = seed;
  spec.params = std::move(params);
  spec.until.cells = cells;
  return spec;
}

/// To the end.
inline Run run(const RunSpec& spec) {
  Run out{Simulator(spec), {}};
  while (std::optional<Event> event = out.simulator.step()) out.events.push_back(std::move(*event));
  return out;
}

inline std::string name_of_run(const RunSpec& spec) {
  return "seed " + std::to_string(spec.seed) +
         (spec.until.cells ? " to " + std::to_string(*spec.until.cells) + " cells" : "") +
         (spec.until.time_h ? " to " + std::to_string(*spec.until.time_h) + " h" : "");
}

/// All other bodies whose boxes meet that of `id`.
inline std::vector<const Body*> neighbours_of(const Colony& colony, CellId id) {
  std::vector<const Body*> bodies;
  for (const Cell& other : colony.cells()) {
    if (other.id != id && meets(colony.body(other.id).box(), colony.body(id).box()))
      bodies.push_back(&colony.body(other.id));
  }
  return bodies;
}

}  // namespace colony::testing
