// Meshes: closed, of the right topology and volume, the same vertices on both sides of a face; budget; threads.
#include "engine/picture/mesh.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

using testing::ball_at;
using testing::cell_at;
using testing::found;
using testing::paper;
using testing::paper_without_noise;
using testing::scaled;
using testing::scattered_cells;

using Bits = std::array<std::uint32_t, 3>;

Vec3 position(const Mesh& mesh, std::uint32_t vertex) {
  const float* p = mesh.positions_um.data() + 3 * static_cast<std::size_t>(vertex);
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}
Bits bits(const Mesh& mesh, std::uint32_t vertex) {
  Bits b{};
  std::memcpy(b.data(), mesh.positions_um.data() + 3 * static_cast<std::size_t>(vertex), sizeof b);
  return b;
}

struct Topology {
  bool closed = true;  // every edge in two triangles, once in each direction
  std::size_t pieces = 0;
  std::int64_t euler = 0;  // V - E + F
};

Topology topology_of(const Mesh& mesh, const MeshPart& part) {
  Topology topology;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  std::vector<std::uint32_t> parent(part.vertex_count);
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (std::size_t i = part.first_index; i < part.first_index + part.index_count; i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.indices[i + k], b = mesh.indices[i + (k + 1) % 3];
      EXPECT_TRUE(a >= part.first_vertex && a < part.first_vertex + part.vertex_count);
      ++directed[{a, b}];
      parent[root(a - static_cast<std::uint32_t>(part.first_vertex))] =
          root(b - static_cast<std::uint32_t>(part.first_vertex));
    }
  }
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    topology.closed = topology.closed && count == 1 && back != directed.end() && back->second == 1;
  }
  std::set<std::uint32_t> roots;
  for (std::uint32_t i = 0; i < parent.size(); ++i) roots.insert(root(i));
  topology.pieces = roots.size();
  topology.euler = static_cast<std::int64_t>(part.vertex_count) - static_cast<std::int64_t>(directed.size() / 2) +
                   static_cast<std::int64_t>(part.index_count / 3);
  return topology;
}

/// By the divergence theorem, about a point near the part.
double volume_um3(const Mesh& mesh, const MeshPart& part) {
  if (part.index_count == 0) return 0.0;
  const Vec3 origin = position(mesh, mesh.indices[part.first_index]);
  double six = 0.0;
  for (std::size_t i = part.first_index; i < part.first_index + part.index_count; i += 3) {
    const Vec3 a = position(mesh, mesh.indices[i]) - origin, b = position(mesh, mesh.indices[i + 1]) - origin,
               c = position(mesh, mesh.indices[i + 2]) - origin;
    six += a.dot(b.cross(c));
  }
  return six / 6.0;
}

std::vector<const Body*> others_of(const Colony& colony, CellId id) {
  std::vector<const Body*> others;
  for (const Cell& other : colony.cells()) {
    if (other.id != id) others.push_back(&colony.body(other.id));
  }
  return others;
}

MeshSpec of_triangles(std::int64_t count, bool nuclei = true) { return {count, nuclei}; }

TEST(Mesh, ABallIsABall) {
  Cell cell = ball_at(3.0, -2.0, 6.0);
  cell.centre_um.z() = 9.0;
  const Colony colony = found(paper_without_noise(), {cell});
  const Mesh mesh = *build_mesh(colony, ContactRule::kSum, of_triangles(20000, false));
  ASSERT_EQ(mesh.cells.size(), 1u);
  EXPECT_TRUE(mesh.nuclei.empty());
  EXPECT_LE(mesh.indices.size() / 3, 20000u);
  EXPECT_GT(mesh.indices.size() / 3, 15000u);
  const Topology topology = topology_of(mesh, mesh.cells[0]);
  EXPECT_TRUE(topology.closed);
  EXPECT_EQ(topology.pieces, 1u);
  EXPECT_EQ(topology.euler, 2);
  EXPECT_NEAR(volume_um3(mesh, mesh.cells[0]), testing::ellipsoid_volume_um3(cell.semiaxes_um), 2.0);  // 0.2 %
  for (std::uint32_t v = 0; v < mesh.positions_um.size() / 3; ++v) {
    const Vec3 arm = position(mesh, v) - cell.centre_um;
    ASSERT_NEAR(arm.norm(), 6.0, 0.02);  // vertices are kept off the ends of their edges
    const Vec3 normal(static_cast<double>(mesh.normals[3 * v]), static_cast<double>(mesh.normals[3 * v + 1]),
                      static_cast<double>(mesh.normals[3 * v + 2]));
    ASSERT_NEAR(normal.norm(), 1.0, 1e-5);
    ASSERT_GT(normal.dot(arm) / arm.norm(), 0.9999);  // outward
  }
}

