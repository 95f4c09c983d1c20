// mesh_tetrahedron: how one tetrahedron is divided among the labels of its corners, by combinatorics alone.
// Method:  a border between labels a and b is the polygon of points whose barycentric shares of a and b are equal and the
//          largest: through edge points, and where three or four labels meet through points on faces and in the middle.
//          Places come later: only the order counts here.
// Units:   none.      Threads: pure.
#pragma once

#include <array>
#include <cstdint>

#include "engine/base/types.hpp"

namespace colony {

/// A vertex of the surface by the corners (0..3) of its tetrahedron that it stands between, as a set of bits.
using Between = unsigned;
constexpr Between corner_bit(int corner) { return 1U << corner; }

/// A border polygon of labels at corners a | b (any corner with the label).
struct Polygon {
  int a, b;
  int size;
  std::array<Between, 4> vertices;
};

/// The polygons of a tetrahedron whose labels are not all equal; returns how many.
int polygons_of(const std::array<std::uint32_t, 4>& labels, std::array<Polygon, 6>& out);

/// True if the polygon turns counter-clockwise seen from b; the corners stand at the unit cube's corners `masks` (bit 0:
/// x, 1: y, 2: z).
bool faces_b(const Polygon& polygon, const std::array<unsigned, 4>& masks);

}  // namespace colony
