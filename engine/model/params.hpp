// params: every number the model takes, with one table that drives validation, JSON, schema, documentation and --set.
// Units:   in the names. Defaults are the preset `paper`.
// Errors:  validate() returns every violation at once, each with the JSON Pointer of its field relative to the model object.
// Source:  the paper, sections 3 to 5, and our readings (engine/DESIGN.md).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/base/types.hpp"

namespace colony {

enum class CycleDistribution { kNormal, kUniform };
enum class ContactRule { kSum, kMax };
enum class Optimiser { kGenetic, kRandom, kSobol };
enum class Coding { kGray, kBinary };
enum class Selection { kTournament, kRoulette };
enum class WakeRule { kShare, kAlways };
enum class Layers { kMono, kMulti };

struct CycleParams {
  CycleDistribution distribution = CycleDistribution::kNormal;
  double mean_h = 12.0;
  double sd_h = 2.0;               // normal: truncated at +-3 sd
  double half_range_h = 2.0;       // uniform: mean +- half range
  double sibling_correlation = 0.0;
};
struct DivisionParams {
  bool inhibition = true;
  std::optional<std::int64_t> generation_limit = 40;   // Hayflick; none = no limit
  double settle_h = 2.0;
};
struct CellParams {
  Interval pair_volume_um3 = {800.0, 3600.0};
  Interval smaller_share = {0.40, 0.50};
  Interval elongation = {1.0, 1.7};          // A/B
  Interval flatness = {0.3, 0.6};            // C/sqrt(AB)
  Interval nucleus_radius_um = {2.5, 3.0};
};
struct NoiseParams {
  double amplitude = 0.40;         // a
  double frequency = 5.0;          // q
  double phase = 1.4;              // h
};
struct ContactParams {
  ContactRule rule = ContactRule::kSum;
  double fitness_min = 0.75;
  double fitness_good = 0.95;
  double neighbour_retained_min = 0.0;
};
struct SearchParams {
  Optimiser optimiser = Optimiser::kGenetic;
  std::int64_t population = 32;
  std::int64_t generations = 12;
  std::int64_t corrector_generations = 4;
  std::optional<double> give_up_margin = 0.28;   // none: no search is given up
  Coding coding = Coding::kGray;
  std::int64_t bits = 8;
  Selection selection = Selection::kTournament;
  double crossover_rate = 0.9;
  std::optional<double> mutation_rate;       // none: 1 / chromosome length
  std::int64_t points = 256;
  std::int64_t points_final = 4096;
  double turn_max_deg = 90.0;
  Interval distance = {0.7, 1.2};
  double sideways = 0.25;
  double tilt_max_deg = 4.0;
};
struct WakeParams {
  WakeRule rule = WakeRule::kShare;
  double free_radius_um = 18.0;
  double free_min = 0.25;
  double gain = 0.02;
  double retry_h = 4.0;
  std::int64_t tries_max = 3;
};
struct MotilityParams {
  double rate_per_h = 0.0;         // 0: no moves; else at least kMoveRateMin_per_h
  double step_um = 3.0;
  double bias = 0.5;
};
struct DishParams {
  std::optional<double> radius_um;           // none: no wall
};
/// Either `count` founders (at the origin if one, else over a disc of radius_um) or exactly `positions_um`.
struct FounderParams {
  std::int64_t count = 1;
  double radius_um = 500.0;
  std::vector<Vec2> positions_um;            // not empty: count and radius_um are not used
};

struct Params {
  CycleParams cycle;
  DivisionParams division;
  CellParams cell;
  NoiseParams noise;
  ContactParams contact;
  SearchParams search;
  WakeParams wake;
  MotilityParams motility;
  Layers layers = Layers::kMono;
  DishParams dish;
  FounderParams founders;
  double window_h = 1.0;
};

inline constexpr std::int64_t kFoundersMax = 100'000;
/// Rarer moves would not come within the longest job, and their mean wait would lose its meaning as a number.
inline constexpr double kMoveRateMin_per_h = 1e-6;

/// How a parameter is stored. The accessor gives the field inside a Params.
template <class T>
using Access = T& (*)(Params&);
struct EnumAccess {
  int (*get)(const Params&);
  void (*set)(Params&, int);
  std::vector<std::string_view> names;       // index = value
};
using ParamAccess = std::variant<Access<double>, Access<std::int64_t>, Access<bool>, Access<Interval>,
                                 Access<std::optional<double>>, Access<std::optional<std::int64_t>>, EnumAccess,
                                 Access<std::vector<Vec2>>>;

/// One row of the table. `path` is the name inside `model`, groups separated by a dot, e.g. "cycle.mean_h".
struct ParamInfo {
  std::string_view path;
  std::string_view unit;                     // "h", "um", "um3", "deg", "1/h" or "" (dimensionless)
  double min = 0.0;                          // closed range of a number, or of both ends of an interval
  double max = 0.0;
  bool power_of_two = false;
  std::string_view text;                     // one line, for schema and documentation
  ParamAccess access;
};

/// All parameters, in the order of the documentation.
std::span<const ParamInfo> param_table();

/// "paper", "young-colony", "clonogenic", "tumour".
std::span<const std::string_view> preset_names();
/// One line about a preset, for people.
std::string_view preset_text(std::string_view name);
/// nullopt: no such preset.
std::optional<Params> preset(std::string_view name);

/// Every violation: single ranges from the table, then the rules between parameters. Empty: the parameters can be simulated.
/// Pointers are relative to the model object, e.g. "/cycle/mean_h".
/// `known`: errors that a reader of the parameters found already (same pointers); what stands in for such a field accuses no other.
std::vector<FieldError> validate(const Params& params, const std::vector<FieldError>& known = {});

/// Shortest and longest cycle that can be drawn, h.
Interval cycle_range_h(const Params& params);
/// Shortest time between two moves of a cell, h: 1 h, or half of the mean 1 / rate_per_h where that is shorter. It must not depend on the
/// window, which cannot change a result. rate_per_h > 0.
double move_delay_min_h(const MotilityParams& motility);
/// Largest distance of any point of a body's bounding box from its centre along x or y, over all parameters allowed, um.
double body_half_extent_max_um(const Params& params);
/// Highest point above the dish of any body's bounding box, over all parameters allowed, um.
double body_top_max_um(const Params& params);
/// Every body a division can place, noise box included, lies within this distance (per axis x, y) of the nucleus centre, um.
double search_reach_um(const Params& params);

}  // namespace colony
