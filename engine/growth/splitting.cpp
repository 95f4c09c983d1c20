#include "engine/growth/splitting.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/maths.hpp"

namespace colony {
namespace {

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(), a.x() * b.y() - a.y() * b.x()};
}

}  // namespace

std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points, OverlapScratch& scratch, Layers layers) {
  if (layers == Layers::kMulti) return nearest_outside_um(body.box(), nucleus_um, body, neighbours, rule, points, scratch);
  Box slab = body.box();
  const double half_height = 0.3 * body.semiaxes_um().z();
  slab.low.z() = std::max(0.0, nucleus_um.z() - half_height);
  slab.high.z() = nucleus_um.z() + half_height;
  return nearest_outside_um(slab, nucleus_um, body, neighbours, rule, points, scratch);
}

std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points, Layers layers) {
  OverlapScratch scratch;
  return nearest_membrane_um(body, neighbours, rule, nucleus_um, points, scratch, layers);
}

std::optional<Vec3> splitting_normal(const Vec3& nucleus_um, const Vec3& nearest_membrane_um) {
  const double dx = nearest_membrane_um.x() - nucleus_um.x();
  const double dy = nearest_membrane_um.y() - nucleus_um.y();
  const double length = std::sqrt(dx * dx + dy * dy);
  if (!(length > 0.0)) return std::nullopt;
  return Vec3(-dy / length, dx / length, 0.0);
}

std::optional<Vec3> splitting_normal(const Vec3& nucleus_um, const Vec3& nearest_membrane_um, double angle_rad) {
  const Vec3 line = nearest_membrane_um - nucleus_um;
  const double length = std::sqrt(line.squaredNorm());
  if (!(length > 0.0)) return std::nullopt;
  const Vec3 e = line / length;
  // Across e and the axis that it is furthest from: never shorter than sqrt(2/3).
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(e[i]) < std::abs(e[axis])) axis = i;
  }
  Vec3 a = cross(e, Vec3::Unit(axis));
  a /= std::sqrt(a.squaredNorm());
  const Vec3 b = cross(e, a);
  const auto [sine, cosine] = maths::sincos(angle_rad);
  return Vec3(cosine * a + sine * b);
}

}  // namespace colony
