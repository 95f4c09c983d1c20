#include "engine/space/overlap.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
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
  explicit Placement(const Box& box) : origin(0.5 * (box.low + box.high)) {
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
  hold(s.inside_x, n);
  hold(s.inside_y, n);
  hold(s.inside_z, n);
  out.hit_count = kernel::select_inside(FloatBody(body, placement.origin), s.x.data(), s.y.data(), s.z.data(), n, s.band,
                                        s.inside_x.data(), s.inside_y.data(), s.inside_z.data());
  if (out.hit_count == 0) return;
  if (wall_radius_um) {
    for (std::size_t i = 0; i < out.hit_count; ++i) {
      if (beyond_wall(placement, *wall_radius_um, s.inside_x[i], s.inside_y[i])) ++out.outside_wall_count;
    }
  }
  for (std::size_t j = 0; j < neighbours.size(); ++j) {
    if (!meets(neighbours[j]->box(), body.box()) || separated(*neighbours[j], body)) continue;
    const FloatBody other(*neighbours[j], placement.origin);
    out.shared_counts[j] =
        kernel::count_inside(other, s.inside_x.data(), s.inside_y.data(), s.inside_z.data(), out.hit_count, s.band);
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

bool touches(const Body& a, const Body& b, const PointSet& points) {
  check_points(points);
  const Box domain = admissible_domain(a, b);
  if (domain.empty()) return false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = placed_um(domain, points, i);
    if (a.contains(p) && b.contains(p)) return true;
  }
  return false;
}

bool deformed_contains(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um) {
  if (!body.contains(point_um)) return false;
  const double taken = taken_by(neighbours, rule, point_um);
  return taken == 0.0 || body.field(point_um) - taken >= 0.0;
}

MassEstimate deformed_mass(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const PointSet& points) {
  check_points(points);
  MassEstimate mass;
  mass.centre_um = body.centre_um();
  if (body.box().empty()) return mass;
  Vec3 sum = Vec3::Zero();  // in index order: the sum's bits depend on it
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = placed_um(body.box(), points, i);
    if (!deformed_contains(body, neighbours, rule, p)) continue;
    ++mass.hit_count;
    sum += p - body.centre_um();
  }
  mass.volume_um3 = body.box().volume() * mass.hit_count / static_cast<double>(points.size());
  if (mass.hit_count > 0) mass.centre_um += sum / static_cast<double>(mass.hit_count);
  return mass;
}

}  // namespace colony
