// workspace: buffers and tables that deciding keeps from one event to the next, so that nothing is allocated in the loop.
// Contents never influence a result: a fresh workspace gives the same bytes.
// Threads: one per worker, used by one thread at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/types.hpp"
#include "engine/model/params.hpp"

namespace colony {

/// What deciding took.
struct Work {
  std::uint64_t search_count = 0;
  std::uint64_t candidate_count = 0;    // candidate pairs, scored wholly or in part
  std::uint64_t field_count = 0;        // evaluations of one body's field at one point
  std::uint64_t noise_count = 0;        // of those, how many needed the noise
  Work& operator+=(const Work& other) {
    search_count += other.search_count;
    candidate_count += other.candidate_count;
    field_count += other.field_count;
    noise_count += other.noise_count;
    return *this;
  }
};

struct Workspace {
  explicit Workspace(const Params&) {}
  std::vector<CellId> ids;
};

}  // namespace colony
