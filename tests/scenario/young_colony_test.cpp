// What moves make of a colony: the cells of a young one stand apart, with the same seeds of preset paper as control.
// Reduced: 24 seeds; COLONY_TEST_FULL=1: 60.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

struct Figures {
  double nearest_um = 0.0;  // mean distance of a cell's centre to the nearest other, in the plane
  double alone = 0.0;        // share of cells that touch nobody
  double gyration_um = 0.0; // root mean square distance from the centre
};

Figures measure(const Colony& colony) {
  Figures f;
  const auto n = static_cast<double>(colony.cells().size());
  Vec2 centre = Vec2::Zero();
  for (const Cell& cell : colony.cells()) centre += cell.centre_um.head<2>() / n;
  const PointSet points = testing::points(4096, 1);
  double squares = 0.0;
  for (const Cell& cell : colony.cells()) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Cell& other : colony.cells()) {
      if (other.id != cell.id) nearest = std::min(nearest, (cell.centre_um - other.centre_um).head<2>().norm());
    }
    f.nearest_um += nearest / n;
    squares += (cell.centre_um.head<2>() - centre).squaredNorm() / n;
    const std::vector<const Body*> near = testing::neighbours_of(colony, cell.id);
    const bool touched =
        std::any_of(near.begin(), near.end(), [&](const Body* body) { return touches(colony.body(cell.id), *body, points); });
    f.alone += touched ? 0.0 : 1.0 / n;
  }
  f.gyration_um = std::sqrt(squares);
  return f;
}

TEST(YoungColony, StandsMoreApartThanAColonyThatDoesNotMove) {
  std::vector<double> nearest, alone, gyration, paper_nearest, paper_alone, paper_gyration;
  for (Seed seed = 1; seed <= testing::scaled<Seed>(24, 60); ++seed) {
    const Figures young = measure(testing::run(testing::spec_of(seed, 30, *preset("young-colony"))).colony());
    const Figures paper = measure(testing::run(testing::spec_of(seed, 30)).colony());
    nearest.push_back(young.nearest_um - paper.nearest_um);
    alone.push_back(young.alone - paper.alone);
    gyration.push_back(young.gyration_um - paper.gyration_um);
    paper_nearest.push_back(paper.nearest_um);
    paper_alone.push_back(paper.alone);
    paper_gyration.push_back(paper.gyration_um);
  }
  const auto print = [&](const char* name, const std::vector<double>& more, const std::vector<double>& control) {
    const testing::Mean a = testing::mean_of(more), b = testing::mean_of(control);
    std::printf("figure: 30 cells, %s: paper %.3f +- %.3f, young-colony %+.3f +- %.3f (%zu seeds)\n", name, b.value, b.se, a.value,
                a.se, more.size());
    EXPECT_GT(a.value, 2.5 * a.se) << name;
  };
  print("distance to the nearest cell, um", nearest, paper_nearest);
  print("share of cells that touch nobody", alone, paper_alone);
  print("radius of gyration, um", gyration, paper_gyration);
}

// Crawling makes room, so fewer cells are inhibited.
TEST(YoungColony, GrowsFasterThanAColonyThatDoesNotMove) {
  const std::vector<std::uint64_t> sizes = testing::scaled<std::vector<std::uint64_t>>({100, 180}, {180, 1000});
  std::vector<double> young, paper;  // h, at those sizes
  for (const bool crawls : {false, true}) {
    Params params = *preset(crawls ? "young-colony" : "paper");
    params.division.generation_limit.reset();
    Simulator simulator(testing::spec_of(1, sizes.back(), params));
    while (const std::optional<Event> event = simulator.step()) {
      std::vector<double>& hours = crawls ? young : paper;
      if (hours.size() < sizes.size() && simulator.colony().cells().size() == sizes[hours.size()]) hours.push_back(event->time_h);
    }
  }
  ASSERT_EQ(young.size(), sizes.size());
  ASSERT_EQ(paper.size(), sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    std::printf("figure: seed 1 without limit, %d cells: young-colony at %.0f h, paper at %.0f h\n", static_cast<int>(sizes[i]), young[i], paper[i]);
    EXPECT_LT(young[i], 0.9 * paper[i]);
  }
}

}  // namespace
}  // namespace colony
