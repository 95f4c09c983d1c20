#include "engine/sim/decide_move.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"
#include "engine/growth/surroundings.hpp"
#include "engine/random/sobol.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

constexpr std::uint32_t kSurroundingsPoints = 256;

/// Unit vector towards the freer half of the disc of free_radius_um about the cell; none where there is no such half: nothing of the
/// disc is covered, or all of it. The disc's own centroid is the centre, so the centroid of what is free lies opposite to the
/// centroid of what is covered; the latter needs no sum over a disc that is mostly free, and is exact where little is covered.
std::optional<Vec2> freer_direction(const Colony& colony, const Params& params, Seed seed, const Cell& cell,
                                    std::vector<CellId>& ids) {
  const double radius = params.wake.free_radius_um;
  const Vec3& c = cell.centre_um;
  colony.cells_meeting({Vec3(c.x() - radius, c.y() - radius, 0.0), Vec3(c.x() + radius, c.y() + radius, c.z() + radius)}, ids);
  std::vector<const Body*> others;
  for (const CellId id : ids) {
    if (id != cell.id) others.push_back(&colony.body(id));
  }
  if (others.empty() && !params.dish.radius_um) return std::nullopt;

  Stream stream(seed, cell.id, cell.ordinal, Purpose::kMoveSurroundings);
  const PointSet points = scrambled_sobol(kSurroundingsPoints, stream);
  Vec2 covered_sum = Vec2::Zero();
  std::uint32_t covered_count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double r = radius * std::sqrt(static_cast<double>(points.x[i]));
    const auto [sine, cosine] = maths::sincos(2.0 * maths::kPi * static_cast<double>(points.y[i]));
    const Vec2 offset(r * cosine, r * sine);
    const Vec2 place = c.head<2>() + offset;
    const bool covered =
        (params.dish.radius_um && place.squaredNorm() > *params.dish.radius_um * *params.dish.radius_um) ||
        std::any_of(others.begin(), others.end(), [&](const Body* body) { return body->footprint_contains(place.x(), place.y()); });
    if (!covered) continue;
    covered_sum += offset;
    ++covered_count;
  }
  if (covered_count == kSurroundingsPoints) return std::nullopt;
  const double length = std::sqrt(covered_sum.squaredNorm());
  if (!(length > 0.0)) return std::nullopt;
  return Vec2(-covered_sum / length);
}

Vec2 direction_of_move(const Colony& colony, const Params& params, Seed seed, const Cell& cell, std::vector<CellId>& ids) {
  Stream stream(seed, cell.id, cell.ordinal, Purpose::kMove);
  const bool guided = stream.uniform() < params.motility.bias;
  const double u = stream.uniform();
  const std::optional<Vec2> freer = guided ? freer_direction(colony, params, seed, cell, ids) : std::nullopt;
  if (!freer) {
    const auto [sine, cosine] = maths::sincos(2.0 * maths::kPi * u);
    return {cosine, sine};
  }
  // Within the freer half the density is cos(angle) / 2: then the sine of the angle is uniform.
  const double sine = 2.0 * u - 1.0;
  const double cosine = std::sqrt(1.0 - sine * sine);
  return {freer->x() * cosine - freer->y() * sine, freer->x() * sine + freer->y() * cosine};
}

/// Whether `moved`, the new body of `cell`, stands free enough of the others and inside the dish.
bool fits(const Colony& colony, const Params& params, Seed seed, const Cell& cell, const Body& moved, Workspace& workspace) {
  colony.cells_meeting(moved.box(), workspace.ids);
  std::vector<const Body*>& neighbours = workspace.near;
  neighbours.clear();
  for (const CellId id : workspace.ids) {
    if (id != cell.id) neighbours.push_back(&colony.body(id));
  }
  if (neighbours.empty() && !params.dish.radius_um) return true;

  Stream stream(seed, cell.id, cell.ordinal, Purpose::kMovePoints);
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  const auto final_count = static_cast<std::uint32_t>(params.search.points_final);
  PointSet& points = workspace.points;
  OverlapScratch& scratch = workspace.overlap;
  OverlapCounts& counts = workspace.counts;
  if (final_count > kLookPoints) {
    scrambled_sobol(kLookPoints, seeds, points);
    count_overlaps(moved, neighbours, params.dish.radius_um, points, scratch, counts);
    if (counts.outside_wall_count > 0 || counts.fitness() < params.contact.fitness_min - kLookMargin) return false;
  }
  tiled_sobol(final_count, seeds, points);
  count_overlaps(moved, neighbours, params.dish.radius_um, points, scratch, counts);
  return counts.outside_wall_count == 0 && counts.fitness() >= params.contact.fitness_min;
}

