// Placing the founding cells: one at the origin, several over a disc, or at given positions.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"
#include "engine/growth/chromosome.hpp"
#include "engine/model/cycle.hpp"
#include "engine/random/stream.hpp"
#include "engine/sim/decide_move.hpp"
#include "engine/sim/simulator.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

constexpr std::uint32_t kTriesMax = 1000;
constexpr std::size_t kErrorsMax = 20;
constexpr double kRadiansPerDegree = maths::kPi / 180.0;

class FounderPlacer {
 public:
  FounderPlacer(const RunSpec& spec, StopFlag stop)
      : spec_(spec), params_(spec.params), stop_(stop), colony_(spec.params) {}

  Result<std::vector<Cell>> place() {
    const std::vector<Vec2>& positions = params_.founders.positions_um;
    const std::size_t count = founder_count(params_.founders);
    several_ = count > 1;
    std::vector<FieldError> errors;
    for (std::size_t k = 0; k < count && errors.size() < kErrorsMax; ++k) {
      const std::string pointer = "/founders/positions_um/" + std::to_string(k);
      Cell cell = shape(CellId{static_cast<std::uint32_t>(k + 1)});
      if (!positions.empty()) {
        const std::optional<std::string> problem = problem_at(cell, positions[k]);
        if (problem) errors.push_back({pointer, *problem});
      } else if (!several_) {
        const std::optional<std::string> problem = problem_at(cell, Vec2(0.0, 0.0));
        if (problem) errors.push_back({"/founders", *problem});
      } else if (!place_at_random(cell)) {
        errors.push_back({"/founders", (try_count_ < kFounderTriesMax ? "1,000 tries" : "400,000 tries in all") +
                                           std::string(" found no place for founder ") + std::to_string(k + 1) + " of " +
                                           std::to_string(count) + ": fewer founders or a larger radius_um are needed"});
        break;
      }
      cells_.push_back(cell);
      if (errors.empty()) add(cell);
    }
    if (!errors.empty()) return Error{ErrorCode::kInvalid, "the founders cannot be placed", std::move(errors)};
    return std::move(cells_);
  }

 private:
  // All but the place: shape, nucleus radius, noise and times.
  Cell shape(CellId id) const {
    Stream stream(spec_.seed, id, 0, Purpose::kFounder);
    Cell cell;
    cell.id = id;
    cell.ordinal = 1;  // founding is its first event: later draws never meet these counter words again
    // A founder is half of a pair: the size a cell of this culture has after a division.
    const double volume = 0.5 * stream.uniform(params_.cell.pair_volume_um3);
    const double elongation = stream.uniform(params_.cell.elongation);
    cell.semiaxes_um = semiaxes_um(volume, elongation, stream.uniform(params_.cell.flatness));
    const double tilt_max = params_.search.tilt_max_deg * kRadiansPerDegree;
    const double rotation = maths::kPi * stream.uniform();
    const double tilt_x = stream.uniform({-tilt_max, tilt_max});
    cell.rotation_rad = orientation_rad(rotation, tilt_x, stream.uniform({-tilt_max, tilt_max}));
    cell.nucleus_radius_um = stream.uniform(params_.cell.nucleus_radius_um);
    const double period = noise_period(params_.noise);
    for (int i = 0; i < 3; ++i) cell.noise_offset[i] = period * stream.uniform();

    Stream cycles(spec_.seed, id, 0, Purpose::kCycle);
    const double cycle_h = draw_cycle_h(params_.cycle, cycles);
    // Several founders are out of step: each is somewhere in its first cycle, so its last splitting lies before time 0.
    const double due_h = several_ ? cycle_h * cycles.uniform() : cycle_h;
    cell.born_h = due_h - cycle_h;
    cell.due_h = due_h;
    cell.settle_due_h = std::max(0.0, cell.born_h + params_.division.settle_h);
    if (params_.motility.rate_per_h > 0.0) {
      Stream delays(spec_.seed, id, 0, Purpose::kMoveDelay);
      cell.move_due_h = draw_move_delay_h(params_.motility, delays);  // a seeded cell attaches first
    }
    return cell;
  }

