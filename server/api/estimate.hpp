// estimate: what a job will roughly cost, before it runs.
// Method:  the measured growth law of a lone colony (exponential, then linear radius) in units of the mean cycle, bounded by the spec; a cost
//          per search and per move. Within a factor of two for the presets (colony-service-bench estimate), and `basis` says so.
// Threads: pure.
#pragma once

#include <cstdint>
#include <string_view>

#include "engine/sim/simulator.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

struct Estimate {
  std::uint64_t cells = 0;  // at the end
  double time_h = 0.0;      // model time at the end
  double wall_s = 0.0;
  std::uint64_t memory_bytes = 0;
  std::uint64_t stored_bytes = 0;
  std::string_view basis;  // where the figures come from
};

/// `threads`: on which the job decides.
Estimate estimate(const RunSpec& spec, int threads = 1);
Json encode_estimate(const Estimate& estimate);

}  // namespace colony::server::api