TEST(Mesh, TheDishCutsFlat) {
  const Colony colony = found(paper_without_noise(), {cell_at(0.0, 0.0, Vec3(8.0, 6.0, 4.0))});
  const Mesh mesh = *build_mesh(colony, ContactRule::kSum, of_triangles(20000, false));
  EXPECT_EQ(topology_of(mesh, mesh.cells[0]).euler, 2);
  EXPECT_NEAR(volume_um3(mesh, mesh.cells[0]), colony.cells()[0].volume_um3, 0.005 * colony.cells()[0].volume_um3);
  std::size_t on_dish = 0;
  for (std::size_t i = 2; i < mesh.positions_um.size(); i += 3) {
    ASSERT_GE(mesh.positions_um[i], 0.0F);
    on_dish += mesh.positions_um[i] == 0.0F ? 1 : 0;
  }
  EXPECT_GT(on_dish, mesh.positions_um.size() / 3 / 10);
}

TEST(Mesh, TwoEqualBallsShareThePlaneBetweenThem) {
  std::vector<Cell> cells = {ball_at(-4.0, 0.0, 6.0), ball_at(4.0, 0.0, 6.0)};
  for (Cell& cell : cells) cell.centre_um.z() = 9.0;
  const Colony colony = found(paper_without_noise(), cells);
  const Mesh mesh = *build_mesh(colony, ContactRule::kMax, of_triangles(40000, false));
  std::set<Bits> left, both;
  for (std::size_t i = 0; i < mesh.cells[0].vertex_count; ++i) left.insert(bits(mesh, static_cast<std::uint32_t>(i)));
  for (std::size_t i = mesh.cells[1].first_vertex; i < mesh.cells[1].first_vertex + mesh.cells[1].vertex_count; ++i) {
    const Bits b = bits(mesh, static_cast<std::uint32_t>(i));
    if (left.contains(b)) both.insert(b);
  }
  // The face is a disc of radius sqrt(6^2 - 4^2) in the plane x = 0.
  EXPECT_GT(both.size(), 300u);
  double radius_um = 0.0;
  for (const Bits& b : both) {
    float p[3];
    std::memcpy(p, b.data(), sizeof p);
    // On the rim three regions meet, and a vertex stands within a tetrahedron of it.
    const double r = std::sqrt(static_cast<double>(p[1]) * static_cast<double>(p[1]) +
                               (static_cast<double>(p[2]) - 9.0) * (static_cast<double>(p[2]) - 9.0));
    radius_um = std::max(radius_um, r);
    if (r < 4.0) {
      ASSERT_NEAR(static_cast<double>(p[0]), 0.0, 0.02 * mesh.pitch_um + 1e-4);
    }
  }
  EXPECT_NEAR(radius_um, std::sqrt(20.0), mesh.pitch_um);
  const double x = 8.0 / 6.0, ball_um3 = testing::ellipsoid_volume_um3(cells[0].semiaxes_um);
  for (const MeshPart& part : mesh.cells) {
    EXPECT_NEAR(volume_um3(mesh, part), ball_um3 * (1.0 - 0.5 * (4.0 + x) * (2.0 - x) * (2.0 - x) / 16.0),
                0.005 * ball_um3);
  }
}

