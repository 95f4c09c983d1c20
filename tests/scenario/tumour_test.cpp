// What several layers make of a colony: nobody floats at birth, and the heights spread.
// Reduced: 2 seeds to 250 cells; COLONY_TEST_FULL=1: 6 seeds to 2,000.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "engine/analysis/series.hpp"
#include "engine/growth/support.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

struct Support {
  bool on_dish = false, on_older = false, on_sibling = false;
};

// By brute force on the winner's points: every cell whose box meets the new one, every point, the noise always.
std::array<Support, 2> support_of(const RunSpec& spec, const Colony& before, const Event& event) {
  const auto& divided = std::get<Divided>(event.body);
  const Cell& parent = before.cell(*event.cell_id);
  Stream stream(spec.seed, parent.id, parent.ordinal, Purpose::kFinalPoints);
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  PointSet points;
  tiled_sobol(static_cast<std::uint32_t>(spec.params.search.points_final), seeds, points);
  const std::array<Body, 2> bodies = {Body(geometry_of(divided.cells[0]), spec.params.noise),
                                      Body(geometry_of(divided.cells[1]), spec.params.noise)};
  std::array<Support, 2> out;
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<const Body*> others = {&bodies[1 - k]};
    for (const Cell& cell : before.cells()) {
      if (cell.id != parent.id && meets(before.body(cell.id).box(), bodies[k].box())) others.push_back(&before.body(cell.id));
    }
    const OverlapCounts counts = count_overlaps_reference(bodies[k], others, std::nullopt, points);
    const auto enough = [&](std::uint32_t shared) { return static_cast<double>(shared) >= 0.01 * static_cast<double>(counts.hit_count); };
    // The lowest point of the noise-free ellipsoid.
    const Mat3 r = rotation_matrix(divided.cells[k].rotation_rad);
    double squares = 0.0;
    for (int i = 0; i < 3; ++i) squares += std::pow(r(2, i) * divided.cells[k].semiaxes_um[i], 2);
    out[k].on_dish = divided.cells[k].centre_um.z() - std::sqrt(squares) <= 1e-12;
    out[k].on_sibling = enough(counts.shared_counts[0]);
    out[k].on_older = std::any_of(counts.shared_counts.begin() + 1, counts.shared_counts.end(), enough);
    EXPECT_GT(counts.hit_count, 0U);
  }
  return out;
}

TEST(Tumour, NobodyFloatsAtBirthAndLayersAppear) {
  for (Seed seed = 1; seed <= testing::scaled<Seed>(2, 6); ++seed) {
    const RunSpec spec = testing::spec_of(seed, testing::scaled(250, 2000), *preset("tumour"));
    const testing::Run run = testing::run(spec);
    Colony colony(spec.params);
    int birth_count = 0, on_dish_count = 0, on_older_count = 0, on_sibling_only_count = 0;
    for (const Event& event : run.events) {
      if (event.kind() == EventKind::kDivided) {
        const std::array<Support, 2> both = support_of(spec, colony, event);
        for (std::size_t k = 0; k < 2; ++k) {
          const Support &one = both[k], &other = both[1 - k];
          const bool itself = one.on_dish || one.on_older;
          ASSERT_TRUE(itself || (one.on_sibling && (other.on_dish || other.on_older))) << "seed " << seed << " seq " << event.seq;
          ++birth_count;
          on_dish_count += one.on_dish ? 1 : 0;
          on_older_count += one.on_older && !one.on_dish ? 1 : 0;
          on_sibling_only_count += itself ? 0 : 1;
        }
      }
      colony.apply(event);
    }
    // Who stands above whom: cells with the centre of a lower one inside their shadow.
    const double n = static_cast<double>(colony.cells().size());
    double off_dish = 0.0, above = 0.0, above_two = 0.0;
    std::array<int, 12> by_height{};
    for (const Cell& cell : colony.cells()) {
      off_dish += reaches_dish(colony.body(cell.id)) ? 0.0 : 1.0 / n;
      ++by_height[static_cast<std::size_t>(std::clamp(cell.centre_um.z() / 2.0, 0.0, 11.0))];
      int below = 0;
      for (const Cell& other : colony.cells()) {
        below += other.centre_um.z() < cell.centre_um.z() - 1.0 &&
                 colony.body(cell.id).footprint_contains(other.centre_um.x(), other.centre_um.y());
      }
      above += below >= 1 ? 1.0 / n : 0.0;
      above_two += below >= 2 ? 1.0 / n : 0.0;
    }
    std::printf("figure: tumour, seed %d, %.0f cells at %.0f h: %.2f do not touch the dish, %.2f stand over one lower cell or more, %.2f over "
                "two; of %d births %d on the dish, %d on older cells only, %d on their sibling only; centres by 2 um:",
                static_cast<int>(seed), n, colony.time_h(), off_dish, above, above_two, birth_count, on_dish_count, on_older_count,
                on_sibling_only_count);
    for (const int count : by_height) std::printf(" %d", count);
    std::printf("\n");
    EXPECT_GT(off_dish, 0.3);
    EXPECT_LT(off_dish, 0.9);
    EXPECT_GT(above, 0.2);
    EXPECT_GT(on_older_count, 20);
    EXPECT_GT(on_sibling_only_count, 0);
  }
}

