#include "server/api/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace colony::server::api {
namespace {

// Preset `paper`, as this engine grows it: a colony doubles each cycle up to about 12 cells; from then on sqrt(cells)
// grows by about 0.75 a cycle (12 cells at 50 h, 61 at 120 h, 314 at 275 h, 1,000 at 503 h). Confluent cells stand at
// about 0.009 per um2. The generation limit g ends a lone colony near (0.81 g)^2 cells (about 1,060 for g = 40). A
// division takes 2.4 searches on average.
constexpr double kCellsExponential = 12.0;
constexpr double kRootGain = 0.75;
constexpr double kCellsPerGeneration = 0.81;
constexpr double kDensity_per_um2 = 0.009;
constexpr double kWallPerSearch_s = 2.0e-3;  // at the evaluations and points of preset `paper`
constexpr double kSearchesPerCell = 2.4;
constexpr double kEvaluations = 32.0 * 8.0 * 256.0;
constexpr double kMemoryPerCell = 1500.0, kMemoryBase = 30e6;
constexpr double kStoredPerCell = 3000.0;
// Of a move tried: it looks at the surroundings of its neighbours and is stored with its cell, made or not. A colony of linear radius
// has a third of its last cells on average.
constexpr double kWallPerMove_s = 0.25e-3, kStoredPerMove = 500.0, kMeanOfLastCells = 1.0 / 3.0;

double cells_of_colony(double cycles) {
  const double exponential_cycles = std::log2(kCellsExponential);
  if (cycles <= exponential_cycles) return std::exp2(cycles);
  const double root = std::sqrt(kCellsExponential) + kRootGain * (cycles - exponential_cycles);
  return root * root;
}

}  // namespace

Estimate estimate(const RunSpec& spec) {
  const Params& p = spec.params;
  const double founders = p.founders.positions_um.empty() ? static_cast<double>(p.founders.count)
                                                          : static_cast<double>(p.founders.positions_um.size());
  double ceiling = static_cast<double>(spec.until.cells.value_or(std::uint64_t{1} << 32));
  if (p.dish.radius_um)
    ceiling = std::min(ceiling, std::numbers::pi * *p.dish.radius_um * *p.dish.radius_um * kDensity_per_um2);
  if (p.division.generation_limit) {
    const double limit = static_cast<double>(*p.division.generation_limit);
    const double inhibited = std::max(kCellsExponential, kCellsPerGeneration * kCellsPerGeneration * limit * limit);
    ceiling = std::min(ceiling,
                       founders * (p.division.inhibition ? std::min(std::exp2(limit), inhibited) : std::exp2(limit)));
  }
  const auto cells_at = [&](double time_h) {
    const double cycles = time_h / p.cycle.mean_h;
    return founders * (p.division.inhibition ? cells_of_colony(cycles) : std::exp2(std::min(cycles, 60.0)));
  };
  Estimate out;
  const double bound_h = spec.until.time_h.value_or(1e6);
  double low_h = 0.0, high_h = bound_h;
  if (cells_at(bound_h) > ceiling) {
    for (int i = 0; i < 60; ++i) (cells_at((low_h + high_h) / 2) < ceiling ? low_h : high_h) = (low_h + high_h) / 2;
  }
  out.time_h = high_h;
  const double cells = std::max(1.0, std::min(cells_at(high_h), ceiling));
  out.cells = static_cast<std::uint64_t>(std::llround(cells));
  const double generations = static_cast<double>(p.search.generations + p.search.corrector_generations);
  const double evaluations = static_cast<double>(p.search.population * p.search.points) * (1.0 + generations / 2.0);
  out.wall_s = cells * kSearchesPerCell * kWallPerSearch_s * std::max(0.1, evaluations / kEvaluations);
  const double moves = p.motility.rate_per_h * out.time_h * cells * kMeanOfLastCells;
  out.wall_s += moves * kWallPerMove_s;
  out.memory_bytes = static_cast<std::uint64_t>(kMemoryBase + cells * kMemoryPerCell);
  out.stored_bytes = static_cast<std::uint64_t>(cells * kStoredPerCell + moves * kStoredPerMove);
  out.basis =
      "growth law of preset paper (doubling, then linear radius) scaled by cycle.mean_h; fixed cost per search on one "
      "core of 2024; expect a factor of three either way, more for unusual models";
  return out;
}

Json encode_estimate(const Estimate& estimate) {
  return {{"cells", estimate.cells},
          {"time_h", estimate.time_h},
          {"wall_s", estimate.wall_s},
          {"memory_bytes", estimate.memory_bytes},
          {"stored_bytes", estimate.stored_bytes},
          {"basis", estimate.basis}};
}

}  // namespace colony::server::api
