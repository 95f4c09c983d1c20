#include "engine/picture/mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <Eigen/Geometry>

#include "engine/picture/mesh_grid.hpp"
#include "engine/picture/mesh_nuclei.hpp"

namespace colony {
namespace {

constexpr std::int64_t kNucleiShare = 5;        // nuclei get a fifth of the budget, at most
constexpr double kFirstPitchPerSemiaxis = 0.3;  // where the search for the pitch begins
constexpr double kPitchSlack = 1.01;
constexpr double kBudgetUsedMin = 0.9;
constexpr int kPitchTriesMax = 20;

Error refuse(ErrorCode code, std::string message) {
  return Error{code, "the mesh cannot be made", {FieldError{"triangles_max", std::move(message)}}};
}

std::uint64_t count_triangles(const Colony& colony, ContactRule rule, const MeshGrid& grid, const Effort& effort) {
  const std::vector<TileCells> tiles = tiles_of(colony, grid);
  std::vector<std::uint64_t> counts(tiles.size(), 0);
  for_each_piece(tiles.size(), effort,
                 [&](std::size_t i) { counts[i] = count_part_triangles(colony, rule, grid, tiles[i]); });
  std::uint64_t sum = 0;
  for (const std::uint64_t count : counts) sum += count;
  return sum;
}

/// About the finest pitch that keeps the budget. The number of triangles goes with the inverse square of the pitch.
MeshGrid grid_within(const Colony& colony, ContactRule rule, std::uint64_t budget, const Effort& effort) {
  double semiaxes_um = 0.0;
  for (const Cell& cell : colony.cells()) semiaxes_um += std::sqrt(cell.semiaxes_um.x() * cell.semiaxes_um.y());
  const double least_um = pitch_min_um(colony);
  double pitch_um =
      std::max(least_um, kFirstPitchPerSemiaxis * semiaxes_um / static_cast<double>(colony.cells().size()));
  for (int tries = 0;; ++tries) {
    const MeshGrid grid = grid_of(colony, pitch_um);
    const std::uint64_t count = count_triangles(colony, rule, grid, effort);
    const double used = static_cast<double>(count) / static_cast<double>(budget);
    const bool late = tries >= kPitchTriesMax;
    // Well used is good enough; late in the search any grid that keeps the budget is.
    if (used <= 1.0 && (used > kBudgetUsedMin || late || pitch_um == least_um)) return grid;
    // A grid that is far too coarse says little: no more than to a quarter at once.
    pitch_um = std::max(least_um, pitch_um * std::max(0.25, (late ? 1.1 : kPitchSlack) * std::sqrt(used)));
  }
}

/// The parts of one kind, each with its own vertices, before they are laid one after another.
struct Part {
  std::vector<float> positions_um;
  std::vector<float> normals;
  std::vector<std::uint32_t> indices;  // into the part's own vertices
};

/// Normals of those vertices that have none yet: area-weighted over the part's triangles.
void add_normals(Part& part) {
  std::vector<Vec3> sums(part.positions_um.size() / 3, Vec3::Zero());
  const auto at = [&](std::uint32_t vertex) {
    const float* p = part.positions_um.data() + 3 * static_cast<std::size_t>(vertex);
    return Vec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
  };
  for (std::size_t i = 0; i < part.indices.size(); i += 3) {
    const std::uint32_t* v = part.indices.data() + i;
    const Vec3 twice_area = (at(v[1]) - at(v[0])).cross(at(v[2]) - at(v[0]));
    for (int k = 0; k < 3; ++k) sums[v[k]] += twice_area;
  }
  part.normals.resize(part.positions_um.size(), 0.0F);
  for (std::size_t v = 0; v < sums.size(); ++v) {
    float* to = part.normals.data() + 3 * v;
    if (to[0] != 0.0F || to[1] != 0.0F || to[2] != 0.0F) continue;
    const double length = std::sqrt(sums[v].squaredNorm());
    const Vec3 normal = length > 0.0 ? Vec3(sums[v] / length) : Vec3(0.0, 0.0, 1.0);
    for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<float>(normal[axis]);
  }
}

/// Where a cell's triangles lie: tile, triangle, and whether they are turned round for it.
struct Face {
  std::uint32_t tile, triangle;
  bool turned;
};

Part cell_part(const std::vector<BorderTile>& tiles, std::uint32_t id, const std::vector<Face>& faces) {
  struct Corner {
    std::uint64_t key;
    std::uint32_t tile, vertex;
  };
  std::vector<Corner> corners;
  corners.reserve(3 * faces.size());
  for (const Face& face : faces) {
    const BorderTriangle& triangle = tiles[face.tile].triangles[face.triangle];
    for (const std::uint32_t vertex : triangle.vertex)
      corners.push_back({tiles[face.tile].keys[vertex], face.tile, vertex});
  }
  Part part;
  std::vector<std::uint64_t> keys;
  keys.reserve(corners.size());
  for (const Corner& corner : corners) keys.push_back(corner.key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  part.positions_um.resize(3 * keys.size());
  part.normals.resize(3 * keys.size());
  std::vector<std::uint32_t> indices;
  indices.reserve(corners.size());
  for (const Corner& corner : corners) {
    const auto index = static_cast<std::size_t>(std::lower_bound(keys.begin(), keys.end(), corner.key) - keys.begin());
    indices.push_back(static_cast<std::uint32_t>(index));
    // Tiles that share a vertex have computed the same place.
    const float* from = tiles[corner.tile].positions_um.data() + 3 * static_cast<std::size_t>(corner.vertex);
    std::copy(from, from + 3, part.positions_um.begin() + static_cast<std::ptrdiff_t>(3 * index));
    const float sign = tiles[corner.tile].inside[corner.vertex] == id ? 1.0F : -1.0F;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      part.normals[3 * index + axis] =
          sign * tiles[corner.tile].normals[3 * static_cast<std::size_t>(corner.vertex) + axis];
    }
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i].turned) std::swap(indices[3 * i + 1], indices[3 * i + 2]);
  }
  part.indices = std::move(indices);
  add_normals(part);
  return part;
}

