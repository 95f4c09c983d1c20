// Path lengths: chords of smooth bodies, the half-lens, shared faces under `max`, the definition by brute force, strips,
// threads, vector widths.
#include "engine/picture/paths.hpp"

#include <algorithm>
#include <cmath>
#include <hwy/targets.h>

#include <gtest/gtest.h>

#include "engine/picture/path_kernel.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/founding.hpp"
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

Frame square_frame(double side_um, std::int64_t side_px) {
  return {side_px, side_px, side_um / static_cast<double>(side_px), -side_um / 2.0, side_um / 2.0};
}

PathView paths(const Colony& colony, ContactRule rule, const Frame& frame, const Effort& effort = {}) {
  return path_lengths(colony, rule, frame, {0, frame.height_px}, effort);
}

/// f~ >= 0 by the definition, every body asked.
bool in_deformed(const Colony& colony, CellId id, ContactRule rule, const Vec3& p) {
  std::vector<const Body*> others;
  for (const Cell& other : colony.cells()) {
    if (other.id != id) others.push_back(&colony.body(other.id));
  }
  return deformed_contains(colony.body(id), others, rule, p);
}

TEST(Paths, ChordOfASmoothEllipsoidIsAnalytic) {
  const double a_um = 9.0, b_um = 6.0, c_um = 3.5;
  for (const double height_um : {5.0, 0.55 * c_um, 0.0}) {
    Cell cell = cell_at(0.3, -0.2, Vec3(a_um, b_um, c_um));
    cell.centre_um.z() = height_um;
    cell.nucleus_radius_um = 0.1;
    const Colony colony = found(paper_without_noise(), {cell});
    const PathView view = paths(colony, ContactRule::kSum, square_frame(20.0, 301));
    double worst_um = 0.0;
    for (std::int64_t row = 0; row < 301; ++row) {
      for (std::int64_t column = 0; column < 301; ++column) {
        const double u = (view.frame.x_um(column) - 0.3) / a_um, v = (view.frame.y_um(row) + 0.2) / b_um;
        const double half_um =
            c_um * std::sqrt(std::max(0.0, 1.0 - u * u - v * v));  // the chord is 2 c sqrt(1 - (x/a)^2 - (y/b)^2)
        const double truth_um = std::max(0.0, height_um + half_um) - std::max(0.0, height_um - half_um);
        const double measured_um = static_cast<double>(view.cell_um[view.index(row, column)]);
        worst_um = std::max(worst_um, std::abs(measured_um - truth_um));
        if (half_um > 0.3 * c_um) {
          ASSERT_NEAR(measured_um, truth_um, 0.004 * c_um) << height_um << " " << row << " " << column;
        }
      }
    }
    EXPECT_LT(worst_um, 0.07 * c_um) << height_um;  // the rim: a chord shorter than a level
  }
}

TEST(Paths, TiltedAndTurnedBodiesHaveTheirVolume) {
  for (std::uint32_t number = 0; number < 6; ++number) {
    Stream stream = testing::case_stream(number, 7);
    const BodyGeometry g = testing::spread_cell(stream, 0.0, 0.0, 1.0);
    Cell cell = cell_at(0.0, 0.0, g.semiaxes_um);
    cell.centre_um = g.centre_um;
    cell.rotation_rad = g.rotation_rad;
    const Colony colony = found(paper_without_noise(), {cell});
    const double volume_um3 = path_volumes_um3(colony, ContactRule::kSum, square_frame(40.0, 400))[0];
    EXPECT_NEAR(volume_um3, volume_above_dish_um3(g), 0.002 * volume_um3) << number;
  }
}

