#include "engine/space/overlap.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/space/deformed_kernel.hpp"
#include "engine/space/overlap_kernel.hpp"

namespace colony {
namespace {

using kernel::FloatBody;

void check_points(const PointSet& points) {
  const std::size_t n = points.size();
  CHECK(n >= 64 && n <= 65536 && (n & (n - 1)) == 0);
}

// Where the points of the unit cube go: position = low + unit * extent, relative to the box's centre.
struct Placement {
  Vec3 origin;
  float low[3], extent[3];
  explicit Placement(const Box& box) : Placement(box, 0.5 * (box.low + box.high)) {}
  Placement(const Box& box, const Vec3& origin_um) : origin(origin_um) {
    for (int i = 0; i < 3; ++i) {
      low[i] = static_cast<float>(box.low[i] - origin[i]);
      extent[i] = static_cast<float>(box.high[i] - box.low[i]);
    }
  }
};

// Buffers grow and never shrink: shrinking and growing again would clear them each time.
void hold(std::vector<float>& buffer, std::size_t n) {
  if (buffer.size() < n + kernel::kPadding) buffer.resize(n + kernel::kPadding);
}

void place(const Placement& placement, const PointSet& points, OverlapScratch& s) {
  const std::size_t n = points.size();
  hold(s.x, n);
  hold(s.y, n);
  hold(s.z, n);
  for (std::size_t i = 0; i < n; ++i) s.x[i] = placement.low[0] + points.x[i] * placement.extent[0];
  for (std::size_t i = 0; i < n; ++i) s.y[i] = placement.low[1] + points.y[i] * placement.extent[1];
  for (std::size_t i = 0; i < n; ++i) s.z[i] = placement.low[2] + points.z[i] * placement.extent[2];
}

bool beyond_wall(const Placement& placement, double wall_radius_um, float x, float y) {
  const double px = placement.origin.x() + x;
  const double py = placement.origin.y() + y;
  return px * px + py * py > wall_radius_um * wall_radius_um;
}

bool reaches_wall(const Box& box, double wall_radius_um) {
  const double x = std::max(std::abs(box.low.x()), std::abs(box.high.x()));
  const double y = std::max(std::abs(box.low.y()), std::abs(box.high.y()));
  return x * x + y * y > 0.999 * wall_radius_um * wall_radius_um;  // the margin is for rounding alone
}

}  // namespace

Vec3 placed_um(const Box& box, const PointSet& points, std::size_t i) {
  return {box.low.x() + static_cast<double>(points.x[i]) * (box.high.x() - box.low.x()),
          box.low.y() + static_cast<double>(points.y[i]) * (box.high.y() - box.low.y()),
          box.low.z() + static_cast<double>(points.z[i]) * (box.high.z() - box.low.z())};
}

double OverlapCounts::fitness() const {
  if (hit_count == 0 || outside_wall_count > 0) return 0.0;
  std::uint64_t shared = 0;
  for (const std::uint32_t count : shared_counts) shared += count;
  if (shared >= hit_count) return 0.0;
  return static_cast<double>(hit_count - shared) / static_cast<double>(hit_count);
}

void count_overlaps(const Body& body, std::span<const Body* const> neighbours, std::optional<double> wall_radius_um,
                    const PointSet& points, OverlapScratch& s, OverlapCounts& out) {
  check_points(points);
  const std::size_t n = points.size();
  out.point_count = static_cast<std::uint32_t>(n);
  out.hit_count = 0;
  out.outside_wall_count = 0;
  out.shared_counts.assign(neighbours.size(), 0);
  if (body.box().empty()) return;

  const Placement placement(body.box());
  place(placement, points, s);
  // Bodies that cannot touch count 0; the others stand in s.bodies, and s.indices says whose they are.
  s.bodies.clear();
  s.indices.clear();
  for (std::size_t j = 0; j < neighbours.size(); ++j) {
    if (!meets(neighbours[j]->box(), body.box()) || separated(*neighbours[j], body)) continue;
    s.bodies.emplace_back(*neighbours[j], placement.origin);
    s.indices.push_back(j);
  }
  hold(s.inside_x, n);
  hold(s.inside_y, n);
  hold(s.inside_z, n);
  out.hit_count = kernel::select_inside(FloatBody(body, placement.origin), s.x.data(), s.y.data(), s.z.data(), n, s.band,
                                        s.inside_x.data(), s.inside_y.data(), s.inside_z.data(), &s.work);
  s.shared.resize(s.bodies.size());
  kernel::count_each(s.bodies, s.inside_x.data(), s.inside_y.data(), s.inside_z.data(), out.hit_count, s.shared.data(), s.work);
  for (std::size_t k = 0; k < s.bodies.size(); ++k) out.shared_counts[s.indices[k]] = s.shared[k];
  if (!wall_radius_um || !reaches_wall(body.box(), *wall_radius_um)) return;
  for (std::size_t i = 0; i < out.hit_count; ++i) {
    if (beyond_wall(placement, *wall_radius_um, s.inside_x[i], s.inside_y[i])) ++out.outside_wall_count;
  }
}

OverlapCounts count_overlaps_reference(const Body& body, std::span<const Body* const> neighbours,
                                       std::optional<double> wall_radius_um, const PointSet& points) {
  check_points(points);
  OverlapCounts out;
  out.point_count = static_cast<std::uint32_t>(points.size());
  out.shared_counts.assign(neighbours.size(), 0);
  if (body.box().empty()) return out;
  const Placement placement(body.box());
  const auto inside = [&](const Body& which, float x, float y, float z) {
    return kernel::is_inside_reference(FloatBody(which, placement.origin), x, y, z);
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float x = placement.low[0] + points.x[i] * placement.extent[0];
    const float y = placement.low[1] + points.y[i] * placement.extent[1];
    const float z = placement.low[2] + points.z[i] * placement.extent[2];
    if (!inside(body, x, y, z)) continue;
    ++out.hit_count;
    if (wall_radius_um && beyond_wall(placement, *wall_radius_um, x, y)) ++out.outside_wall_count;
    for (std::size_t j = 0; j < neighbours.size(); ++j) {
      if (inside(*neighbours[j], x, y, z)) ++out.shared_counts[j];
    }
  }
  return out;
}

Box admissible_domain(const Body& a, const Body& b) { return intersection(a.box(), b.box()); }

double interpenetration_volume_um3(const Body& a, const Body& b, const PointSet& points) {
  check_points(points);
  const Box domain = admissible_domain(a, b);
  if (domain.empty()) return 0.0;
  std::uint32_t hits = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = placed_um(domain, points, i);
    if (a.contains(p) && b.contains(p)) ++hits;
  }
  return domain.volume() * hits / static_cast<double>(points.size());
}

