#include "engine/picture/mesh_nuclei.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/picture/paths.hpp"

namespace colony {
namespace {

constexpr int kRaySteps = 8;  // a membrane fold thinner than an eighth of the nucleus is stepped over
constexpr int kHalvings = 6;
constexpr double kInset = 0.98;  // of a ray cut short: the surface of the cell is made of flat triangles

}  // namespace

Sphere sphere_of(int level) {
  CHECK(level >= 0 && level <= kSphereLevelMax);
  const double t = 0.5 * (1.0 + std::sqrt(5.0));
  const double scale = 1.0 / std::sqrt(1.0 + t * t);
  Sphere sphere;
  for (const Vec3& v :
       {Vec3(-1, t, 0), Vec3(1, t, 0), Vec3(-1, -t, 0), Vec3(1, -t, 0), Vec3(0, -1, t), Vec3(0, 1, t), Vec3(0, -1, -t),
        Vec3(0, 1, -t), Vec3(t, 0, -1), Vec3(t, 0, 1), Vec3(-t, 0, -1), Vec3(-t, 0, 1)}) {
    sphere.vertices.push_back(v * scale);
  }
  sphere.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int i = 0; i < level; ++i) {
    // Middles of edges by their ends, lower index first; found again by search, since there are few.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> middles;
    for (const auto& triangle : sphere.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint64_t a = triangle[k], b = triangle[(k + 1) % 3];
        middles.emplace_back(std::min(a, b) << 32 | std::max(a, b), 0);
      }
    }
    std::sort(middles.begin(), middles.end());
    middles.erase(std::unique(middles.begin(), middles.end()), middles.end());
    for (auto& [key, index] : middles) {
      const Vec3 sum = sphere.vertices[key >> 32] + sphere.vertices[key & 0xFFFFFFFF];
      index = static_cast<std::uint32_t>(sphere.vertices.size());
      sphere.vertices.push_back(sum / std::sqrt(sum.squaredNorm()));
    }
    const auto middle = [&](std::uint64_t a, std::uint64_t b) {
      return std::lower_bound(middles.begin(), middles.end(),
                              std::pair(std::min(a, b) << 32 | std::max(a, b), std::uint32_t{0}))
          ->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : sphere.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    sphere.triangles = std::move(finer);
  }
  return sphere;
}

std::vector<Vec3> nucleus_vertices(const Cell& cell, const Body& body, std::span<const Body* const> neighbours,
                                   ContactRule rule, const Sphere& sphere) {
  const auto inside = [&](const Vec3& p) { return p.z() >= 0.0 && deformed_field(body, neighbours, rule, p) >= 0.0; };
  if (!inside(cell.nucleus_um)) return {};
  const Vec3 radii(cell.nucleus_radius_um, cell.nucleus_radius_um, nucleus_half_height_um(cell));
  std::vector<Vec3> vertices;
  vertices.reserve(sphere.vertices.size());
  for (const Vec3& direction : sphere.vertices) {
    const Vec3 ray = direction.cwiseProduct(radii);
    double in = 0.0, out = 0.0;
    for (int step = 1; step <= kRaySteps; ++step) {
      const double share = static_cast<double>(step) / kRaySteps;
      if (!inside(cell.nucleus_um + share * ray)) {
        out = share;
        break;
      }
      in = share;
    }
    for (int i = 0; i < kHalvings && out > 0.0; ++i) {
      const double middle = 0.5 * (in + out);
      (inside(cell.nucleus_um + middle * ray) ? in : out) = middle;
    }
    // Never 0: the surface stays a sphere around the centre.
    vertices.push_back(cell.nucleus_um + (out > 0.0 ? kInset * std::max(in, 1e-3) : 1.0) * ray);
  }
  return vertices;
}

}  // namespace colony
