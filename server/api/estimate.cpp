#include "server/api/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace colony::server::api {
namespace {

/// The law of growth: a colony doubles each cycle up to about so many cells; from then on sqrt(cells) gains so much a cycle.
/// The generation limit g ends a lone colony near (share g)^2 cells. Confluent cells stand this dense.
struct Growth {
  double cells_exponential = 12.0;
  double root_gain_per_cycle = 0.0;
  double root_cells_per_generation = 0.0;
  double density_per_um2 = 0.0;
  double searches_per_cell = 0.0;
};
// Preset paper: 12 cells at 50 h, 61 at 120 h, 314 at 275 h, 1,000 at 503 h; about 1,060 at the end for g = 40.
constexpr Growth kMono = {12.0, 0.75, 0.81, 0.009, 2.4};
// Preset tumour: 13 cells at 47 h, 63 at 94 h, 316 at 205 h, 1,066 at 361 h, 5,000 at 726 h; about 2,070 at the end for g = 40.
constexpr Growth kMulti = {12.0, 1.15, 1.14, 0.020, 4.5};
// Moves make room: preset young-colony (0.1 1/h) has 2,000 cells at 471 h.
constexpr double kMoveRate_per_h = 0.1, kMoveRootGain = 0.41;

/// What is measured, and nothing else: to recalibrate, run colony-service-bench estimate and put the new figures here and above.
struct Calibration {
  // CPU time on one thread, about the same with layers: so much a search at the evaluations (candidate pairs times points) that one of preset
  // `paper` is allowed by the formula below. Searches end early, so it grows with their root only, from a fixed part on.
  double wall_per_search_s = 0.18e-3;
  double evaluations_per_search = 32.0 * 9.0 * 256.0;
  double fixed_share = 0.35;
  double searches_per_young_cell = 0.7;  // while a colony grows exponentially: one a division, and found at once
  // A move tried looks at its neighbours' surroundings, and is stored with its cell, made or not.
  double wall_per_move_s = 65e-6;
  double stored_per_move_bytes = 400.0;
  // What the service adds to a cell (writing, announcing), and each further thread to the speed of the first.
  double wall_per_cell_service_s = 60e-6;
  double speed_per_thread = 0.65;
  // Peak memory of colonyd: itself, the colony, and what SQLite keeps of the pages it writes.
  double memory_base_bytes = 22e6;
  double memory_per_thread_bytes = 2e6;
  double memory_per_cell_bytes = 480.0;
  double memory_per_stored_byte = 1.8;
  double memory_of_pages_max_bytes = 80e6;
  double stored_base_bytes = 80e3;
  double stored_per_cell_bytes = 1200.0;
};
constexpr Calibration kMeasured;

Growth growth_of(const Params& p) {
  Growth growth = p.layers == Layers::kMulti ? kMulti : kMono;
  growth.root_gain_per_cycle += kMoveRootGain * std::min(1.0, p.motility.rate_per_h / kMoveRate_per_h);
  return growth;
}

double cells_of_colony(const Growth& growth, double cycles) {
  const double exponential_cycles = std::log2(growth.cells_exponential);
  if (cycles <= exponential_cycles) return std::exp2(cycles);
  const double root =
      std::sqrt(growth.cells_exponential) + growth.root_gain_per_cycle * (cycles - exponential_cycles);
  return root * root;
}

}  // namespace

Estimate estimate(const RunSpec& spec, int threads) {
  const Params& p = spec.params;
  const Growth growth = growth_of(p);
  const double founders = p.founders.positions_um.empty() ? static_cast<double>(p.founders.count)
                                                          : static_cast<double>(p.founders.positions_um.size());
  double ceiling = static_cast<double>(spec.until.cells.value_or(std::uint64_t{1} << 32));
  if (p.dish.radius_um)
    ceiling = std::min(ceiling, std::numbers::pi * *p.dish.radius_um * *p.dish.radius_um * growth.density_per_um2);
  if (p.division.generation_limit) {
    const double limit = static_cast<double>(*p.division.generation_limit);
    const double inhibited =
        std::max(growth.cells_exponential,
                 growth.root_cells_per_generation * growth.root_cells_per_generation * limit * limit);
    ceiling = std::min(ceiling,
                       founders * (p.division.inhibition ? std::min(std::exp2(limit), inhibited) : std::exp2(limit)));
  }
  const auto cells_at = [&](double time_h) {
    const double cycles = time_h / p.cycle.mean_h;
    return founders * (p.division.inhibition ? cells_of_colony(growth, cycles) : std::exp2(std::min(cycles, 60.0)));
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
  const double search_s =
      kMeasured.wall_per_search_s *
      (kMeasured.fixed_share + (1.0 - kMeasured.fixed_share) * std::sqrt(evaluations / kMeasured.evaluations_per_search));
  // Of each colony the first cells are young ones.
  const double young = p.division.inhibition ? std::min(cells, founders * growth.cells_exponential) : cells;
  const double searches = young * kMeasured.searches_per_young_cell + (cells - young) * growth.searches_per_cell;
  // A colony of linear radius has a third of its last cells on average.
  const double moves = p.motility.rate_per_h * out.time_h * cells / 3.0;
  const double one_thread_s =
      searches * search_s + moves * kMeasured.wall_per_move_s + cells * kMeasured.wall_per_cell_service_s;
  out.wall_s = one_thread_s / (1.0 + kMeasured.speed_per_thread * (threads - 1));
  const double stored = kMeasured.stored_base_bytes + cells * kMeasured.stored_per_cell_bytes + moves * kMeasured.stored_per_move_bytes;
  out.stored_bytes = static_cast<std::uint64_t>(stored);
  out.memory_bytes = static_cast<std::uint64_t>(
      kMeasured.memory_base_bytes + kMeasured.memory_per_thread_bytes * threads + cells * kMeasured.memory_per_cell_bytes +
      std::min(stored * kMeasured.memory_per_stored_byte, kMeasured.memory_of_pages_max_bytes));
  out.basis = p.layers == Layers::kMulti
                  ? "growth law of preset tumour (doubling, then linear radius) scaled by cycle.mean_h; cost of searches on cores of 2024, "
                    "nothing else running; within a factor of 2 for presets, more for unusual models or poor searches"
                  : "growth law of preset paper (doubling, then linear radius) scaled by cycle.mean_h, faster with moves; cost of searches on "
                    "cores of 2024, nothing else running; within a factor of 2 for presets, more for unusual models or poor searches";
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
