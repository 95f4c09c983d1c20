#include "engine/growth/surroundings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/random/sobol.hpp"
#include "engine/space/deformed_kernel.hpp"

namespace colony {
namespace {

Box disc_box(const Vec3& centre_um, double radius_um) {
  // Bodies stand on the dish: a flat slab above it meets every one of them.
  return {Vec3(centre_um.x() - radius_um, centre_um.y() - radius_um, 0.0),
          Vec3(centre_um.x() + radius_um, centre_um.y() + radius_um, centre_um.z() + radius_um)};
}

Box ball_box(const Vec3& centre_um, double radius_um) {
  return {centre_um - Vec3::Constant(radius_um), centre_um + Vec3::Constant(radius_um)};
}

// The noise-free body as a cover: its shadow in a monolayer, itself among layers.
kernel::Cover cover_of(const Body& body, const Vec3& origin_um, bool ball) {
  const Vec3 centre = body.centre_um() - origin_um;
  kernel::Cover cover{{static_cast<float>(centre.x()), static_cast<float>(centre.y()), ball ? static_cast<float>(centre.z()) : 0.0F},
                      0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F};
  if (ball) {
    const Mat3 form = body.to_unit().transpose() * body.to_unit();
    cover.xx = static_cast<float>(form(0, 0));
    cover.yy = static_cast<float>(form(1, 1));
    cover.zz = static_cast<float>(form(2, 2));
    cover.xy = static_cast<float>(form(0, 1));
    cover.xz = static_cast<float>(form(0, 2));
    cover.yz = static_cast<float>(form(1, 2));
  } else {
    const Vec3 form = body.footprint_form();
    cover.xx = static_cast<float>(form[0]);
    cover.xy = static_cast<float>(form[1]);
    cover.yy = static_cast<float>(form[2]);
  }
  return cover;
}

// In the plane (axis_count 2) or in space (3).
double distance_um(const Vec3& point, const Box& box, int axis_count) {
  double sum = 0.0;
  for (int i = 0; i < axis_count; ++i) {
    const double d = std::max({box.low[i] - point[i], 0.0, point[i] - box.high[i]});
    sum += d * d;
  }
  return std::sqrt(sum);
}

}  // namespace

double free_share(const Colony& colony, const Params& params, Seed seed, const Cell& cell, std::uint32_t ordinal,
                  const BodyChange& change, kernel::CountWork* work) {
  const double radius = params.wake.free_radius_um;
  const bool ball = params.layers == Layers::kMulti;
  std::vector<CellId> ids;
  colony.cells_meeting(ball ? ball_box(cell.centre_um, radius) : disc_box(cell.centre_um, radius), ids);
  std::vector<kernel::Cover> covers;
  covers.reserve(ids.size() + change.bodies.size());
  for (const CellId id : ids) {
    if (!(change.gone && id == *change.gone)) covers.push_back(cover_of(colony.body(id), cell.centre_um, ball));
  }
  for (const Body& body : change.bodies) covers.push_back(cover_of(body, cell.centre_um, ball));

  Stream stream(seed, cell.id, ordinal, Purpose::kFreeShare);
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  PointSet points;
  tiled_sobol(kFreeSharePoints, seeds, points);
  // Those of the square that lie in the disc (of the cube, in the ball above the dish), relative to the centre.
  const auto r = static_cast<float>(radius);
  const auto dish_z = static_cast<float>(-cell.centre_um.z());
  std::size_t n = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float x = 2.0F * points.x[i] - 1.0F;
    const float y = 2.0F * points.y[i] - 1.0F;
    const float z = ball ? 2.0F * points.z[i] - 1.0F : 0.0F;
    if (!(x * x + y * y + z * z <= 1.0F) || (ball && !(r * z >= dish_z))) continue;
    points.x[n] = r * x;
    points.y[n] = r * y;
    points.z[n] = r * z;
    ++n;
  }
  CHECK(n > 0);
  if (work != nullptr) work->cover_count += n * covers.size();
  return static_cast<double>(kernel::count_uncovered(covers, points.x.data(), points.y.data(), points.z.data(), n)) / static_cast<double>(n);
}

std::vector<Woken> wake_sleepers(const Colony& colony, const Params& params, Seed seed, double time_h, const BodyChange& change,
                                 kernel::CountWork* work) {
  const double radius = params.wake.free_radius_um;
  std::vector<Box> changed;
  if (change.gone) changed.push_back(colony.body(*change.gone).box());
  if (params.wake.rule == WakeRule::kAlways || params.wake.gain == 0.0) {
    for (const Body& body : change.bodies) changed.push_back(body.box());
  }
  // Rule `share` with a gain above 0: only what has gone makes room. Where nothing went, the share is at most what it was when last looked at, and then it had
  // not grown enough; so nobody there is looked at again.
  if (changed.empty()) return {};

  Box area = changed.front();
  for (const Box& box : changed) area = {area.low.cwiseMin(box.low), area.high.cwiseMax(box.high)};
  // A sleeper's own box holds its centre, so every sleeper whose centre is near meets the widened area.
  const bool ball = params.layers == Layers::kMulti;
  area.low -= Vec3(radius, radius, 0.0);
  area.high += Vec3(radius, radius, ball ? radius : 0.0);
  area.low.z() = 0.0;
  std::vector<CellId> ids;
  colony.cells_meeting(area, ids);

  std::vector<Woken> woken;
  for (const CellId id : ids) {
    const Cell& cell = colony.cell(id);
    if (cell.activity != Activity::kPassive || cell.due_h || (change.gone && id == *change.gone)) continue;
    const bool near = std::any_of(changed.begin(), changed.end(), [&](const Box& box) {
      return distance_um(cell.centre_um, box, ball ? 3 : 2) <= radius;
    });
    if (!near) continue;
    const double share = free_share(colony, params, seed, cell, cell.ordinal, change, work);
    if (params.wake.rule == WakeRule::kShare && !(share >= *cell.free_share + params.wake.gain)) continue;
    woken.push_back({id, share, time_h + params.wake.retry_h});
  }
  return woken;
}

}  // namespace colony
