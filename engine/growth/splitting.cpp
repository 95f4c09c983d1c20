#include "engine/growth/splitting.hpp"

#include <algorithm>
#include <cmath>

#include "engine/space/overlap.hpp"

namespace colony {

std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points) {
  Box slab = body.box();
  const double half_height = 0.3 * body.semiaxes_um().z();
  slab.low.z() = std::max(0.0, nucleus_um.z() - half_height);
  slab.high.z() = nucleus_um.z() + half_height;
  std::optional<Vec3> nearest;
  double least = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = placed_um(slab, points, i);
    const double distance2 = (p - nucleus_um).squaredNorm();
    if (nearest && !(distance2 < least)) continue;  // cannot win: no need to know the sign of f~
    if (deformed_contains(body, neighbours, rule, p)) continue;
    nearest = p;
    least = distance2;
  }
  return nearest;
}

std::optional<Vec3> splitting_normal(const Vec3& nucleus_um, const Vec3& nearest_membrane_um) {
  const double dx = nearest_membrane_um.x() - nucleus_um.x();
  const double dy = nearest_membrane_um.y() - nucleus_um.y();
  const double length = std::sqrt(dx * dx + dy * dy);
  if (!(length > 0.0)) return std::nullopt;
  return Vec3(-dy / length, dx / length, 0.0);
}

}  // namespace colony