TEST(Tumour, StandsDenserThanAMonolayer) {
  const auto spread_um2 = [](const Params& params) {
    const testing::Run run = testing::run(testing::spec_of(1, 200, params));
    double sum = 0.0;
    Vec2 mean = Vec2::Zero();
    for (const Cell& cell : run.colony().cells()) mean += cell.centre_um.head<2>() / 200.0;
    for (const Cell& cell : run.colony().cells()) sum += (cell.centre_um.head<2>() - mean).squaredNorm() / 200.0;
    return sum;
  };
  Params mono = *preset("tumour");
  mono.layers = Layers::kMono;
  EXPECT_LT(spread_um2(*preset("tumour")), 0.75 * spread_um2(mono));
}

// Growing in three layers is faster than in one, and takes less of the dish. Full: to the sizes that engine/DESIGN.md states.
TEST(Tumour, GrowsFasterAndDenserThanAColonyOfOneLayer) {
  const std::uint64_t some = testing::scaled<std::uint64_t>(150, 500), many = testing::scaled<std::uint64_t>(300, 5000);
  struct Curve {
    double some_h = 0.0, many_h = 0.0, cells_per_um2 = 0.0;
  };
  const auto grow = [&](const char* name, Seed seed, const Params& params) {
    Simulator simulator(testing::spec_of(seed, many, params));
    Curve curve;
    double divisions = 0.0, searches_to_some = 0.0, top_um = 0.0;
    while (const std::optional<Event> event = simulator.step()) {
      if (event->kind() != EventKind::kDivided) continue;
      ++divisions;
      if (simulator.colony().cells().size() != some) continue;
      curve.some_h = event->time_h;
      searches_to_some = static_cast<double>(simulator.work().search_count) / divisions;
    }
    const Colony& colony = simulator.colony();
    curve.many_h = colony.time_h();
    curve.cells_per_um2 = static_cast<double>(many) / measure_series(colony, colony.time_h()).area_um2;
    for (const Cell& cell : colony.cells()) top_um = std::max(top_um, colony.body(cell.id).box().high.z());
    std::printf("figure: %s, seed %d: %d cells at %.0f h, %d at %.0f h, %.4f cells/um2 of its area, %.1f um at most to the top of a box; %.1f and %.1f "
                "searches per division\n",
                name, static_cast<int>(seed), static_cast<int>(some), curve.some_h, static_cast<int>(many), curve.many_h, curve.cells_per_um2,
                top_um, searches_to_some, static_cast<double>(simulator.work().search_count) / divisions);
    return curve;
  };
  Params mono = *preset("paper");
  mono.division.generation_limit.reset();
  const Curve control = grow("paper without limit", 1, mono);
  for (Seed seed = 1; seed <= testing::scaled<Seed>(1, 3); ++seed) {
    const Curve tumour = grow("tumour", seed, *preset("tumour"));
    EXPECT_LT(tumour.many_h, control.many_h);
    EXPECT_GT(tumour.cells_per_um2, 1.3 * control.cells_per_um2);
  }
}

// With a search so short that its winner may float, the division is refused, also where everything else would be accepted.
TEST(Tumour, FloatingWinnersAreRefusedAlsoWithoutInhibition) {
  Params params = *preset("tumour");
  params.division.inhibition = false;
  params.search.optimiser = Optimiser::kRandom;
  params.search.population = 4;
  params.search.generations = 0;
  params.search.corrector_generations = 0;
  int refused_count = 0, birth_count = 0;
  for (Seed seed = 1; seed <= 10; ++seed) {
    const RunSpec spec = testing::spec_of(seed, 40, params);
    const testing::Run run = testing::run(spec);
    Colony colony(spec.params);
    for (const Event& event : run.events) {
      if (const auto* inhibited = std::get_if<Inhibited>(&event.body)) {
        EXPECT_EQ(inhibited->fitness, 0.0);
        ++refused_count;
      }
      if (event.kind() == EventKind::kDivided) {
        const std::array<Support, 2> both = support_of(spec, colony, event);
        const auto itself = [](const Support& one) { return one.on_dish || one.on_older; };
        ASSERT_TRUE(itself(both[0]) || itself(both[1]));
        for (const Support& one : both) ASSERT_TRUE(itself(one) || one.on_sibling);
        ++birth_count;
      }
      colony.apply(event);
    }
  }
  std::printf("%d divisions, %d refused\n", birth_count, refused_count);
  EXPECT_GT(refused_count, 0);
  EXPECT_GT(birth_count, 100);
}

}  // namespace
}  // namespace colony