  void stand_at(Cell& cell, const Vec2& position) const {
    cell.centre_um = Vec3(position.x(), position.y(), spread_height_um(cell.semiaxes_um));
    const BodyGeometry body = geometry_of(cell);
    cell.nucleus_um = centroid_above_dish_um(body);
    cell.volume_um3 = volume_above_dish_um3(body);
  }

  std::optional<std::string> problem_at(Cell& cell, const Vec2& position) {
    throw_if_stopped(stop_);
    stand_at(cell, position);
    const OverlapCounts counts = overlaps(cell);
    if (counts.outside_wall_count > 0) return "the founder's body reaches beyond the dish's wall";
    if (!(counts.fitness() >= params_.contact.fitness_min)) {
      return "the founder overlaps the ones before it: only " + std::to_string(counts.fitness()) +
             " of its volume is free, contact.fitness_min is " + std::to_string(params_.contact.fitness_min);
    }
    return std::nullopt;
  }

  bool place_at_random(Cell& cell) {
    for (std::uint32_t attempt = 0; attempt < kTriesMax && try_count_ < kFounderTriesMax; ++attempt) {
      ++try_count_;
      Stream stream(spec_.seed, cell.id, 0, Purpose::kFounderPlace, attempt);
      const double r = params_.founders.radius_um * std::sqrt(stream.uniform());
      const auto [s, c] = maths::sincos(2.0 * maths::kPi * stream.uniform());
      if (!problem_at(cell, Vec2(r * c, r * s))) return true;
    }
    return false;
  }

  OverlapCounts overlaps(const Cell& cell) {
    const Body body(geometry_of(cell), params_.noise);
    colony_.cells_meeting(body.box(), ids_);
    std::vector<const Body*> neighbours;
    for (const CellId id : ids_) neighbours.push_back(&colony_.body(id));
    OverlapCounts counts;
    if (neighbours.empty() && !params_.dish.radius_um) {
      counts.hit_count = 1;  // nothing to meet: wholly free
      return counts;
    }
    Stream stream(spec_.seed, cell.id, 0, Purpose::kFinalPoints);
    const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
    const auto final_count = static_cast<std::uint32_t>(params_.search.points_final);
    PointSet points;
    if (final_count > kLookPoints) {
      scrambled_sobol(kLookPoints, seeds, points);
      count_overlaps(body, neighbours, params_.dish.radius_um, points, scratch_, counts);
      if (counts.fitness() < params_.contact.fitness_min - kLookMargin) return counts;
    }
    tiled_sobol(final_count, seeds, points);
    count_overlaps(body, neighbours, params_.dish.radius_um, points, scratch_, counts);
    return counts;
  }

  void add(const Cell& cell) {
    Event event;
    event.seq = colony_.last_seq() + 1;
    event.cell_id = cell.id;
    event.body = Founded{cell};
    canonicalise(event);
    event.digest = digest_after(colony_.digest(), event);
    colony_.apply(event);
  }

  const RunSpec& spec_;
  const Params& params_;
  const StopFlag stop_;
  Colony colony_;
  std::uint64_t try_count_ = 0;  // of all founders
  bool several_ = false;
  std::vector<Cell> cells_;
  std::vector<CellId> ids_;
  OverlapScratch scratch_;
};

}  // namespace

std::uint64_t founder_count(const FounderParams& founders) {
  return founders.positions_um.empty() ? static_cast<std::uint64_t>(founders.count) : founders.positions_um.size();
}

Result<std::vector<Cell>> place_founders(const RunSpec& spec, StopFlag stop) { return FounderPlacer(spec, stop).place(); }

}  // namespace colony
