// workspace: buffers and tables that deciding keeps from one event to the next, so that nothing is allocated in the loop.
// Contents never influence a result: a fresh workspace gives the same bytes.
// Threads: one per worker, used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/growth/candidate.hpp"
#include "engine/growth/chromosome.hpp"
#include "engine/model/params.hpp"
#include "engine/random/sobol.hpp"
#include "engine/space/overlap.hpp"
#include "engine/space/pair_kernel.hpp"
#include "engine/space/voxels.hpp"

namespace colony {

/// What deciding took: searches, isolation tests, settlings, moves and free shares alike. Not counted: the placing of founders,
/// neighbour_retained_min (0 in every preset), and the few evaluations in double precision (a move's freer half). What is one
/// evaluation: see kernel::CountWork.
struct Work : kernel::CountWork {
  std::uint64_t search_count = 0;
  std::uint64_t candidate_count = 0;    // candidate pairs proposed; one that is its parent again keeps the score
  std::uint64_t move_field_count = 0;   // of field_count: moves, made or not
  Work& operator+=(const Work& other) {
    CountWork::operator+=(other);
    search_count += other.search_count;
    candidate_count += other.candidate_count;
    move_field_count += other.move_field_count;
    return *this;
  }
};

/// A candidate pair of a search.
struct Candidate {
  Chromosome chromosome;
  double fitness = 0.0;                 // of a candidate that was given up: on the points looked at, and below the best
};

struct Workspace {
  /// Tables for searches with these parameters, and only with these. `threads` > 1: a generation that is worth it is scored by as many
  /// (of the caller's oneTBB arena).
  explicit Workspace(const Params& params, int threads = 1);

  // Fixed after construction.
  int threads;
  GeneTables genes;
  BitFlips mutation;
  BitFlips correction;                  // of the low bits of all genes

  // Buffers.
  std::vector<CellId> ids;
  std::vector<const Body*> bodies;      // of ids
  std::vector<const Body*> near;
  std::vector<Candidate> population, bred;
  kernel::SearchScene scene;
  VoxelCounts voxels;
  RasterCache rasters;
  std::array<kernel::CandidateBody, 2> candidate;
  std::vector<kernel::CountWork> work_of;             // a candidate, where threads score them
  std::vector<std::uint32_t> most_shared;
  std::vector<double> roots;                          // sqrt(0), sqrt(1), ...: what race_to needs again and again
  struct Neighbour {
    float gap_um = 0.0F;                // no candidate of less reach can meet it
    CellId id;
    const Body* body = nullptr;
  };
  std::vector<Neighbour> by_gap;        // ascending
  PointSet points, final_points, retained_points;
  OverlapScratch overlap;
  OverlapCounts counts;
};

}  // namespace colony
