// scorer: how well a candidate pair fits among the cells about it: on the points of the search, fast, and on fresh points, by the fields.
// Method:  pair_kernel over common points and voxels; candidates are given up once they cannot beat the best (race_to).
// Units:   fitness in [0, 1].
// Random:  Purpose::kSearchPoints, kFinalPoints, kRetained of the dividing cell and its ordinal.
// Threads: one search at a time; score_all may use the threads of the caller's oneTBB arena.
// Source:  the paper, 4.1 and 4.3; readings in engine/DESIGN.md.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "engine/growth/search.hpp"
#include "engine/growth/support.hpp"

namespace colony {

/// The points of a search in the unit cube, in the order of the sequence: every prefix is a fair sample. The cube about the unit frame is 1.3
/// to 1.5 times the body's own box above the dish, which search.points is about: half as many more, so that no fewer fall inside.
void search_points(const Params& params, const std::array<std::uint32_t, 3>& seeds, PointSet& out);
/// With the next three words of `stream` as seeds.
PointSet search_points(const Params& params, Stream& stream);

/// Scores candidate pairs of one search.
class Scorer {
 public:
  Scorer(const Colony& colony, const Params& params, const SearchTask& task, Workspace& workspace);
  /// From here on a candidate is given up once it cannot beat `best` any more: after h hits, when more are shared than
  ///     h (1 - best) + kDropDeviations sqrt(h best (1 - best)) + 1/2.
  /// A candidate whose true fitness is `best` shares a binomial number with mean h (1 - best) (Sobol points vary less), so it is given
  /// up with probability below 2.3 % at each of the two looks; one that would be better by d is safer by d sqrt(h / best (1 - best)).
  void race_to(double best);
  /// Scores every candidate without a score, on the points of the search. One that is given up gets a fitness below the best, one that
  /// nothing holds up 0.
  void score_all(std::vector<Candidate>& candidates);
  /// On the fresh points, by the definition.
  double score_finally(const Pair& pair, bool& crosses_wall, bool& supported);

 private:
  // Of a pair, on ws_.final_points. Also fills footings_.
  double fitness_of(const std::array<Body, 2>& bodies, bool& crosses_wall);
  // About 1.5 ns a point of the search and candidate; asking neighbours what they keep costs far more. Handing work to a thread costs some
  // microseconds: at the defaults (32 candidates of 256 points, 10 us) it would only cost.
  bool is_worth_threads(std::size_t candidate_count) const;
  double score(const Chromosome& chromosome, std::array<kernel::CandidateBody, 2>& candidate, kernel::CountWork& work);
  // The voxels know how many older cells hold a point, not which: in the search they hold a body up together.
  Footing footing(const kernel::PairScore& score, const std::array<kernel::CandidateBody, 2>& candidate, std::size_t k) const;
  // Puts into the voxels every neighbour that a body of this reach can meet.
  void cover(float reach_um);
  bool neighbours_keep_enough(const std::array<Body, 2>& bodies);

  const Colony& colony_;
  const Params& params_;
  const SearchTask& task_;
  Workspace& ws_;
  bool racing_ = false;
  std::array<Footing, 2> footings_;
  std::size_t covered_ = 0;   // of by_gap: those in the voxels
};

}  // namespace colony
