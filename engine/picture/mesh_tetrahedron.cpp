#include "engine/picture/mesh_tetrahedron.hpp"

#include <Eigen/Geometry>

namespace colony {

int polygons_of(const std::array<std::uint32_t, 4>& labels, std::array<Polygon, 6>& out) {
  int count = 0;
  int same_count = 0, same_a = 0, same_b = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      if (labels[i] == labels[j]) ++same_count, same_a = i, same_b = j;
    }
  }
  const Between all = 15;
  if (same_count == 3) {  // one corner against three
    int alone = 0;
    while (labels[alone] == labels[(alone + 1) & 3] || labels[alone] == labels[(alone + 2) & 3]) ++alone;
    const int o1 = (alone + 1) & 3, o2 = (alone + 2) & 3, o3 = (alone + 3) & 3;
    out[count++] = {alone,
                    o1,
                    3,
                    {corner_bit(alone) | corner_bit(o1), corner_bit(alone) | corner_bit(o2),
                     corner_bit(alone) | corner_bit(o3), 0}};
  } else if (same_count == 2) {  // two against two
    const int a2 = labels[1] == labels[0] ? 1 : labels[2] == labels[0] ? 2 : 3;
    const int b1 = a2 == 1 ? 2 : 1;
    const int b2 = 6 - a2 - b1;
    out[count++] = {0,
                    b1,
                    4,
                    {corner_bit(0) | corner_bit(b1), corner_bit(0) | corner_bit(b2), corner_bit(a2) | corner_bit(b2),
                     corner_bit(a2) | corner_bit(b1)}};
  } else if (same_count == 1) {  // a, b, and two of c
    const int c1 = same_a, c2 = same_b;
    int a = 0;
    while (a == c1 || a == c2) ++a;
    const int b = 6 - c1 - c2 - a;
    const Between f1 = corner_bit(a) | corner_bit(b) | corner_bit(c1),
                  f2 = corner_bit(a) | corner_bit(b) | corner_bit(c2);
    out[count++] = {a, b, 3, {corner_bit(a) | corner_bit(b), f1, f2, 0}};
    out[count++] = {a, c1, 4, {corner_bit(a) | corner_bit(c1), corner_bit(a) | corner_bit(c2), f2, f1}};
    out[count++] = {b, c1, 4, {corner_bit(b) | corner_bit(c1), corner_bit(b) | corner_bit(c2), f2, f1}};
  } else {  // four labels
    for (int i = 0; i < 4; ++i) {
      for (int j = i + 1; j < 4; ++j) {
        const Between others = all & ~(corner_bit(i) | corner_bit(j));
        const Between k = others & (~others + 1U), l = others & ~k;
        out[count++] = {
            i,
            j,
            4,
            {corner_bit(i) | corner_bit(j), corner_bit(i) | corner_bit(j) | k, all, corner_bit(i) | corner_bit(j) | l}};
      }
    }
  }
  return count;
}

namespace {

Vec3 offset_of(unsigned mask) {
  return {static_cast<double>(mask & 1U), static_cast<double>((mask >> 1) & 1U), static_cast<double>((mask >> 2) & 1U)};
}

}  // namespace

// Vertices are taken in the middle of their corners: there no polygon is degenerate.
bool faces_b(const Polygon& polygon, const std::array<unsigned, 4>& masks) {
  const auto middle = [&](Between set) {
    Vec3 sum = Vec3::Zero();
    double n = 0.0;
    for (int i = 0; i < 4; ++i) {
      if ((set & corner_bit(i)) != 0) sum += offset_of(masks[i]), n += 1.0;
    }
    return Vec3(sum / n);
  };
  const Vec3 first = middle(polygon.vertices[0]);
  const Vec3 normal = (middle(polygon.vertices[1]) - first).cross(middle(polygon.vertices[2]) - first);
  return normal.dot(offset_of(masks[polygon.b]) - offset_of(masks[polygon.a])) > 0.0;
}

}  // namespace colony
