// Rasters and voxel counts against brute force; the cache; what voxels cost in accuracy.
#include "engine/space/voxels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/growth/scorer.hpp"
#include "engine/growth/search.hpp"
#include "tests/support/any_params.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/search_stage.hpp"
#include "tests/support/stats.hpp"
#include "tests/support/targets.hpp"

namespace colony {
namespace {

bool equal(const VoxelRaster& a, const VoxelRaster& b) {
  return a.x0 == b.x0 && a.y0 == b.y0 && a.z0 == b.z0 && a.nx == b.nx && a.ny == b.ny && a.nz == b.nz && a.words_per_row == b.words_per_row &&
         a.rows == b.rows;
}

TEST(VoxelRaster, EqualsItsTwinOnEveryTarget) {
  int wide = 0;
  for (std::uint32_t number = 1; number <= testing::scaled(150U, 2000U); ++number) {
    Stream stream = testing::case_stream(number);
    const NoiseParams noise = number % 5 == 0 ? testing::smooth() : NoiseParams{0.40, stream.uniform({2.0, 8.0}), stream.uniform({0.0, 6.28})};
    BodyGeometry g = number % 2 == 0 ? testing::spread_cell(stream, 0.0, 0.0, 3000.0) : testing::any_ellipsoid(stream, 40.0);
    const Body body(g, noise);
    const double edge_um = stream.uniform({0.35, 2.0});
    VoxelRaster expected, found;
    make_raster_reference(body, edge_um, expected);
    wide += expected.words_per_row > 1 ? 1 : 0;
    testing::on_every_target([&](const std::string& name) {
      make_raster(Body(testing::spread_cell(stream, 0, 0, 5), noise), 0.5, found);  // another before: nothing may be left of it
      make_raster(body, edge_um, found);
      ASSERT_TRUE(equal(found, expected)) << name << " case " << number;
    }, number == 1);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(wide, 20);
}

// Where the box stands, in edges.
std::array<std::int32_t, 2> corner_of(const VoxelCounts& voxels) {
  const Vec3 corner = voxels.corner_um() / voxels.edge_um();
  return {static_cast<std::int32_t>(std::lround(corner.x())), static_cast<std::int32_t>(std::lround(corner.y()))};
}

void expect_brute_force(const VoxelCounts& voxels, const std::vector<VoxelRaster>& rasters, const char* name, std::uint64_t& covered) {
  const auto [x0, y0] = corner_of(voxels);
  std::vector<std::uint8_t> expected(voxels.empty_cube() + 1, 0);
  const std::int32_t n = voxels.nx();
  for (const VoxelRaster& raster : rasters) {
    for (std::int32_t z = raster.z0; z < raster.z0 + raster.nz; ++z) {
      for (std::int32_t y = raster.y0; y < raster.y0 + raster.ny; ++y) {
        for (std::int32_t x = raster.x0; x < raster.x0 + raster.nx; ++x) {
          if (x < x0 || y < y0 || x >= x0 + n || y >= y0 + n || !raster.holds(x, y, z)) continue;
          std::uint8_t& count = expected[static_cast<std::size_t>((z * n + y - y0) * n + x - x0)];
          if (count < 255) ++count;
          ++covered;
        }
      }
    }
  }
  ASSERT_TRUE(std::equal(expected.begin(), expected.end(), voxels.counts())) << name;
}

TEST(VoxelCounts, EqualBruteForceAlsoWhereBodiesReachBeyondTheBox) {
  std::uint64_t covered = 0;
  std::array<int, 4> clipped{};
  int wide = 0, beyond = 0;
  for (std::uint32_t number = 1; number <= testing::scaled(40U, 400U); ++number) {
    Stream stream = testing::case_stream(number);
    Params params = number % 3 == 0 ? Params{} : testing::any_params(stream);
    params.search.bits = 6;
    if (number % 3 == 1) params.cell.pair_volume_um3 = {50.0 + stream.uniform({0, 1000}), 100'000};  // large cells on small cubes: rows of several words
    params.layers = number % 4 == 0 ? Layers::kMulti : Layers::kMono;
    VoxelCounts voxels(params);
    const Vec3 pivot(stream.uniform({-900, 900}), stream.uniform({-900, 900}), 2.0);
    voxels.centre_on(pivot);
    const double half_um = 0.5 * voxels.nx() * voxels.edge_um();
    const auto [x0, y0] = corner_of(voxels);
    std::vector<VoxelRaster> rasters;
    for (int i = 0; i < 30; ++i) {
      const Pair pair = decode(testing::any_chromosome(params, stream), testing::any_frame(params, stream), params);
      BodyGeometry g = pair.bodies[stream.below(2)];
      // Over the box, over its four sides and corners, and just beyond.
      const double x = stream.uniform({-1.3, 1.3}), y = stream.uniform({-1.3, 1.3});
      g.centre_um = Vec3(pivot.x() + half_um * x, pivot.y() + half_um * y, g.centre_um.z());
      if (i % 5 == 0) g.centre_um[i % 2] = pivot[i % 2] + (i % 3 == 0 ? -half_um : half_um);
      VoxelRaster& raster = rasters.emplace_back();
      make_raster(Body(g, params.noise), voxels.edge_um(), raster);
      wide += raster.words_per_row > 1 ? 1 : 0;
      clipped[0] += raster.x0 < x0 && raster.x0 + raster.nx > x0 ? 1 : 0;
      clipped[1] += raster.x0 < x0 + voxels.nx() && raster.x0 + raster.nx > x0 + voxels.nx() ? 1 : 0;
      clipped[2] += raster.y0 < y0 && raster.y0 + raster.ny > y0 ? 1 : 0;
      clipped[3] += raster.y0 < y0 + voxels.nx() && raster.y0 + raster.ny > y0 + voxels.nx() ? 1 : 0;
      beyond += raster.x0 >= x0 + voxels.nx() || raster.y0 >= y0 + voxels.nx() || raster.x0 + raster.nx <= x0 || raster.y0 + raster.ny <= y0 ? 1 : 0;
    }
    testing::on_every_target([&](const std::string& name) {
      voxels.centre_on(Vec3(0, 0, 1));
      voxels.add(rasters.front());  // nothing may be left of an earlier search
      voxels.centre_on(pivot);
      for (const VoxelRaster& raster : rasters) voxels.add(raster);
      expect_brute_force(voxels, rasters, name.c_str(), covered);
    }, number == 1);
    if (HasFatalFailure()) FAIL() << "case " << number;
  }
  std::printf("clipped at the four sides: %d %d %d %d; beyond: %d; rows of several words: %d\n", clipped[0], clipped[1], clipped[2], clipped[3], beyond, wide);
  EXPECT_GT(covered, 1'000'000U);
  for (const int side : clipped) EXPECT_GT(side, 20);
  EXPECT_GT(beyond, 5);
  EXPECT_GT(wide, 20);
}

TEST(VoxelCounts, StayAt255) {
  const Params params;
  VoxelCounts voxels(params);
  voxels.centre_on(Vec3(0, 0, 2));
  Stream stream = testing::case_stream(1);
  VoxelRaster raster;
  make_raster(Body(testing::spread_cell(stream, 0, 0, 0), testing::rough()), voxels.edge_um(), raster);
  std::uint64_t covered = 0;
  testing::on_every_target([&](const std::string& name) {
    voxels.centre_on(Vec3(0, 0, 2));
    for (int i = 0; i < 300; ++i) voxels.add(raster);
    expect_brute_force(voxels, std::vector<VoxelRaster>(300, raster), name.c_str(), covered);
  });
  EXPECT_EQ(*std::max_element(voxels.counts(), voxels.counts() + voxels.empty_cube()), 255);
}

TEST(VoxelCounts, ABodyHigherThanAnyOfTheModelFailsACheck) {
  const Params params;
  VoxelCounts voxels(params);
  voxels.centre_on(Vec3(0, 0, 2));
  VoxelRaster raster;
  make_raster(Body(testing::sphere(5.0, Vec3(0, 0, 40)), testing::smooth()), voxels.edge_um(), raster);
  EXPECT_THROW(voxels.add(raster), CheckFailure);
}

TEST(RasterCache, NeverServesABodyThatHasMovedOrDivided) {
  const double edge_um = voxel_edge_um(Params{});
  RasterCache cache(edge_um);
  Stream stream = testing::case_stream(1);
  const auto any = [&] { return testing::spread_cell(stream, 0.0, 0.0, 50.0); };
  std::vector<std::pair<CellId, BodyGeometry>> known;
  int made = 0, kept = 0;
  for (int step = 0; step < testing::scaled(6000, 40'000); ++step) {
    const std::uint32_t what = stream.below(6);
    if (known.size() < 10 || what == 0) {
      // Ids that share slots: now, and after the table has grown as far as it does.
      const std::uint32_t id = 1 + stream.below(40) + 64 * stream.below(3) + (step > 3000 ? 8192 * stream.below(3) : 0);
      known.emplace_back(CellId{id}, any());
    }
    auto& [id, geometry] = known[stream.below(static_cast<std::uint32_t>(known.size()))];
    if (what == 1) geometry = any();                                          // a division
    if (what == 2) geometry.centre_um.x() += stream.uniform({-3.0, 3.0});     // a move
    if (what == 3) geometry.centre_um.y() += 0.5 * edge_um;
    if (what == 4) geometry.noise_offset[static_cast<int>(stream.below(3))] += 0.5;
    const Body body(geometry, testing::rough());
    VoxelRaster expected;
    make_raster(body, edge_um, expected);
    kernel::CountWork work;
    ASSERT_TRUE(equal(cache.of(id, body, work), expected)) << "step " << step;
    (work.field_count > 0 ? made : kept) += 1;
    work = {};
    ASSERT_TRUE(equal(cache.of(id, body, work), expected)) << "step " << step;
    EXPECT_EQ(work.field_count, 0U);
  }
  EXPECT_GT(made, 1000);
  EXPECT_GT(kept, 100);
}

const testing::Run& crowded() {
  static const testing::Run run = testing::run(testing::spec_of(3, 120));
  return run;
}

SearchTask task_for(const Colony& colony, CellId id, Stream& stream) {
  SearchTask task;
  task.seed = 5;
  task.cell_id = id;
  task.ordinal = 1000 + stream.below(1000);
  task.frame = testing::any_frame(Params{}, stream);
  task.frame.pivot_um = colony.cell(id).nucleus_um;
  return task;
}

TEST(SearchStage, IsWhatASearchPrepares) {
  const Colony& colony = crowded().colony();
  const Params params;
  Workspace workspace(params);
  testing::SearchStage stage(params);
  Stream stream = testing::case_stream(1);
  for (const std::uint32_t id : {1U, 50U, 120U}) {
    const SearchTask task = task_for(colony, CellId{id}, stream);
    find_space(colony, params, task, workspace);
    PointSet points;
    Stream seeds(task.seed, task.cell_id, task.ordinal, Purpose::kSearchPoints);
    points = search_points(params, seeds);
    stage.open(task.frame, points, std::nullopt);
    const kernel::SearchScene &own = stage.scene, &theirs = workspace.scene;
    EXPECT_EQ(own.dish_z, theirs.dish_z);
    EXPECT_EQ(own.has_wall, theirs.has_wall);
    EXPECT_EQ(own.voxels_x, theirs.voxels_x);
    EXPECT_EQ(own.empty_cube, theirs.empty_cube);
    EXPECT_EQ(own.voxels_per_um, theirs.voxels_per_um);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(own.voxel_shift[i], theirs.voxel_shift[i]);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(own.own[k].stage_ends, theirs.own[k].stage_ends);
      for (std::size_t i = 0; i < own.own[k].size(); ++i) ASSERT_EQ(own.own[k].u[i], theirs.own[k].u[i]);
    }
    // The search adds only neighbours that its candidates can reach; those it has are the colony's.
    for (const Workspace::Neighbour& other : workspace.by_gap) stage.add(*other.body);
    for (std::size_t i = 0; i <= stage.voxels.empty_cube(); ++i) ASSERT_LE(theirs.counts[i], own.counts[i]);
  }
}

TEST(VoxelFitness, DiffersLittleFromThatOfTheSamePointsInTheBodiesThemselves) {
  const Colony& colony = crowded().colony();
  const Params params;
  testing::SearchStage stage(params);
  testing::SearchStage fine(params);  // 4,096 points in the same voxels: what the sampling of 256 costs
  std::vector<double> pair_difference, near_minimum, sampling;
  Stream stream = testing::case_stream(2);
  const int tasks = testing::scaled(60, 400);
  for (int t = 0; t < tasks; ++t) {
    const SearchTask task = task_for(colony, CellId{1 + stream.below(120)}, stream);
    stage.open(task.frame, testing::points(256, static_cast<std::uint32_t>(t + 1)), std::nullopt);
    fine.open(task.frame, testing::points(4096, static_cast<std::uint32_t>(t + 1001)), std::nullopt);
    const Vec3& c = task.frame.pivot_um;
    const double reach = search_reach_um(params);
    std::vector<CellId> ids;
    colony.cells_meeting({c - Vec3(reach, reach, 100), c + Vec3(reach, reach, 100)}, ids);
    std::vector<const Body*> neighbours;
    for (const CellId id : ids) {
      if (id == task.cell_id) continue;
      neighbours.push_back(&colony.body(id));
      stage.add(colony.body(id));
      fine.add(colony.body(id));
    }
    for (int i = 0; i < 100; ++i) {
      const Chromosome chromosome = random_chromosome(kGeneCountMono, 8, stream);
      const std::array<kernel::CandidateBody, 2>& pair = stage.place(chromosome);
      kernel::CountWork work;
      const kernel::PairScore score = score_pair(stage.scene, pair, {}, work);
      const kernel::PairScore on_many = score_pair(fine.scene, pair, {}, work);
      double by_voxels = 1.0, exact = 1.0, on_many_points = 1.0;
      for (std::size_t k = 0; k < 2; ++k) {
        // The same points, each asked of every neighbour's field in double precision.
        const kernel::OwnPoints& own = stage.scene.own[k];
        std::uint64_t shared = score.sibling[k];
        for (std::size_t p = 0; p < own.size(); ++p) {
          Vec3 at = c;
          for (int axis = 0; axis < 3; ++axis) {
            const float* a = pair[k].axes + 3 * axis;
            at[axis] += static_cast<double>(a[0]) * own.u[p] + static_cast<double>(a[1]) * own.v[p] + static_cast<double>(a[2]) * own.w[p] + pair[k].centre[axis];
          }
          if (at.z() < 0.0) continue;
          for (const Body* other : neighbours) shared += other->contains(at) ? 1 : 0;
        }
        by_voxels = std::min(by_voxels, 1.0 - static_cast<double>(score.shared[k]) / score.hits[k]);
        on_many_points = std::min(on_many_points, 1.0 - static_cast<double>(on_many.shared[k]) / on_many.hits[k]);
        exact = std::min(exact, 1.0 - static_cast<double>(shared) / score.hits[k]);
      }
      if (exact <= 0.0) continue;  // clamped to 0: no fitness to differ
      pair_difference.push_back(by_voxels - exact);
      sampling.push_back(by_voxels - on_many_points);
      if (exact > 0.5) near_minimum.push_back(by_voxels - exact);
    }
  }
  const auto rms = [](const std::vector<double>& x) {
    double squares = 0.0;
    for (const double v : x) squares += v * v;
    return std::sqrt(squares / static_cast<double>(x.size()));
  };
  const testing::Mean mean = testing::mean_of(pair_difference), upper = testing::mean_of(near_minimum);
  std::printf("figure: fitness by voxels less fitness of the same points: %zu candidates with any: %+.4f +- %.4f, rms %.4f; %zu above 0.5: %+.4f +- %.4f, rms %.4f\n",
              pair_difference.size(), mean.value, mean.se, rms(pair_difference), near_minimum.size(), upper.value, upper.se, rms(near_minimum));
  std::printf("figure: sampling error of those candidates on 256 points: rms %.4f\n", rms(sampling));
  EXPECT_GT(pair_difference.size(), 1000U);
  EXPECT_LT(std::abs(mean.value), 0.003);
  EXPECT_LT(rms(pair_difference), 0.035);
  EXPECT_LT(rms(pair_difference), rms(sampling));
  EXPECT_LT(rms(near_minimum), 0.028);
}

// Why a search adds neighbours an edge beyond what a candidate can reach (Scorer::cover): a cube counts as covered when its centre is, so it
// reaches up to half an edge beyond the body. Less, and what a candidate meets would depend on the candidates scored before it.
TEST(VoxelRaster, ReachesHalfAnEdgeBeyondItsBodyAndNoFurther) {
  const double edge_um = voxel_edge_um(Params{});
  double furthest = 0.0;  // in edges, along x
  for (std::uint32_t number = 1; number <= 300; ++number) {
    Stream stream = testing::case_stream(number);
    const Body body(testing::spread_cell(stream, stream.uniform({-99.0, 99.0}), 0.0, 0.0), testing::smooth());
    VoxelRaster raster;
    make_raster(body, edge_um, raster);
    const Box box = body.box();
    for (std::int32_t k = 0; k < raster.nz; ++k) {
      for (std::int32_t j = 0; j < raster.ny; ++j) {
        for (std::int32_t i = 0; i < raster.nx; ++i) {
          if (!raster.holds(raster.x0 + i, raster.y0 + j, raster.z0 + k)) continue;
          furthest = std::max(furthest, (raster.x0 + i + 1) - box.high.x() / edge_um);
        }
      }
    }
  }
  EXPECT_LE(furthest, 0.501);
  EXPECT_GT(furthest, 0.25);  // it does happen
}

}  // namespace
}  // namespace colony