TEST(Paths, TwoEqualParallelEllipsoidsLoseHalfTheLensEach) {
  // Scaled to balls of radius 1 at distance x, the lens is (4 + x) (2 - x)^2 / 16 of a ball.
  const Vec3 semiaxes_um(8.0, 6.0, 4.0);
  for (const double x : {0.6, 1.0, 1.5}) {
    std::vector<Cell> cells = {cell_at(-0.5 * x * semiaxes_um.x(), 0.0, semiaxes_um),
                               cell_at(0.5 * x * semiaxes_um.x(), 0.0, semiaxes_um)};
    for (Cell& cell : cells) cell.centre_um.z() = 10.0;
    const Colony colony = found(paper_without_noise(), cells);
    const double whole_um3 = testing::ellipsoid_volume_um3(semiaxes_um);
    const double lens_um3 = whole_um3 * (4.0 + x) * (2.0 - x) * (2.0 - x) / 16.0;
    for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
      for (const double volume_um3 : path_volumes_um3(colony, rule, square_frame(36.0, 720))) {
        EXPECT_NEAR(volume_um3, whole_um3 - 0.5 * lens_um3, 0.002 * whole_um3) << x;
      }
    }
  }
}

TEST(Paths, LengthsAreThoseOfTheDefinition) {
  const int count = 14;
  const Colony colony = found(paper(), scattered_cells(count, 26.0, 3));
  const Frame frame = square_frame(48.0, 60);
  for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
    const PathView view = paths(colony, rule, frame);
    const double step_um = 0.02;
    double sum_um = 0.0, difference_um = 0.0, worst_um = 0.0;
    for (std::int64_t row = 1; row < 60; row += scaled<std::int64_t>(3, 1)) {
      for (std::int64_t column = 0; column < 60; column += scaled<std::int64_t>(3, 1)) {
        double cell_um = 0.0, nucleus_um = 0.0;
        for (double z_um = 0.5 * step_um; z_um < 8.0; z_um += step_um) {
          const Vec3 p(frame.x_um(column), frame.y_um(row), z_um);
          for (const Cell& cell : colony.cells()) {
            if (!in_deformed(colony, cell.id, rule, p)) continue;
            cell_um += step_um;
            const Vec3 d = p - cell.nucleus_um;
            const double r = cell.nucleus_radius_um, h = std::min(r, 0.6 * cell.semiaxes_um.z());
            if ((d.x() * d.x() + d.y() * d.y()) / (r * r) + d.z() * d.z() / (h * h) <= 1.0) nucleus_um += step_um;
          }
        }
        const std::size_t at = view.index(row, column);
        const double difference = std::abs(static_cast<double>(view.cell_um[at]) - cell_um);
        worst_um = std::max({worst_um, difference, std::abs(static_cast<double>(view.nucleus_um[at]) - nucleus_um)});
        difference_um += difference;
        sum_um += cell_um;
      }
    }
    EXPECT_LT(difference_um, 0.006 * sum_um);
    EXPECT_LT(worst_um, 0.35);  // a ray along a membrane can lose a fold of one level
  }
}

TEST(Paths, FacesAreSharedWithoutGapUnderMax) {
  const Colony colony = found(paper(), scattered_cells(20, 26.0, 5));
  const Frame frame = square_frame(50.0, 250);
  const PathView shared = paths(colony, ContactRule::kMax, frame);
  const PathView with_voids = paths(colony, ContactRule::kSum, frame);
  // The union, each column by dense steps.
  const double step_um = 0.01;
  double union_um = 0.0, sum_um = 0.0, voids_um = 0.0;
  for (std::int64_t row = 2; row < 250; row += scaled<std::int64_t>(9, 3)) {
    for (std::int64_t column = 2; column < 250; column += scaled<std::int64_t>(9, 3)) {
      for (double z_um = 0.5 * step_um; z_um < 8.0; z_um += step_um) {
        const Vec3 p(frame.x_um(column), frame.y_um(row), z_um);
        const bool any = std::any_of(colony.cells().begin(), colony.cells().end(),
                                     [&](const Cell& cell) { return colony.body(cell.id).contains(p); });
        union_um += any ? step_um : 0.0;
      }
      sum_um += static_cast<double>(shared.cell_um[shared.index(row, column)]);
      voids_um += static_cast<double>(shared.cell_um[shared.index(row, column)] -
                                      with_voids.cell_um[with_voids.index(row, column)]);
    }
  }
  EXPECT_NEAR(sum_um, union_um, 0.001 * union_um);
  EXPECT_GT(voids_um, 0.005 * union_um);  // `sum` leaves voids in this crowd: the two rules are not the same thing
  for (std::size_t i = 0; i < shared.cell_um.size(); ++i) ASSERT_GE(shared.cell_um[i] - with_voids.cell_um[i], -1e-4F);
}

