// Overlap counts against their brute-force twin, the wall, the reference form of the fitness, and the neighbour grid.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/space/grid.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

struct Scene {
  Body body;
  std::vector<Body> others;
  std::vector<const Body*> near;
  std::optional<double> wall_um;
};

// Every second scene is of cells spread on the dish, the others of any ellipsoids; every third has a wall across it.
void make_scene(std::uint32_t number, Scene& scene) {
  Stream stream = testing::case_stream(number);
  const NoiseParams noise = number % 5 == 0   ? testing::smooth()
                            : number % 5 == 1 ? NoiseParams{0.45, 5.0, 6.0}
                            : number % 5 == 2 ? NoiseParams{0.40, 8.0, 1.4}
                                              : testing::rough();
  const double x = stream.uniform({-500.0, 500.0}), y = stream.uniform({-500.0, 500.0});
  const auto any = [&](double spread) {
    if (number % 2 == 0) return testing::spread_cell(stream, x, y, spread);
    BodyGeometry g = testing::any_ellipsoid(stream, spread);
    g.centre_um += Vec3(x, y, 0.0);
    return g;
  };
  scene.body = Body(any(0.0), noise);
  scene.others.clear();
  const std::uint32_t count = stream.below(9);
  for (std::uint32_t k = 0; k < count; ++k) scene.others.emplace_back(any(16.0), noise);
  scene.near.clear();
  for (const Body& other : scene.others) scene.near.push_back(&other);
  scene.wall_um.reset();
  if (number % 3 == 0) scene.wall_um = std::sqrt(x * x + y * y) + stream.uniform({-12.0, 12.0});
}

