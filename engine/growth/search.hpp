// search: free space for the two cells of a division, by a genetic search that minimises interpenetration.
// Method:  predictor: a genetic algorithm over the full ranges; corrector: slight changes of its best, if that is not good; the
//          winner is scored again on fresh points, because the best of many noisy scores is biased upward.
// Units:   fitness in [0, 1] = share of a new cell's volume outside its neighbours; of a pair, the smaller of the two.
// Shapes:  search.points and search.points_final points; one scrambled set for all candidates of a search.
// Random:  Purpose::kSearch (lane = generation), kSearchPoints, kFinalPoints, kRetained; all by (cell, ordinal).
// Threads: pure. Candidates are scored into slots; selection is serial and breaks ties by the lower index.
// Source:  the paper, section 4.3; readings in engine/DESIGN.md.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/base/stop.hpp"
#include "engine/growth/chromosome.hpp"
#include "engine/growth/workspace.hpp"
#include "engine/model/colony.hpp"
#include "engine/random/sobol.hpp"

namespace colony {

struct SearchTask {
  Seed seed = 1;
  CellId cell_id;               // the dividing cell: not a neighbour of its own daughters
  std::uint32_t ordinal = 0;
  PairFrame frame;
  bool racing = true;           // false: every candidate is scored on all points, for tests of what giving candidates up costs
};

struct SearchResult {
  Pair pair;                    // the winner
  double fitness = 0.0;         // on the fresh points (the first kLookPoints of them where the pair fails by far)
  double search_fitness = 0.0;  // on the points of the search
  std::uint32_t evaluation_count = 0;
  bool corrected = false;
  bool crosses_wall = false;    // the winner reaches beyond the dish (on the fresh points): nothing better was found
  bool supported = true;        // with several layers, on the fresh points (support.hpp); if not, the fitness is 0
};

/// `workspace` must be made from the same parameters; its overlap.work grows by what the search takes. Throws Stopped when asked to (looked at before every generation).
SearchResult find_space(const Colony& colony, const Params& params, const SearchTask& task, Workspace& workspace,
                        StopFlag stop = nullptr);
/// The same with a workspace of its own.
SearchResult find_space(const Colony& colony, const Params& params, const SearchTask& task, StopFlag stop = nullptr);

/// Share of its own volume that `cell_id` keeps beside its neighbours (without `excluded`, with `added`): hits of f~ over hits of f.
/// 1 for a body without hits.
double retained_share(const Colony& colony, ContactRule rule, CellId cell_id, std::optional<CellId> excluded,
                      std::span<const Body* const> added, const PointSet& points);

}  // namespace colony
