// mesh_grid: the borders between cells, and between cells and nothing, on a grid of tetrahedra; in tiles of the plane.
// Method:  the simplices of Kuhn's subdivision are chains of corners of a cube, base < base + m1 < base + m2 < base + 7,
//          m sets of axes. A vertex of the surface stands on an edge whose ends differ in label, on a face with three
//          labels, or in a tetrahedron with four; its key says which, so that tiles and cells agree about it. Borders are
//          the duals: for labels a | b the polygon through edge points, face points and the middle. Each label's part of
//          a tetrahedron is one piece, and its border a disc: so its whole surface is a closed 2-manifold.
// Units:   um.
// Threads: pure; tiles are independent. A node on the edge of two tiles gets the same label in both: bodies that one of
//          them does not know are negative there.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/model/colony.hpp"

namespace colony {

/// Pitch along z over that in the plane: cells lie flat. Why this share: engine/DESIGN.md.
inline constexpr double kPitchShareZ = 0.5;

/// Node (x, y, z) of the grid; z = 0 is half a pitch below the dish, where nothing is, so that the dish cuts edges in
/// their middle.
struct MeshGrid {
  double pitch_um = 1.0;
  std::int64_t first_x = 0, first_y = 0;
  std::int64_t levels = 2;  // nodes along z
  double pitch_z_um() const { return kPitchShareZ * pitch_um; }
  Vec3 position_um(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return {static_cast<double>(first_x + x) * pitch_um, static_cast<double>(first_y + y) * pitch_um,
            (static_cast<double>(z) - 0.5) * pitch_z_um()};
  }
};
inline constexpr std::int64_t kTileCubes = 16;

/// A triangle of the border between cells a and b (0: none), counter-clockwise seen from b.
struct BorderTriangle {
  std::uint32_t a = 0, b = 0;
  std::uint32_t vertex[3] = {0, 0, 0};  // indices into the tile's vertices
};

struct BorderTile {
  std::vector<std::uint64_t> keys;    // ascending
  std::vector<float> positions_um;    // 3 a key
  std::vector<float> normals;         // 3 a key, unit, out of the cell of `inside`; 0 where three or more meet
  std::vector<std::uint32_t> inside;  // by key; 0 where three or more meet
  std::vector<BorderTriangle> triangles;
};

/// The finest pitch that a grid around this colony can have: places of nodes must fit into keys. The colony has cells
/// (CHECKed).
double pitch_min_um(const Colony& colony);

/// The grid around all bodies; CHECKs the pitch.
MeshGrid grid_of(const Colony& colony, double pitch_um);

/// kTileCubes x kTileCubes cubes of the plane, and the cells that may reach into them, ascending.
struct TileCells {
  std::int64_t x = 0, y = 0;
  std::vector<CellId> ids;
};

/// The tiles that have cells: memory follows the cells, however far apart they are.
std::vector<TileCells> tiles_of(const Colony& colony, const MeshGrid& grid);

/// How many triangles the parts of cells will have in this tile: two for each one that lies between two cells.
std::uint64_t count_part_triangles(const Colony& colony, ContactRule rule, const MeshGrid& grid,
                                   const TileCells& cells);

BorderTile border_of_tile(const Colony& colony, ContactRule rule, const MeshGrid& grid, const TileCells& cells);

}  // namespace colony
