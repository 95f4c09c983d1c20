#include "engine/growth/surroundings.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/maths.hpp"
#include "engine/random/sobol.hpp"

namespace colony {
namespace {

Box disc_box(const Vec3& centre_um, double radius_um) {
  // Bodies stand on the dish: a flat slab above it meets every one of them.
  return {Vec3(centre_um.x() - radius_um, centre_um.y() - radius_um, 0.0),
          Vec3(centre_um.x() + radius_um, centre_um.y() + radius_um, centre_um.z() + radius_um)};
}

double horizontal_distance_um(const Vec3& point, const Box& box) {
  const double dx = std::max({box.low.x() - point.x(), 0.0, point.x() - box.high.x()});
  const double dy = std::max({box.low.y() - point.y(), 0.0, point.y() - box.high.y()});
  return std::sqrt(dx * dx + dy * dy);
}

}  // namespace

double free_share(const Colony& colony, const Params& params, Seed seed, const Cell& cell, std::uint32_t ordinal,
                  const BodyChange& change) {
  const double radius = params.wake.free_radius_um;
  std::vector<CellId> ids;
  colony.cells_meeting(disc_box(cell.centre_um, radius), ids);
  std::vector<const Body*> bodies;
  for (const CellId id : ids) {
    if (!(change.gone && id == *change.gone)) bodies.push_back(&colony.body(id));
  }
  for (const Body& body : change.bodies) bodies.push_back(&body);

  Stream stream(seed, cell.id, ordinal, Purpose::kFreeShare);
  const PointSet points = scrambled_sobol(kFreeSharePoints, stream);
  std::uint32_t free_count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double r = radius * std::sqrt(static_cast<double>(points.x[i]));
    const auto [s, c] = maths::sincos(2.0 * maths::kPi * static_cast<double>(points.y[i]));
    const double x = cell.centre_um.x() + r * c;
    const double y = cell.centre_um.y() + r * s;
    const bool covered =
        std::any_of(bodies.begin(), bodies.end(), [&](const Body* body) { return body->footprint_contains(x, y); });
    if (!covered) ++free_count;
  }
  return static_cast<double>(free_count) / kFreeSharePoints;
}

std::vector<Woken> wake_sleepers(const Colony& colony, const Params& params, Seed seed, double time_h, const BodyChange& change) {
  const double radius = params.wake.free_radius_um;
  std::vector<Box> changed;
  if (change.gone) changed.push_back(colony.body(*change.gone).box());
  for (const Body& body : change.bodies) changed.push_back(body.box());
  if (changed.empty()) return {};

  Box area = changed.front();
  for (const Box& box : changed) area = {area.low.cwiseMin(box.low), area.high.cwiseMax(box.high)};
  // A sleeper's own box holds its centre, so every sleeper whose centre is near meets the widened area.
  area.low -= Vec3(radius, radius, 0.0);
  area.high += Vec3(radius, radius, 0.0);
  area.low.z() = 0.0;
  std::vector<CellId> ids;
  colony.cells_meeting(area, ids);

  std::vector<Woken> woken;
  for (const CellId id : ids) {
    const Cell& cell = colony.cell(id);
    if (cell.activity != Activity::kPassive || cell.due_h || (change.gone && id == *change.gone)) continue;
    const bool near = std::any_of(changed.begin(), changed.end(), [&](const Box& box) {
      return horizontal_distance_um(cell.centre_um, box) <= radius;
    });
    if (!near) continue;
    const double share = free_share(colony, params, seed, cell, cell.ordinal, change);
    if (params.wake.rule == WakeRule::kShare && !(share >= *cell.free_share + params.wake.gain)) continue;
    woken.push_back({id, share, time_h + params.wake.retry_h});
  }
  return woken;
}

}  // namespace colony
