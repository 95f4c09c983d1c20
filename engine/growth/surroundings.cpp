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

// A body that may cover: its shadow in a monolayer, itself among layers, noise-free. What is the same for every disc is worked out once.
struct Covering {
  Box box;
  Vec3 centre_um;
  kernel::Cover form;                    // its centre is that of the disc's frame, and still to be filled in
};

Covering covering_of(const Body& body, bool ball) {
  Covering covering{body.box(), body.centre_um(), {}};
  kernel::Cover& cover = covering.form;
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
  return covering;
}

Box neighbourhood(const Vec3& centre_um, double radius_um, bool ball) { return ball ? ball_box(centre_um, radius_um) : disc_box(centre_um, radius_um); }

// The bodies as they will be after `change`, of those that now meet `area`.
std::vector<Covering> coverings(const Colony& colony, const Box& area, const BodyChange& change, bool ball) {
  std::vector<CellId> ids;
  colony.cells_meeting(area, ids);
  std::vector<Covering> found;
  found.reserve(ids.size() + change.bodies.size());
  for (const CellId id : ids) {
    if (!(change.gone && id == *change.gone)) found.push_back(covering_of(colony.body(id), ball));
  }
  for (const Body& body : change.bodies) found.push_back(covering_of(body, ball));
  return found;
}

// Buffers of one sleeper after the other.
struct ShareScratch {
  std::vector<kernel::Cover> covers;
  PointSet points;
};

// `bodies`: all that meet the neighbourhood, and any others.
double free_share_among(std::span<const Covering> bodies, const Params& params, Seed seed, CellId id, const Vec3& centre_um, std::uint32_t ordinal,
                        ShareScratch& scratch, kernel::CountWork* work) {
  const double radius = params.wake.free_radius_um;
  const bool ball = params.layers == Layers::kMulti;
  const Box area = neighbourhood(centre_um, radius, ball);
  scratch.covers.clear();
  for (const Covering& body : bodies) {
    if (!meets(body.box, area)) continue;
    kernel::Cover& cover = scratch.covers.emplace_back(body.form);
    const Vec3 centre = body.centre_um - centre_um;
    for (int i = 0; i < 3; ++i) cover.centre[i] = i < 2 || ball ? static_cast<float>(centre[i]) : 0.0F;
  }
  Stream stream(seed, id, ordinal, Purpose::kFreeShare);
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  PointSet& points = scratch.points;
  if (ball) {
    tiled_sobol(kFreeSharePoints, seeds, points);
  } else {
    tiled_sobol_plane(kFreeSharePoints, seeds, points);
    std::fill_n(points.z.begin(), points.size(), 0.5F);  // the height of the centre
  }
  const float low_z = ball ? static_cast<float>(-centre_um.z()) : -1.0F;
  const std::size_t n = kernel::keep_in_ball(static_cast<float>(radius), low_z, points.x.data(), points.y.data(), points.z.data(), points.size());
  CHECK(n > 0);
  if (work != nullptr) work->cover_count += n * scratch.covers.size();
  return static_cast<double>(kernel::count_uncovered(scratch.covers, points.x.data(), points.y.data(), points.z.data(), n)) / static_cast<double>(n);
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
  const bool ball = params.layers == Layers::kMulti;
  const std::vector<Covering> bodies = coverings(colony, neighbourhood(cell.centre_um, params.wake.free_radius_um, ball), change, ball);
  ShareScratch scratch;
  return free_share_among(bodies, params, seed, cell.id, cell.centre_um, ordinal, scratch, work);
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

  std::erase_if(ids, [&](CellId id) {
    const Cell& cell = colony.cell(id);
    if (cell.activity != Activity::kPassive || cell.due_h || (change.gone && id == *change.gone)) return true;
    return std::none_of(changed.begin(), changed.end(), [&](const Box& box) {
      return distance_um(cell.centre_um, box, ball ? 3 : 2) <= radius;
    });
  });
  if (ids.empty()) return {};
  // One query for all of them: their discs overlap.
  Box around = neighbourhood(colony.cell(ids.front()).centre_um, radius, ball);
  for (const CellId id : ids) {
    const Box one = neighbourhood(colony.cell(id).centre_um, radius, ball);
    around = {around.low.cwiseMin(one.low), around.high.cwiseMax(one.high)};
  }
  const std::vector<Covering> bodies = coverings(colony, around, change, ball);
  ShareScratch scratch;
  std::vector<Woken> woken;
  for (const CellId id : ids) {
    const Cell& cell = colony.cell(id);
    const double share = free_share_among(bodies, params, seed, id, cell.centre_um, cell.ordinal, scratch, work);
    if (params.wake.rule == WakeRule::kShare && !(share >= *cell.free_share + params.wake.gain)) continue;
    woken.push_back({id, share, time_h + params.wake.retry_h});
  }
  return woken;
}

}  // namespace colony
