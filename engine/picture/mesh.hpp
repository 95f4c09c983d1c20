// mesh: closed surfaces of all deformed cells, and their nuclei, as plain arrays.
// Method:  one grid for the whole colony, each cube cut into six tetrahedra (Kuhn), each node labelled with the cell it
//          lies in (f~ >= 0, z >= 0) or none; then every tetrahedron is divided among its labels (mesh_grid.hpp). So a
//          border belongs to both its cells: the same vertices to the last bit and the same triangles, turned round, and
//          where three or four cells meet there is no gap. Vertices lie on f_i = f_j, on f~ = 0 and on the dish; those
//          where three or more meet lie within one tetrahedron of it. The pitch of the grid is found from the budget.
//          Nuclei: spheres of the finest subdivision that a fifth of the budget allows, each ray cut where it leaves the
//          cell or the dish.
// Why not dual contouring: its surfaces may touch themselves along an edge; here each edge of a cell belongs to two
//                          triangles by construction.
// Units:   um. Normals: unit, outward: of the field; where three or more regions meet, area-weighted over the cell's own
//          triangles.
// Shapes:  positions 3 floats a vertex, indices 3 a triangle, counter-clockwise from outside; each part has vertices of
//          its own.
// Accuracy: at 1,000 triangles a cell the volume is about 1 % short of the deformed body's; what is lost goes with the
//          inverse of their number (engine/DESIGN.md).
// Errors:  kInvalid (triangles_max outside the limits), kLimit (fewer than kTrianglesPerCellMin for each cell). Throws
//          Stopped.
// Threads: tiles and cells side by side, into slots of their own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/model/colony.hpp"
#include "engine/picture/parallel.hpp"

namespace colony {

inline constexpr std::int64_t kTrianglesMin = 1000;
inline constexpr std::int64_t kTrianglesMax = 20'000'000;
inline constexpr std::int64_t kTrianglesPerCellMin = 200;

struct MeshSpec {
  std::int64_t triangles_max = 1'000'000;  // never more
  bool nuclei = true;
};

/// What belongs to one cell (or its nucleus): vertices [first_vertex, + vertex_count), indices [first_index, +
/// index_count), which point into all vertices. Empty for a cell too thin for the grid, and for a nucleus whose centre is
/// outside its deformed cell.
struct MeshPart {
  CellId id;
  std::size_t first_vertex = 0, vertex_count = 0;
  std::size_t first_index = 0, index_count = 0;
};

struct Mesh {
  double pitch_um = 0.0;  // of the grid
  std::vector<float> positions_um;
  std::vector<float> normals;
  std::vector<std::uint32_t> indices;
  std::vector<MeshPart> cells;   // by ascending id, one for each cell
  std::vector<MeshPart> nuclei;  // the same, or none at all
};

Result<Mesh> build_mesh(const Colony& colony, ContactRule rule, const MeshSpec& spec, const Effort& effort = {});

}  // namespace colony
