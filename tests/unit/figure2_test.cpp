// The paper's figure 2: slope, error and range of a simulated 180-cell contour picture and of photographs, and what a sceptic would ask next.
#include "tests/support/figure2.hpp"

#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scale.hpp"

namespace colony {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

void show(const CountedPicture& picture) {
  for (const auto& [name, line, finding] : {std::tuple("walls", &picture.lines.walls, &picture.findings.walls),
                                            std::tuple("outline", &picture.lines.outline, &picture.findings.outline)}) {
    if (!line->dimensions) continue;
    std::printf("figure: figure 2, %s, %s of %d %s: D0 %s, r2 %.3f, boxes of %d to %d px, local slopes %.2f to %.2f, %s\n", picture.name.c_str(), name,
                static_cast<int>(picture.cell_count), std::string(name_of(picture.objects)).c_str(), with_error(line->dimensions->capacity).c_str(), line->dimensions->capacity.r2,
                static_cast<int>(line->dimensions->side_min_px), static_cast<int>(line->dimensions->side_max_px), finding->slopes.first,
                finding->slopes.last, std::string(name_of(finding->finding)).c_str());
  }
}

TEST(Figure2, TheSimulatedColonyHasTheStraightLineOfThePaperAndItIsACrossover) {
  const CountedPicture colony = simulated_180(1, scaled(1024, 2048), 2);
  show(colony);
  ASSERT_EQ(colony.cell_count, 180u);
  ASSERT_TRUE(colony.lines.walls.dimensions && colony.lines.outline.dimensions);
  const Dimension& walls = colony.lines.walls.dimensions->capacity;
  // What the paper shows: a straight line with an error of a few hundredths over more than a decade.
  EXPECT_GT(walls.value, 1.3);
  EXPECT_LT(walls.value, 1.5);
  EXPECT_LT(walls.standard_error, 0.05);
  EXPECT_GT(walls.r2, 0.985);
  EXPECT_EQ(colony.lines.walls.dimensions->side_min_px, 3);
  EXPECT_GT(colony.findings.walls.slopes.decades, 1.4);
  // What it does not ask: the slopes go from those of a line to those of the plane, and colonies without any roughness do the same.
  EXPECT_EQ(colony.findings.walls.finding, Finding::kCrossover);
  EXPECT_LT(colony.findings.walls.slopes.first, 1.2);
  EXPECT_GT(colony.findings.walls.slopes.last, 1.65);
  ASSERT_EQ(colony.controls.size(), 3u);
  EXPECT_THAT(colony.findings.walls.like_controls, Contains("without_noise"));
  EXPECT_THAT(colony.findings.walls.like_controls, Contains("hexagonal"));
  EXPECT_THAT(colony.verdict, Contains(HasSubstr("The cell walls: a crossover, not scaling")));
  EXPECT_THAT(colony.verdict, Contains(HasSubstr("says nothing about a fractal nature of the cell walls")));
  // The outline is nearly a smooth line.
  EXPECT_GT(colony.lines.outline.dimensions->capacity.value, 1.0);
  EXPECT_LT(colony.lines.outline.dimensions->capacity.value, 1.2);
}

TEST(Figure2, PhotographsGoTheSameWayBesideTheirOwnControls) {
  int read = 0;
  for (const RealPicture& picture : kRealPictures) {
    // The two of a whole well take 20 s each.
    if (std::string_view(picture.file).starts_with("h3122") && !full_run()) continue;
    const auto counted = real_picture(picture, 2);
    if (!counted) continue;
    ++read;
    show(*counted);
    EXPECT_EQ(counted->controls.size(), 2u);  // nobody knows a photograph without its noise
    // None of them is a fractal that box counting could show: no power law over a decade that a control does not have too.
    const LineFinding& walls = counted->findings.walls;
    EXPECT_TRUE(walls.finding != Finding::kScaling || !walls.like_controls.empty()) << picture.file;
    const std::string name = line_names(counted->objects).walls;
    EXPECT_THAT(counted->verdict, Contains(HasSubstr("What follows for the " + name)));
    EXPECT_THAT(counted->verdict, Contains(HasSubstr("the " + name + " could be counted at")));
    // The controls fill the field as the picture's objects do, and are counted with the same boxes.
    for (const ControlReport& control : counted->controls) {
      EXPECT_EQ(control.placement, counted->object_cover < 0.7 ? Placement::kSpread : Placement::kTouching) << picture.file;
      ASSERT_TRUE(counted->lines.walls.dimensions && control.lines.walls.dimensions) << picture.file;
      EXPECT_EQ(control.lines.walls.dimensions->side_max_px, counted->lines.walls.dimensions->side_max_px);
    }
  }
  if (read == 0) GTEST_SKIP() << "COLONY_DATA has no pictures: not part of the project";
}

}  // namespace
}  // namespace colony