TEST(CountOverlaps, EqualsItsBruteForceTwinOnRandomScenes) {
  OverlapScratch scratch;  // kept from scene to scene, as the search keeps it
  OverlapCounts fast;
  std::uint64_t shared = 0, beyond = 0;
  const std::uint32_t scenes = testing::scaled(3000U, 20'000U);
  for (std::uint32_t number = 1; number <= scenes; ++number) {
    Scene scene;
    make_scene(number, scene);
    const PointSet points = testing::points(number % 7 == 0 ? 1024 : number % 7 == 1 ? 64 : 256, number);
    count_overlaps(scene.body, scene.near, scene.wall_um, points, scratch, fast);
    const OverlapCounts slow = count_overlaps_reference(scene.body, scene.near, scene.wall_um, points);
    ASSERT_EQ(fast.point_count, slow.point_count) << "scene " << number;
    ASSERT_EQ(fast.hit_count, slow.hit_count) << "scene " << number;
    ASSERT_EQ(fast.outside_wall_count, slow.outside_wall_count) << "scene " << number;
    ASSERT_EQ(fast.shared_counts, slow.shared_counts) << "scene " << number;
    for (const std::uint32_t count : fast.shared_counts) shared += count;
    beyond += fast.outside_wall_count;
  }
  EXPECT_GT(shared, 10'000U);  // the scenes do exercise what they are made for
  EXPECT_GT(beyond, 10'000U);
}

TEST(CountOverlaps, SinglePrecisionAgreesWithTheExactFieldButNearTheMembrane) {
  std::uint64_t tested = 0, differing = 0;
  OverlapScratch scratch;
  for (std::uint32_t number = 1; number <= 200; ++number) {
    Scene scene;
    make_scene(2 * number, scene);
    const PointSet points = testing::points(1024, number);
    OverlapCounts counts;
    count_overlaps(scene.body, scene.near, std::nullopt, points, scratch, counts);
    std::uint32_t exact = 0;
    const Box& box = scene.body.box();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 u(points.x[i], points.y[i], points.z[i]);
      if (scene.body.contains(box.low + u.cwiseProduct(box.high - box.low))) ++exact;
    }
    tested += points.size();
    differing += static_cast<std::uint64_t>(std::abs(static_cast<int>(exact) - static_cast<int>(counts.hit_count)));
  }
  EXPECT_LE(differing, tested / 10'000);  // rounding of 1e-6 about a membrane met by few points
}

TEST(FloatNoise, AgreesWithGardnersSeriesWithin2e5) {
  for (std::uint32_t number = 1; number <= 100; ++number) {
    Stream stream = testing::case_stream(number);
    const NoiseParams p{0.45, stream.uniform({2.0, 5.0}), stream.uniform({0.0, 6.28})};
    BodyGeometry g = testing::sphere(5.0, Vec3(0, 0, 5));
    for (int i = 0; i < 3; ++i) g.noise_offset[i] = noise_period(p) * stream.uniform();
    const Body body(g, p);
    const kernel::FloatBody prepared(body, body.centre_um());
    for (int i = 0; i < 500; ++i) {
      const Vec3 u = 1.3 * Vec3(stream.uniform({-1, 1}), stream.uniform({-1, 1}), stream.uniform({-1, 1}));
      const auto fu = static_cast<float>(u.x()), fv = static_cast<float>(u.y()), fw = static_cast<float>(u.z());
      const Vec3 n = Vec3(fu, fv, fw) + g.noise_offset;
      ASSERT_NEAR(kernel::noise_reference(prepared, fu, fv, fw), gardner_noise(n.x(), n.y(), n.z(), p), 2e-5)
          << "case " << number;
    }
  }
}

TEST(Fitness, EqualsTheReferenceFormWithinStandardErrors) {
  // V_i and V_ij each on their own domain, as the paper computes them; the engine's ratio of integers on one set of
  // points.
  std::vector<double> z;
  OverlapScratch scratch;
  const PointSet fine = testing::points(16'384, 7);
  for (std::uint32_t number = 1; number <= 60; ++number) {
    Stream stream = testing::case_stream(number);
    const Body body(testing::spread_cell(stream, 0.0, 0.0, 0.0), testing::rough());
    std::vector<Body> others;
    for (int k = 0; k < 5; ++k) others.emplace_back(testing::spread_cell(stream, 0.0, 0.0, 18.0), testing::rough());
    std::vector<const Body*> near;
    double taken = 0.0;
    for (const Body& other : others) {
      near.push_back(&other);
      taken += interpenetration_volume_um3(body, other, fine);
    }
    const double reference = std::max(0.0, 1.0 - taken / deformed_mass(body, {}, ContactRule::kSum, fine).volume_um3);
    OverlapCounts counts;
    count_overlaps(body, near, std::nullopt, testing::points(4096, number), scratch, counts);
    const double p = std::min(1.0, taken / deformed_mass(body, {}, ContactRule::kSum, fine).volume_um3);
    const double se =
        std::sqrt(std::max(p, 0.01) / counts.hit_count);  // of independent points: an upper bound for Sobol points
    EXPECT_NEAR(counts.fitness(), reference, 4.0 * se + 0.003) << "case " << number;
    z.push_back(counts.fitness() - reference);
  }
  double mean = 0.0;
  for (const double d : z) mean += d / static_cast<double>(z.size());
  EXPECT_NEAR(mean, 0.0, 0.003);  // no bias
}

TEST(Fitness, IsClampedAndZeroForNothingAndAcrossTheWall) {
  OverlapCounts counts;
  EXPECT_EQ(counts.fitness(), 0.0);
  counts.hit_count = 100;
  EXPECT_EQ(counts.fitness(), 1.0);
  counts.shared_counts = {30, 20};
  EXPECT_EQ(counts.fitness(), 0.5);
  counts.shared_counts = {70, 60};
  EXPECT_EQ(counts.fitness(), 0.0);
  counts.shared_counts = {0};
  counts.outside_wall_count = 1;
  EXPECT_EQ(counts.fitness(), 0.0);
}

TEST(CountOverlaps, PointCountsThatAreNoPowerOfTwoInRangeFailACheck) {
  const Body body(testing::sphere(5.0, Vec3(0, 0, 10)), testing::smooth());
  OverlapScratch scratch;
  OverlapCounts out;
  PointSet points = testing::points(64, 1);
  points.count = 63;
  EXPECT_THROW(count_overlaps(body, {}, std::nullopt, points, scratch, out), CheckFailure);
  EXPECT_THROW(count_overlaps(body, {}, std::nullopt, testing::points(32, 1), scratch, out), CheckFailure);
}

TEST(AdmissibleDomain, IsEmptyExactlyWhereAProjectionIsAndHoldsEveryCommonPoint) {
  for (std::uint32_t number = 1; number <= 500; ++number) {
    Stream stream = testing::case_stream(number);
    const Body a(testing::any_ellipsoid(stream, 15.0), testing::rough()),
        b(testing::any_ellipsoid(stream, 15.0), testing::rough());
    const Box domain = admissible_domain(a, b);
    bool some = true;
    for (int i = 0; i < 3; ++i)
      some = some && std::max(a.box().low[i], b.box().low[i]) < std::min(a.box().high[i], b.box().high[i]);
    EXPECT_EQ(domain.empty(), !some) << "case " << number;
    for (int i = 0; i < 50; ++i) {
      const Vec3 p(stream.uniform({-30, 30}), stream.uniform({-30, 30}), stream.uniform({-5, 25}));
      if (!a.contains(p) || !b.contains(p)) continue;
      EXPECT_TRUE((p.array() >= domain.low.array()).all() && (p.array() <= domain.high.array()).all());
    }
  }
}

TEST(Grid, FindsEveryBodyThatABruteForceSearchFinds) {
  for (std::uint32_t number = 1; number <= 30; ++number) {
    Stream stream = testing::case_stream(number);
    Grid grid(30.0);
    std::vector<Body> bodies;
    for (std::uint32_t id = 1; id <= 120; ++id) {
      bodies.emplace_back(testing::spread_cell(stream, -40.0, 25.0, 150.0), testing::rough());
      grid.put(CellId{id}, bodies.back().centre_um(), bodies.back().box());
    }
    for (std::uint32_t id = 3; id <= 120; id += 3) grid.remove(CellId{id}, bodies[id - 1].centre_um());
    std::vector<CellId> found;
    for (int query = 0; query < 50; ++query) {
      const Vec3 low(stream.uniform({-200, 150}), stream.uniform({-150, 150}), 0.0);
      const Box box{low, low + Vec3(stream.uniform({0.1, 60}), stream.uniform({0.1, 60}), 5.0)};
      grid.candidates(box, found);
      std::sort(found.begin(), found.end());
      for (std::uint32_t id = 1; id <= 120; ++id) {
        const bool listed = std::binary_search(found.begin(), found.end(), CellId{id});
        const bool present = id % 3 != 0;
        ASSERT_TRUE(present || !listed) << "case " << number << " cell " << id;
        ASSERT_TRUE(!present || listed || !meets(bodies[id - 1].box(), box)) << "case " << number << " cell " << id;
      }
    }
    EXPECT_THROW(grid.remove(CellId{3}, bodies[2].centre_um()), CheckFailure);
  }
  Grid grid(5.0);
  const Body large(testing::sphere(6.0, Vec3(0, 0, 3)), testing::smooth());
  EXPECT_THROW(grid.put(CellId{1}, large.centre_um(), large.box()), CheckFailure);
}

}  // namespace
}  // namespace colony