bool is_asleep(const Cell& cell) { return cell.activity == Activity::kPassive && !cell.due_h; }

/// `moved` is a sleeper as `before` but for place and ordinal. Wakes it where its own step gained it room; else restates its share for
/// the points of its new ordinal: recorded share plus the difference of the two samples, both asked of the colony as it is now, so
/// that growth goes on being a change of the colony, not of the sample.
void look_around(const Colony& colony, const Params& params, Seed seed, double time_h, const BodyChange& change,
                 const Cell& before, Cell& moved, kernel::CountWork& work) {
  CHECK(before.free_share.has_value());
  const double share = free_share(colony, params, seed, moved, before.ordinal, change, &work);
  const bool made = change.gone.has_value();
  if (made && (params.wake.rule == WakeRule::kAlways || share >= *before.free_share + params.wake.gain)) {
    moved.free_share = share;
    moved.due_h = time_h + params.wake.retry_h;
    moved.try_count = 0;  // as for any sleeper that is woken
    return;
  }
  const double restated = *before.free_share + (free_share(colony, params, seed, moved, moved.ordinal, change, &work) - share);
  moved.free_share = std::clamp(restated, 0.0, 1.0);
}

}  // namespace

Decision decide_move(const Colony& colony, const Params& params, Seed seed, CellId id, double time_h, Workspace& workspace) {
  kernel::CountWork& counted = workspace.overlap.work;
  counted = {};
  const Cell& before = colony.cell(id);
  Moved event;
  event.cell = before;
  event.cell.ordinal = before.ordinal + 1;
  Stream delays(seed, id, before.ordinal, Purpose::kMoveDelay);
  event.cell.move_due_h = time_h + draw_move_delay_h(params.motility, delays);

  const Vec2 direction = direction_of_move(colony, params, seed, before, workspace.ids);
  const Vec3 step(params.motility.step_um * direction.x(), params.motility.step_um * direction.y(), 0.0);
  BodyGeometry geometry = geometry_of(before);  // the noise is the body's own: it moves along
  geometry.centre_um += step;
  const Body body(geometry, params.noise);
  BodyChange change;
  if (fits(colony, params, seed, before, body, workspace)) {
    event.cell.centre_um = geometry.centre_um;
    event.cell.nucleus_um += step;
    if (event.cell.nearest_membrane_um) *event.cell.nearest_membrane_um += step;
    change = {id, std::span<const Body>(&body, 1)};
    event.woken = wake_sleepers(colony, params, seed, time_h, change, &counted);
  }
  if (is_asleep(before)) look_around(colony, params, seed, time_h, change, before, event.cell, counted);
  return {std::move(event), {counted, 0, 0, counted.field_count}};
}

double draw_move_delay_h(const MotilityParams& motility, Stream& stream) {
  CHECK(motility.rate_per_h > 0.0);
  const double least_h = move_delay_min_h(motility);
  return least_h - (1.0 / motility.rate_per_h - least_h) * maths::log(1.0 - stream.uniform());  // 1 - u is never 0
}

double move_body_reach_um(const Params& params) { return body_half_extent_max_um(params) + params.motility.step_um; }

double move_wake_reach_um(const Params& params) { return move_body_reach_um(params) + params.wake.free_radius_um; }

double move_read_reach_um(const Params& params) { return move_wake_reach_um(params) + params.wake.free_radius_um; }

}  // namespace colony