/// A colony as the model makes it, or a crowd of cells thrown over each other: slivers, pieces and handles are common.
Colony grown() { return testing::run(testing::spec_of(1, scaled(60, 400), paper())).simulator.colony(); }
Colony crowd() { return found(paper(), scattered_cells(scaled(30, 120), scaled(38.0, 76.0), 21)); }

class CrowdMesh : public ::testing::TestWithParam<ContactRule> {};

void expect_closed_and_true(const Colony& colony, ContactRule rule, double volume_error, double spheres_min) {
  const auto count = static_cast<std::int64_t>(colony.cells().size());
  const Mesh mesh = *build_mesh(colony, rule, of_triangles(6000 * count));
  EXPECT_LE(static_cast<std::int64_t>(mesh.indices.size() / 3), 6000 * count);
  ASSERT_EQ(mesh.cells.size(), colony.cells().size());
  ASSERT_EQ(mesh.nuclei.size(), colony.cells().size());
  const PointSet points = testing::points(65536, 2);
  int spheres = 0;
  for (const Cell& cell : colony.cells()) {
    const std::size_t at = cell.id.value - 1;
    const MeshPart& part = mesh.cells[at];
    EXPECT_EQ(part.id, cell.id);
    const MassEstimate mass = deformed_mass(colony.body(cell.id), others_of(colony, cell.id), rule, points);
    // What the mesh cuts off goes with the surface: of a sliver that neighbours have left it is a larger share, so that is measured
    // against the whole body.
    EXPECT_NEAR(volume_um3(mesh, part), mass.volume_um3,
                std::max(0.02 * mass.volume_um3, volume_error * cell.volume_um3))
        << cell.id.value;
    if (part.index_count == 0) continue;
    const Topology topology = topology_of(mesh, part);
    EXPECT_TRUE(topology.closed) << cell.id.value;
    // Noise and neighbours can cut a cell into pieces; each is a sphere unless a neighbour's bump goes right through it.
    EXPECT_LE(topology.euler, static_cast<std::int64_t>(2 * topology.pieces)) << cell.id.value;
    spheres += topology.euler == static_cast<std::int64_t>(2 * topology.pieces) ? 1 : 0;
    const MeshPart& nucleus = mesh.nuclei[at];
    if (nucleus.index_count == 0) continue;
    EXPECT_TRUE(topology_of(mesh, nucleus).closed);
    EXPECT_EQ(topology_of(mesh, nucleus).euler, 2);
    for (std::size_t v = nucleus.first_vertex; v < nucleus.first_vertex + nucleus.vertex_count; ++v) {
      const Vec3 p = position(mesh, static_cast<std::uint32_t>(v));
      ASSERT_GE(p.z(), -1e-5);
      ASSERT_GE(deformed_field(colony.body(cell.id), others_of(colony, cell.id), rule, p), -1e-5) << cell.id.value;
    }
  }
  EXPECT_GE(spheres, static_cast<int>(spheres_min * static_cast<double>(count)));
}

TEST_P(CrowdMesh, OfAGrownColonyIsClosedAndOfTheRightVolume) {
  expect_closed_and_true(grown(), GetParam(), 0.004, scaled(1.0, 0.98));
}
TEST_P(CrowdMesh, OfCellsThrownOverEachOtherIsClosedToo) { expect_closed_and_true(crowd(), GetParam(), 0.01, 0.75); }

