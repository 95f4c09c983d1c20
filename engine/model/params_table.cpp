// The one table of parameters: validation, JSON, schema, documentation and --set are all made from it.
#include <array>
#include <numbers>

#include "engine/model/params.hpp"

namespace colony {
namespace {

template <class T>
int as_int(T value) {
  return static_cast<int>(value);
}

// Makes the accessor of an enum field from its path.
#define COLONY_ENUM(field, type, ...)                                                      \
  EnumAccess {                                                                             \
    [](const Params& p) { return as_int(p.field); },                                       \
        [](Params& p, int value) { p.field = static_cast<type>(value); }, { __VA_ARGS__ } \
  }
#define COLONY_FIELD(field, type) Access<type>([](Params& p) -> type& { return p.field; })

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kLimitless = 1e6;

const std::vector<ParamInfo>& table() {
  using Whole = std::int64_t;
  using MaybeWhole = std::optional<std::int64_t>;
  using MaybeReal = std::optional<double>;
  static const std::vector<ParamInfo> rows = {
      {"cycle.distribution", "", 0, 0, false, "distribution of the time between divisions",
       COLONY_ENUM(cycle.distribution, CycleDistribution, "normal", "uniform")},
      {"cycle.mean_h", "h", 3, 200, false, "mean time between divisions of a cell with an open boundary",
       COLONY_FIELD(cycle.mean_h, double)},
      {"cycle.sd_h", "h", 0, 50, false, "normal: standard deviation, truncated at 3 of it; at most a quarter of mean_h",
       COLONY_FIELD(cycle.sd_h, double)},
      {"cycle.half_range_h", "h", 0, 200.0 / 3.0, false, "uniform: half the range; at most a third of mean_h",
       COLONY_FIELD(cycle.half_range_h, double)},
      {"cycle.sibling_correlation", "", 0, 0.9, false, "correlation of the cycle times of two siblings",
       COLONY_FIELD(cycle.sibling_correlation, double)},
      {"division.inhibition", "", 0, 0, false, "contact inhibition: no division without space for both cells",
       COLONY_FIELD(division.inhibition, bool)},
      {"division.generation_limit", "", 1, 1000, false, "most divisions down a lineage (Hayflick limit); null = none",
       COLONY_FIELD(division.generation_limit, MaybeWhole)},
      {"division.settle_h", "h", 0.1, 24, false, "time after a division at which the nucleus has settled",
       COLONY_FIELD(division.settle_h, double)},
      {"cell.pair_volume_um3", "um3", 50, 100000, false, "volume of the two cells of a division together, before deformation",
       COLONY_FIELD(cell.pair_volume_um3, Interval)},
      {"cell.smaller_share", "", 0.2, 0.5, false, "share of the smaller of the two in that volume",
       COLONY_FIELD(cell.smaller_share, Interval)},
      {"cell.elongation", "", 1, 3, false, "ratio of the horizontal semiaxes A/B", COLONY_FIELD(cell.elongation, Interval)},
      {"cell.flatness", "", 0.2, 1, false, "vertical semiaxis over the mean horizontal one, C/sqrt(AB)",
       COLONY_FIELD(cell.flatness, Interval)},
      {"cell.nucleus_radius_um", "um", 1, 7, false, "horizontal radius of the nucleus, which must fit the smallest cell; drawn for a founder, inherited",
       COLONY_FIELD(cell.nucleus_radius_um, Interval)},
      {"noise.amplitude", "", 0, 0.45, false, "amplitude a of Gardner's noise; at most 0.40 where frequency is above 5",
       COLONY_FIELD(noise.amplitude, double)},
      {"noise.frequency", "", 2, 8, false, "frequency q of the noise", COLONY_FIELD(noise.frequency, double)},
      {"noise.phase", "rad", 0, kTwoPi, false, "phase h of the noise", COLONY_FIELD(noise.phase, double)},
      {"contact.rule", "", 0, 0, false, "deformed cell: f minus the sum of the neighbours' max(0, f), or minus the largest",
       COLONY_ENUM(contact.rule, ContactRule, "sum", "max")},
      {"contact.fitness_min", "", 0, 1, false, "least share of a new cell's volume outside its neighbours",
       COLONY_FIELD(contact.fitness_min, double)},
      {"contact.fitness_good", "", 0, 1, false, "fitness at which a search ends early; at least fitness_min",
       COLONY_FIELD(contact.fitness_good, double)},
      {"contact.neighbour_retained_min", "", 0, 1, false, "least share a neighbour must keep of its volume; 0 = not asked",
       COLONY_FIELD(contact.neighbour_retained_min, double)},
      {"search.optimiser", "", 0, 0, false, "how free space is searched for",
       COLONY_ENUM(search.optimiser, Optimiser, "genetic", "random", "sobol")},
      {"search.population", "", 4, 256, false, "candidates of a generation", COLONY_FIELD(search.population, Whole)},
      {"search.generations", "", 0, 200, false, "most generations bred by the predictor after the first",
       COLONY_FIELD(search.generations, Whole)},
      {"search.corrector_generations", "", 0, 50, false, "generations of slight changes of the best, if it is not good",
       COLONY_FIELD(search.corrector_generations, Whole)},
      {"search.give_up_margin", "", 0.02, 1, false,
       "a search is given up when its best fitness lies below fitness_min by more than this after the first generation, shrinking to 0.02 after the last; null = never",
       COLONY_FIELD(search.give_up_margin, MaybeReal)},
      {"search.coding", "", 0, 0, false, "coding of a gene", COLONY_ENUM(search.coding, Coding, "gray", "binary")},
      {"search.bits", "bit", 4, 16, false, "bits of a gene", COLONY_FIELD(search.bits, Whole)},
      {"search.selection", "", 0, 0, false, "selection of parents", COLONY_ENUM(search.selection, Selection, "tournament", "roulette")},
      {"search.crossover_rate", "", 0, 1, false, "probability of one-point crossover", COLONY_FIELD(search.crossover_rate, double)},
      {"search.mutation_rate", "", 0, 0.5, false, "probability of flipping a bit; null = 1 / chromosome length",
       COLONY_FIELD(search.mutation_rate, MaybeReal)},
      {"search.points", "", 64, 65536, true, "Sobol points of an evaluation in the box of a body above the dish (half as many more, up to 65,536, are laid in the cube of its own frame)", COLONY_FIELD(search.points, Whole)},
      {"search.points_final", "", 64, 65536, true, "fresh Sobol points on which the winner is scored again",
       COLONY_FIELD(search.points_final, Whole)},
      {"search.turn_max_deg", "deg", 0, 90, false, "largest turn of the splitting direction", COLONY_FIELD(search.turn_max_deg, double)},
      {"search.distance", "", 0.3, 1.5, false, "distance of each new cell from the plane, in its own half-width",
       COLONY_FIELD(search.distance, Interval)},
      {"search.sideways", "", 0, 0.5, false, "largest sideways offset, in sqrt(AB)", COLONY_FIELD(search.sideways, double)},
      {"search.tilt_max_deg", "deg", 0, 20, false, "largest tilt about each horizontal axis", COLONY_FIELD(search.tilt_max_deg, double)},
      {"wake.rule", "", 0, 0, false, "when a resting cell tries again: as its surroundings gain room, or always",
       COLONY_ENUM(wake.rule, WakeRule, "share", "always")},
      {"wake.free_radius_um", "um", 5, 100, false, "radius of the surroundings", COLONY_FIELD(wake.free_radius_um, double)},
      {"wake.free_min", "", 0, 1, false, "free share above which a failed search was unlucky", COLONY_FIELD(wake.free_min, double)},
      {"wake.gain", "", 0, 1, false, "growth of the free share that wakes a sleeping cell", COLONY_FIELD(wake.gain, double)},
      {"wake.retry_h", "h", 0.01, 48, false, "time from waking to the next search; at least window_h",
       COLONY_FIELD(wake.retry_h, double)},
      {"wake.tries_max", "", 1, 100, false, "most times a cell with room repeats a failed search before it sleeps", COLONY_FIELD(wake.tries_max, Whole)},
      {"motility.rate_per_h", "1/h", 0, 2, false, "mean number of amoeboid moves a cell tries in an hour; 0 = none, else at least 0.000001",
       COLONY_FIELD(motility.rate_per_h, double)},
      {"motility.step_um", "um", 0.1, 20, false, "length of a move; judged where it ends, so a long one can lead past a neighbour", COLONY_FIELD(motility.step_um, double)},
      {"motility.bias", "", 0, 1, false, "probability that a move is directed to the freer half of the surroundings (wake.free_radius_um)", COLONY_FIELD(motility.bias, double)},
      {"layers", "", 0, 0, false, "monolayer (mono), or layers: cells stand up to 2 C higher, on the dish or on other cells (multi; without moves)",
       COLONY_ENUM(layers, Layers, "mono", "multi")},
      {"dish.radius_um", "um", 20, 50000, false, "radius of the dish's wall; null = no wall", COLONY_FIELD(dish.radius_um, MaybeReal)},
      {"founders.count", "", 1, static_cast<double>(kFoundersMax), false, "founding cells", COLONY_FIELD(founders.count, Whole)},
      {"founders.radius_um", "um", 1, 50000, false, "radius of the disc over which several founders are spread",
       COLONY_FIELD(founders.radius_um, double)},
      {"founders.positions_um", "um", -kLimitless, kLimitless, false, "positions [x, y] of the founders, instead of count and radius_um",
       COLONY_FIELD(founders.positions_um, std::vector<Vec2>)},
      {"window_h", "h", 0.01, 48, false, "how far the engine looks ahead; at most the smallest delay; cannot change the result",
       COLONY_FIELD(window_h, double)},
  };
  return rows;
}

}  // namespace

std::span<const ParamInfo> param_table() { return table(); }

}  // namespace colony
