// mesh_nuclei: the surface of one nucleus: a subdivided icosahedron, each vertex drawn in to where its ray leaves the cell.
// Units:   um.      Threads: pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/model/colony.hpp"

namespace colony {

inline constexpr int kSphereLevelMax = 4;

/// Unit sphere of 20 x 4^level triangles, counter-clockwise from outside.
struct Sphere {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
Sphere sphere_of(int level);

/// The vertices of the nucleus in the order of the sphere's; none if the nucleus's centre is not in the deformed cell.
std::vector<Vec3> nucleus_vertices(const Cell& cell, const Body& body, std::span<const Body* const> neighbours,
                                   ContactRule rule, const Sphere& sphere);

}  // namespace colony