TEST_P(CrowdMesh, FacesBetweenCellsAreTheSameTrianglesTurnedRound) {
  const Colony colony = crowd();
  const Mesh mesh =
      *build_mesh(colony, GetParam(), of_triangles(1500 * static_cast<std::int64_t>(colony.cells().size()), false));
  // Each triangle by the bits of its vertices, turned so that the least comes first.
  const auto name = [&](std::size_t index, bool turned) {
    std::array<Bits, 3> t = {bits(mesh, mesh.indices[index]), bits(mesh, mesh.indices[index + (turned ? 2 : 1)]),
                             bits(mesh, mesh.indices[index + (turned ? 1 : 2)])};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::map<std::array<Bits, 3>, int> all;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) ++all[name(i, false)];
  std::size_t shared = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    EXPECT_EQ(all[name(i, false)], 1);
    const auto back = all.find(name(i, true));
    shared += back != all.end() ? 1 : 0;
  }
  EXPECT_GT(shared, mesh.indices.size() / 3 / 5);
  // What is left over is the outside of the union: its edges are closed too, so no face is shared in part only.
  std::map<std::pair<Bits, Bits>, int> directed;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    if (all.contains(name(i, true))) continue;
    for (std::size_t k = 0; k < 3; ++k)
      ++directed[{bits(mesh, mesh.indices[i + k]), bits(mesh, mesh.indices[i + (k + 1) % 3])}];
  }
  for (const auto& [edge, count] : directed) ASSERT_EQ(directed[std::pair(edge.second, edge.first)], count);
}

INSTANTIATE_TEST_SUITE_P(Rules, CrowdMesh, ::testing::Values(ContactRule::kSum, ContactRule::kMax));

TEST(Mesh, BudgetsAreKeptAndLimitsNamed) {
  const Colony colony = found(paper(), scattered_cells(10, 30.0, 2));
  double pitch_um = 1e9;
  for (const std::int64_t budget : {2000, 10000, 50000, 200000}) {
    const Mesh mesh = *build_mesh(colony, ContactRule::kSum, of_triangles(budget));
    EXPECT_LE(static_cast<std::int64_t>(mesh.indices.size() / 3), budget);
    EXPECT_GT(static_cast<std::int64_t>(mesh.indices.size() / 3), budget * 7 / 10);
    EXPECT_LT(mesh.pitch_um, pitch_um);
    pitch_um = mesh.pitch_um;
  }
  const auto refused = [&](std::int64_t budget) {
    const Result<Mesh> mesh = build_mesh(colony, ContactRule::kSum, of_triangles(budget));
    return mesh ? std::string() : mesh.error().fields.at(0).pointer;
  };
  EXPECT_EQ(refused(999), "triangles_max");
  EXPECT_EQ(refused(-1), "triangles_max");
  EXPECT_EQ(refused(20'000'001), "triangles_max");
  EXPECT_EQ(refused(1999), "triangles_max");
  EXPECT_EQ(build_mesh(colony, ContactRule::kSum, of_triangles(1999)).error().code, ErrorCode::kLimit);
  EXPECT_TRUE(build_mesh(Colony(paper()), ContactRule::kSum, MeshSpec{})->indices.empty());
}

TEST(Mesh, CellsFarApartCostWhatTheyAre) {
  // 40 mm: a grid over the plane between them would not fit into memory.
  const Colony colony = found(paper(), {ball_at(-20000.0, -20000.0, 6.0), ball_at(20000.0, 20000.0, 6.0)});
  const Mesh mesh = *build_mesh(colony, ContactRule::kSum, of_triangles(200000));
  for (const MeshPart& part : mesh.cells) EXPECT_EQ(topology_of(mesh, part).euler, 2);
}

TEST(Mesh, ThreadsCannotMatter) {
  const Colony colony = found(paper(), scattered_cells(25, 40.0, 4));
  const Mesh one = *build_mesh(colony, ContactRule::kSum, of_triangles(30000));
  for (const int threads : {2, 7}) {
    const Mesh other = *build_mesh(colony, ContactRule::kSum, of_triangles(30000), Effort{threads, nullptr});
    EXPECT_EQ(other.positions_um, one.positions_um);
    EXPECT_EQ(other.normals, one.normals);
    EXPECT_EQ(other.indices, one.indices);
  }
  std::atomic<bool> stop = true;
  EXPECT_THROW(static_cast<void>(build_mesh(colony, ContactRule::kSum, of_triangles(30000), Effort{2, &stop})),
               Stopped);
}

}  // namespace
}  // namespace colony