std::vector<Part> cell_parts(const Colony& colony, ContactRule rule, const MeshGrid& grid, const Effort& effort) {
  const std::vector<TileCells> cells = tiles_of(colony, grid);
  std::vector<BorderTile> tiles(cells.size());
  for_each_piece(cells.size(), effort, [&](std::size_t i) { tiles[i] = border_of_tile(colony, rule, grid, cells[i]); });
  std::vector<std::vector<Face>> faces(colony.cells().size());
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    for (std::uint32_t i = 0; i < tiles[t].triangles.size(); ++i) {
      const BorderTriangle& triangle = tiles[t].triangles[i];
      if (triangle.a != 0) faces[triangle.a - 1].push_back({t, i, false});
      if (triangle.b != 0) faces[triangle.b - 1].push_back({t, i, true});
    }
  }
  std::vector<Part> parts(faces.size());
  for_each_piece(parts.size(), effort,
                 [&](std::size_t i) { parts[i] = cell_part(tiles, static_cast<std::uint32_t>(i + 1), faces[i]); });
  return parts;
}

std::vector<Part> nucleus_parts(const Colony& colony, ContactRule rule, int level, const Effort& effort) {
  const Sphere sphere = sphere_of(level);
  std::vector<Part> parts(colony.cells().size());
  for_each_piece(parts.size(), effort, [&](std::size_t i) {
    const Cell& cell = colony.cells()[i];
    const Body& body = colony.body(cell.id);
    std::vector<CellId> near;
    colony.cells_meeting(body.box(), near);
    std::vector<const Body*> neighbours;
    for (const CellId id : near) {
      if (id != cell.id) neighbours.push_back(&colony.body(id));
    }
    const std::vector<Vec3> vertices = nucleus_vertices(cell, body, neighbours, rule, sphere);
    if (vertices.empty()) return;
    for (const Vec3& p : vertices) {
      for (int axis = 0; axis < 3; ++axis) parts[i].positions_um.push_back(static_cast<float>(p[axis]));
    }
    for (const auto& triangle : sphere.triangles)
      parts[i].indices.insert(parts[i].indices.end(), triangle.begin(), triangle.end());
    add_normals(parts[i]);
  });
  return parts;
}

void append(Mesh& mesh, std::vector<MeshPart>& list, std::vector<Part>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Part& part = parts[i];
    const MeshPart placed{CellId{static_cast<std::uint32_t>(i + 1)}, mesh.positions_um.size() / 3,
                          part.positions_um.size() / 3, mesh.indices.size(), part.indices.size()};
    mesh.positions_um.insert(mesh.positions_um.end(), part.positions_um.begin(), part.positions_um.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    for (const std::uint32_t index : part.indices)
      mesh.indices.push_back(static_cast<std::uint32_t>(placed.first_vertex) + index);
    list.push_back(placed);
    part = Part();
  }
}

}  // namespace

Result<Mesh> build_mesh(const Colony& colony, ContactRule rule, const MeshSpec& spec, const Effort& effort) {
  if (spec.triangles_max < kTrianglesMin || spec.triangles_max > kTrianglesMax) {
    return refuse(ErrorCode::kInvalid,
                  "must be in [" + std::to_string(kTrianglesMin) + ", " + std::to_string(kTrianglesMax) + "]");
  }
  const auto cell_count = static_cast<std::int64_t>(colony.cells().size());
  if (cell_count == 0) return Mesh{};
  if (spec.triangles_max < kTrianglesPerCellMin * cell_count) {
    return refuse(ErrorCode::kLimit, "must be at least " + std::to_string(kTrianglesPerCellMin) + " for each of the " +
                                         std::to_string(cell_count) + " cells");
  }
  std::int64_t budget = spec.triangles_max;
  int level = 0;
  if (spec.nuclei) {
    const auto nuclei_triangles = [&](int l) { return cell_count * 20 * (std::int64_t{1} << (2 * l)); };
    while (level < kSphereLevelMax && nuclei_triangles(level + 1) <= spec.triangles_max / kNucleiShare) ++level;
    budget -= nuclei_triangles(level);
  }
  const MeshGrid grid = grid_within(colony, rule, static_cast<std::uint64_t>(budget), effort);
  Mesh mesh;
  mesh.pitch_um = grid.pitch_um;
  std::vector<Part> cells = cell_parts(colony, rule, grid, effort);
  append(mesh, mesh.cells, cells);
  if (spec.nuclei) {
    std::vector<Part> nuclei = nucleus_parts(colony, rule, level, effort);
    append(mesh, mesh.nuclei, nuclei);
  }
  return mesh;
}

}  // namespace colony
