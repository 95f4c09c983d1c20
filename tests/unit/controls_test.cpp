// Controls: matched in number, size and field; what they are known to be.
#include "engine/analysis/controls.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/report.hpp"
#include "engine/base/maths.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/label_images.hpp"

namespace colony {
namespace {

using namespace testing;

std::vector<LabelArea> areas_of(std::size_t count, std::uint64_t first, std::uint64_t step) {
  std::vector<LabelArea> areas;
  for (std::size_t i = 0; i < count; ++i) areas.push_back({static_cast<std::uint32_t>(i + 1), first + step * i});
  return areas;
}

TEST(Controls, HexagonalMatchesNumberAndMeanArea) {
  const std::vector<LabelArea> areas = areas_of(91, 500, 10);
  const LabelImage control = *hexagonal_control(areas, 0.5);
  EXPECT_EQ(control.um_per_px, 0.5);
  const std::vector<LabelArea> found = label_areas(control);
  ASSERT_EQ(found.size(), 91u);
  double mean = 0.0;
  for (const LabelArea& area : found) mean += static_cast<double>(area.area_px) / 91.0;
  EXPECT_NEAR(mean, 950.0, 5.0);
  // 91 = 1 + 6 + 12 + 18 + 24 + 30: whole shells, as wide as high (times sqrt(3)/2 of 10 steps).
  const double radius = std::sqrt(950.0 / maths::kPi);
  EXPECT_NEAR(static_cast<double>(control.width_px), 10.0 * 2.0 * radius + 4.0 * radius, 2.0);
  EXPECT_NEAR(static_cast<double>(control.height_px), 10.0 * std::sqrt(3.0) * radius + 4.0 * radius, 2.0);
}

TEST(Controls, RandomDiscsMatchNumberAndSizesAndHangOnTheSeedAlone) {
  const std::vector<LabelArea> areas = areas_of(200, 200, 3);
  const LabelImage control = *random_disc_control(areas, 7);
  EXPECT_EQ(control, *random_disc_control(areas, 7));
  EXPECT_NE(control, *random_disc_control(areas, 8));
  // A disc alone keeps its size.
  EXPECT_NEAR(static_cast<double>(label_areas(*random_disc_control({{5, 2000}}, 1)).front().area_px), 2000.0, 40.0);
  EXPECT_EQ(label_areas(*random_disc_control({{5, 2000}}, 1)).front().label, 5u);
  // Uniform places: discs of the colony's own area leave about exp(-1) of the middle open (the Boolean model).
  std::uint64_t open = 0, all = 0;
  for (std::int64_t row = control.height_px / 3; row < control.height_px * 2 / 3; ++row) {
    for (std::int64_t column = control.width_px / 3; column < control.width_px * 2 / 3; ++column) {
      ++all;
      open += control.at(row, column) == 0 ? 1 : 0;
    }
  }
  EXPECT_NEAR(static_cast<double>(open) / static_cast<double>(all), std::exp(-1.0), 0.1);
}

LabelImage rectangle_of(std::int64_t width, std::int64_t height, PixelBox box) {
  LabelImage labels(width, height);
  for (std::int64_t row = box.top; row < box.top + box.height; ++row) {
    for (std::int64_t column = box.left; column < box.left + box.width; ++column) labels.at(row, column) = 1;
  }
  return labels;
}

TEST(Controls, TheHullIsTheLeastConvexSetOfPixels) {
  const Hull box = hull_of(rectangle_of(40, 30, {5, 6, 20, 10}));
  EXPECT_EQ(box.area_px, 200);
  EXPECT_EQ(box.rows[5].end, 0);
  EXPECT_EQ(box.rows[6].first, 5);
  EXPECT_EQ(box.rows[15].end, 25);
  LabelImage corners(101, 101);
  corners.at(0, 0) = corners.at(100, 0) = corners.at(100, 100) = 1;  // half a square, its diagonal a pixel thick
  const Hull triangle = hull_of(corners);
  EXPECT_EQ(triangle.rows[50].first, 0);
  EXPECT_NEAR(static_cast<double>(triangle.rows[50].end), 51.0, 1.0);
  EXPECT_NEAR(static_cast<double>(triangle.area_px), 101.0 * 101.0 / 2.0 + 101.0, 101.0);  // centres on the diagonal edge may count or not
  EXPECT_EQ(hull_of(LabelImage(7, 7)).area_px, 0);
}

/// Objects that stand apart: a control that packs them, or a field as large as their areas together, would be another picture altogether.
TEST(Controls, OfDispersedObjectsFillTheSameFieldAsEvenly) {
  LabelImage frame = rectangle_of(600, 500, {0, 0, 1, 1});
  frame.at(499, 599) = frame.at(0, 599) = frame.at(499, 0) = 1;
  const Hull hull = hull_of(frame);
  ASSERT_EQ(hull.area_px, 300'000);
  const std::vector<LabelArea> areas = areas_of(300, 100, 0);
  for (const bool is_random : {false, true}) {
    const LabelImage control = is_random ? *random_disc_control(areas, hull, 3) : *hexagonal_control(areas, hull);
    EXPECT_EQ(control.width_px, 600);
    EXPECT_EQ(control.height_px, 500);
    const auto covered = static_cast<double>(std::count_if(control.values.begin(), control.values.end(), [](std::uint32_t v) { return v != 0; }));
    EXPECT_NEAR(covered, 30'000.0, is_random ? 3'500.0 : 1'500.0);  // the frame cuts some, random ones overlap
    // A quarter of the frame holds a quarter of them, within 4 standard deviations of a binomial, or a lattice's rim.
    int quarter = 0;
    const std::vector<Shape> seen = *cell_shapes(control);
    for (const Shape& shape : seen) quarter += shape.centre_x_px < 300.0 && shape.centre_y_px < 250.0 ? 1 : 0;
    EXPECT_NEAR(quarter, 75, is_random ? 30 : 12);
  }
  // The lattice is one: each disc inside has a neighbour at one and the same distance.
  const std::vector<Shape> shapes = *cell_shapes(*hexagonal_control(areas, hull));
  const double spacing = std::sqrt(2.0 / std::sqrt(3.0) * 300'000.0 / 300.0);
  ASSERT_EQ(shapes.size(), 300u);
  for (std::size_t i = 0; i < 100; ++i) {  // from the centre outwards
    double nearest = 1e9;
    for (const Shape& other : shapes) {
      const double dx = other.centre_x_px - shapes[i].centre_x_px, dy = other.centre_y_px - shapes[i].centre_y_px;
      if (other.label != shapes[i].label) nearest = std::min(nearest, std::sqrt(dx * dx + dy * dy));
    }
    EXPECT_NEAR(nearest, spacing, 0.08 * spacing);
  }
  // A hull a pixel thin has few lattice points however wide the frame is: they are found all the same.
  LabelImage thin(2000, 2000);
  for (std::int64_t i = 0; i < 2000; ++i) thin.at(i, i) = 1;
  EXPECT_EQ(label_areas(*hexagonal_control(areas_of(50, 4, 0), hull_of(thin))).size(), 50u);
  EXPECT_EQ(hexagonal_control(areas, Hull{10, 10, std::vector<Hull::Span>(10), 0}).error().fields.front().pointer, "hull");
  EXPECT_EQ(random_disc_control(areas, Hull{}, 1).error().fields.front().pointer, "hull");
}

TEST(Controls, OfAPictureAreSpreadWhereItsObjectsStandApartAndHaveItsBoxes) {
  LabelImage labels(800, 800);
  std::vector<LabelDisc> discs;
  for (std::uint32_t k = 0; k < 100; ++k) discs.push_back({k + 1, 40.0 + 80.0 * (k % 10), 40.0 + 80.0 * (k / 10), 8.0});
  draw_discs(discs, labels);
  const LineReport lines = analyse_lines(labels, 0, {});
  const MatchedControls matched = matched_controls(labels, lines, 1, {});
  EXPECT_LT(matched.cover, 0.06);
  for (const ControlReport& control : matched.reports) {
    EXPECT_EQ(control.placement, Placement::kSpread);
    ASSERT_TRUE(control.lines.walls.dimensions);
    EXPECT_EQ(control.lines.walls.dimensions->side_max_px, lines.walls.dimensions->side_max_px);
    EXPECT_EQ(control.lines.walls.dimensions->counts.size(), lines.walls.dimensions->counts.size());
  }
  // A square lattice is nearly the hexagonal one: packed together the same discs had 1.3 to 1.5.
  EXPECT_NEAR(matched.reports[0].lines.walls.dimensions->capacity.value, lines.walls.dimensions->capacity.value, 0.08);
  EXPECT_THAT(control_sentences(ObjectKind::kNuclei, matched.cover, 100).back(), ::testing::HasSubstr("outlines of single nuclei"));
  const LabelImage packed = *hexagonal_control(areas_of(61, 900, 0));
  EXPECT_EQ(matched_controls(packed, analyse_lines(packed, 0, {}), 1, {}).reports[0].placement, Placement::kTouching);
}

TEST(Controls, RefuseByName) {
  EXPECT_EQ(hexagonal_control({}).error().fields.front().pointer, "areas");
  EXPECT_EQ(random_disc_control({}, 1).error().fields.front().pointer, "areas");
  EXPECT_EQ(hexagonal_control(std::vector<LabelArea>(1000, {1, 400'000'000})).error().code, ErrorCode::kLimit);
  const Colony colony = found(paper(), {ball_at(0, 0, 6.0)});
  EXPECT_FALSE(noise_free_control(colony, 0, 10, 1.0, 0.0, 0.0));
  EXPECT_EQ(noise_free_control(colony, 50'000, 10, 1.0, 0.0, 0.0).error().code, ErrorCode::kLimit);
  EXPECT_FALSE(noise_free_control(colony, 10, 10, 1.0, std::nan(""), 0.0));
}

/// The highest point by brute force over the smooth field.
TEST(Controls, WithoutNoiseIsTheViewOfTheSmoothBodies) {
  const Colony colony = found(paper(), scattered_cells(12, 30.0, 5));
  const double scale = 0.7, left = -33.0, top = 29.0;
  const LabelImage control = *noise_free_control(colony, 90, 80, scale, left, top);
  int covered = 0;
  for (std::int64_t row = 0; row < 80; row += 3) {
    for (std::int64_t column = 0; column < 90; column += 3) {
      const double x = left + (static_cast<double>(column) + 0.5) * scale, y = top - (static_cast<double>(row) + 0.5) * scale;
      double best = -1.0, second = -1.0;
      std::uint32_t owner = 0;
      for (const Cell& cell : colony.cells()) {
        for (double z = 8.0; z >= 0.0; z -= 0.01) {
          if (colony.body(cell.id).smooth_field(Vec3(x, y, z)) < 0.0) continue;
          if (z > best) {
            second = best;
            best = z;
            owner = cell.id.value;
          } else {
            second = std::max(second, z);
          }
          break;
        }
      }
      // Between steps the order of two equal heights is open; so is a rim that a step misses.
      if (best >= 0.0 && best - second > 0.02) {
        EXPECT_EQ(control.at(row, column), owner) << row << " " << column;
        ++covered;
      }
    }
  }
  EXPECT_GT(covered, 100);
}

}  // namespace
}  // namespace colony