bool touches(const Body& a, const Body& b, const PointSet& points, OverlapScratch& s) {
  check_points(points);
  const Box domain = admissible_domain(a, b);
  if (domain.empty() || separated(a, b)) return false;
  const Placement placement(domain);
  place(placement, points, s);
  hold(s.inside_x, points.size());
  hold(s.inside_y, points.size());
  hold(s.inside_z, points.size());
  const std::uint32_t in_a = kernel::select_inside(FloatBody(a, placement.origin), s.x.data(), s.y.data(), s.z.data(), points.size(), s.band,
                                                   s.inside_x.data(), s.inside_y.data(), s.inside_z.data(), &s.work);
  return kernel::count_inside(FloatBody(b, placement.origin), s.inside_x.data(), s.inside_y.data(), s.inside_z.data(), in_a, s.band,
                              &s.work) > 0;
}

bool touches(const Body& a, const Body& b, const PointSet& points) {
  OverlapScratch scratch;
  return touches(a, b, points, scratch);
}

bool deformed_contains(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um) {
  if (!body.contains(point_um)) return false;
  const double taken = taken_by(neighbours, rule, point_um);
  return taken == 0.0 || body.field(point_um) - taken >= 0.0;
}

namespace {

// The points placed in `box` stand in s.x, s.y, s.z, relative to `origin`, the neighbours that can matter in s.bodies.
void place_among(const Box& box, const Vec3& origin, const Body& body, std::span<const Body* const> neighbours, const PointSet& points,
                 OverlapScratch& s) {
  Placement placement(box, origin);
  place(placement, points, s);
  s.bodies.clear();
  for (const Body* other : neighbours) {
    if (meets(other->box(), box) && !separated(*other, body)) s.bodies.emplace_back(*other, origin);
  }
}

}  // namespace

MassEstimate deformed_mass(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const PointSet& points,
                           OverlapScratch& s) {
  check_points(points);
  MassEstimate mass;
  mass.centre_um = body.centre_um();
  const Box& box = body.box();
  if (box.empty()) return mass;
  const Vec3 origin = 0.5 * (box.low + box.high);
  place_among(box, origin, body, neighbours, points, s);
  const kernel::DeformedSums sums =
      kernel::sum_deformed(FloatBody(body, origin), s.bodies, rule == ContactRule::kMax, {s.x.data(), s.y.data(), s.z.data()},
                           {points.x.data(), points.y.data(), points.z.data()}, points.size(), &s.work);
  mass.hit_count = sums.count;
  mass.volume_um3 = box.volume() * mass.hit_count / static_cast<double>(points.size());
  if (mass.hit_count == 0) return mass;
  for (int i = 0; i < 3; ++i) mass.centre_um[i] = box.low[i] + (box.high[i] - box.low[i]) * (sums.sum[i] / mass.hit_count);
  return mass;
}

MassEstimate deformed_mass(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const PointSet& points) {
  OverlapScratch scratch;
  return deformed_mass(body, neighbours, rule, points, scratch);
}

std::optional<Vec3> nearest_outside_um(const Box& box, const Vec3& from_um, const Body& body, std::span<const Body* const> neighbours,
                                       ContactRule rule, const PointSet& points, OverlapScratch& s) {
  check_points(points);
  place_among(box, from_um, body, neighbours, points, s);
  const std::size_t nearest = kernel::nearest_outside(FloatBody(body, from_um), s.bodies, rule == ContactRule::kMax,
                                                      {s.x.data(), s.y.data(), s.z.data()}, points.size(), &s.work);
  if (nearest == points.size()) return std::nullopt;
  return placed_um(box, points, nearest);
}

}  // namespace colony
