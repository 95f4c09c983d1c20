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

/// What is measured, and nothing else: to recalibrate, grow the presets and put the new figures here and above.
struct Calibration {
  // colony-bench, one thread, about the same with layers: wall_s / divisions / searches_per_division at the evaluations (candidate
  // pairs times points) that a search of preset `paper` is allowed by the formula below.
  double wall_per_search_s = 0.18e-3;
  double evaluations_per_search = 32.0 * 8.0 * 256.0;
  double evaluations_share_min = 0.1;  // a search of no evaluations has this part of the cost all the same
  // A move tried looks at its neighbours' surroundings, and is stored with its cell, made or not.
  double wall_per_move_s = 30e-6;
  double stored_per_move_bytes = 500.0;
  // What the service adds to a cell (writing, announcing), and what a second thread and each further one adds to the speed and costs in CPU.
  double wall_per_cell_service_s = 60e-6;
  double speed_per_thread = 0.65;
  // Peak memory of colonyd, and database_MB of colony-service-bench.
  double memory_base_bytes = 30e6;
  double memory_per_cell_bytes = 1500.0;
  double stored_per_cell_bytes = 1500.0;
};
constexpr Calibration kMeasured;

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
  const Growth& growth = p.layers == Layers::kMulti ? kMulti : kMono;
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
  // A colony of linear radius has a third of its last cells on average.
  const double moves = p.motility.rate_per_h * out.time_h * cells / 3.0;
  const double one_thread_s = cells * growth.searches_per_cell * kMeasured.wall_per_search_s *
                   std::max(kMeasured.evaluations_share_min, evaluations / kMeasured.evaluations_per_search) +
               moves * kMeasured.wall_per_move_s + cells * kMeasured.wall_per_cell_service_s;
  out.wall_s = one_thread_s / (1.0 + kMeasured.speed_per_thread * (threads - 1));
  out.memory_bytes = static_cast<std::uint64_t>(kMeasured.memory_base_bytes + cells * kMeasured.memory_per_cell_bytes);
  out.stored_bytes = static_cast<std::uint64_t>(cells * kMeasured.stored_per_cell_bytes + moves * kMeasured.stored_per_move_bytes);
  out.basis = p.layers == Layers::kMulti
                  ? "growth law of preset tumour (doubling, then linear radius) scaled by cycle.mean_h; fixed cost per search on one "
                    "core of 2024; expect a factor of three either way, more for unusual models"
                  : "growth law of preset paper (doubling, then linear radius) scaled by cycle.mean_h; fixed cost per search on one "
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