TEST(Paths, VolumesAreThoseOfSobolPoints) {
  const Colony colony = found(paper(), scattered_cells(12, 30.0, 9));
  const PointSet points = testing::points(65536, 1);
  for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
    const std::vector<double> volumes_um3 = path_volumes_um3(colony, rule, square_frame(60.0, 600));
    for (const Cell& cell : colony.cells()) {
      std::vector<const Body*> others;
      for (const Cell& other : colony.cells()) {
        if (other.id != cell.id) others.push_back(&colony.body(other.id));
      }
      const MassEstimate mass = deformed_mass(colony.body(cell.id), others, rule, points);
      EXPECT_NEAR(volumes_um3[cell.id.value - 1], mass.volume_um3, 0.004 * colony.body(cell.id).box().volume())
          << cell.id.value;
    }
  }
}

TEST(Paths, StripsAndThreadsCannotMatter) {
  const Colony colony = found(paper(), scattered_cells(25, 40.0, 4));
  const Frame frame{210, 173, 0.31, -31.0, 27.0};
  const PathView whole = paths(colony, ContactRule::kSum, frame);
  EXPECT_GT(*std::max_element(whole.nucleus_um.begin(), whole.nucleus_um.end()), 1.0F);
  const std::vector<double> volumes = path_volumes_um3(colony, ContactRule::kSum, frame);
  for (const int threads : {2, 7}) {
    const PathView other = paths(colony, ContactRule::kSum, frame, Effort{threads, nullptr});
    EXPECT_EQ(other.cell_um, whole.cell_um);
    EXPECT_EQ(other.nucleus_um, whole.nucleus_um);
    EXPECT_EQ(path_volumes_um3(colony, ContactRule::kSum, frame, Effort{threads, nullptr}), volumes);
  }
  for (const std::int64_t rows : {1, 16, 37}) {
    std::vector<float> cell_um, nucleus_um;
    for (std::int64_t row = 0; row < frame.height_px; row += rows) {
      const PathView strip =
          path_lengths(colony, ContactRule::kSum, frame, {row, std::min(row + rows, frame.height_px)});
      cell_um.insert(cell_um.end(), strip.cell_um.begin(), strip.cell_um.end());
      nucleus_um.insert(nucleus_um.end(), strip.nucleus_um.begin(), strip.nucleus_um.end());
    }
    EXPECT_EQ(cell_um, whole.cell_um) << rows;
    EXPECT_EQ(nucleus_um, whole.nucleus_um) << rows;
  }
}

TEST(Paths, EveryVectorWidthGivesTheSameBits) {
  const Colony colony = found(paper(), scattered_cells(20, 30.0, 6));
  const Frame frame = square_frame(50.0, 131);
  for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
    const PathView best = paths(colony, rule, frame);
    int target_count = 0;
    for (std::int64_t bit = 1; bit > 0 && bit <= hwy::SupportedTargets(); bit <<= 1) {
      if ((hwy::SupportedTargets() & bit) == 0) continue;
      hwy::SetSupportedTargetsForTest(bit);
      hwy::GetChosenTarget().DeInit();
      const PathView view = paths(colony, rule, frame);
      hwy::SetSupportedTargetsForTest(0);
      hwy::GetChosenTarget().DeInit();
      EXPECT_EQ(view.cell_um, best.cell_um) << hwy::TargetName(bit);
      EXPECT_EQ(view.nucleus_um, best.nucleus_um) << hwy::TargetName(bit);
      ++target_count;
    }
    EXPECT_GE(target_count, 3);
  }
}

TEST(Paths, APileOfCellsIsStillOneBody) {
  // 40 bodies in one column: more than any buffer begins with.
  const Colony colony = found(paper(), scattered_cells(40, 3.0, 8));
  const PathView view = paths(colony, ContactRule::kMax, square_frame(30.0, 50));
  EXPECT_LT(*std::max_element(view.cell_um.begin(), view.cell_um.end()), 9.0F);
  EXPECT_GT(*std::max_element(view.cell_um.begin(), view.cell_um.end()), 4.0F);
}

}  // namespace
}  // namespace colony
