#include "engine/growth/splitting.hpp"

#include <algorithm>
#include <cmath>


namespace colony {

std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points, OverlapScratch& scratch) {
  Box slab = body.box();
  const double half_height = 0.3 * body.semiaxes_um().z();
  slab.low.z() = std::max(0.0, nucleus_um.z() - half_height);
  slab.high.z() = nucleus_um.z() + half_height;
  return nearest_outside_um(slab, nucleus_um, body, neighbours, rule, points, scratch);
}

std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points) {
  OverlapScratch scratch;
  return nearest_membrane_um(body, neighbours, rule, nucleus_um, points, scratch);
}

std::optional<Vec3> splitting_normal(const Vec3& nucleus_um, const Vec3& nearest_membrane_um) {
  const double dx = nearest_membrane_um.x() - nucleus_um.x();
  const double dy = nearest_membrane_um.y() - nucleus_um.y();
  const double length = std::sqrt(dx * dx + dy * dy);
  if (!(length > 0.0)) return std::nullopt;
  return Vec3(-dy / length, dx / length, 0.0);
}

}  // namespace colony
