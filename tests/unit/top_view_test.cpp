#include "engine/picture/top_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/picture/column.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/targets.hpp"

namespace colony {
namespace {

using testing::ball_at;
using testing::found;
using testing::paper;
using testing::paper_without_noise;
using testing::scattered_cells;

/// A square frame around the origin.
Frame square_frame(double side_um, std::int64_t side_px) {
  return {side_px, side_px, side_um / static_cast<double>(side_px), -side_um / 2.0, side_um / 2.0};
}

/// The definition: the highest z >= 0, in steps, where any deformed cell is; and which cell. 0 if there is none.
struct Seen {
  double height_um = 0.0;
  std::uint32_t owner = 0;
};
Seen seen_by_definition(const Colony& colony, ContactRule rule, double x_um, double y_um, double step_um) {
  for (double z_um = 12.0; z_um >= 0.0; z_um -= step_um) {
    const Vec3 point(x_um, y_um, z_um);
    for (const Cell& cell : colony.cells()) {
      const Body& body = colony.body(cell.id);
      if (!body.contains(point)) continue;
      std::vector<const Body*> others;
      for (const Cell& other : colony.cells()) {
        if (other.id != cell.id) others.push_back(&colony.body(other.id));
      }
      if (deformed_field(body, others, rule, point) >= 0.0) return {z_um, cell.id.value};
    }
  }
  return {};
}

TEST(TopView, BallHasItsAreaAndHeight) {
  const double radius_um = 7.0;
  const Colony colony = found(paper_without_noise(), {ball_at(0.4, -0.7, radius_um)});
  const TopView view = top_view(colony, square_frame(18.0, 512));
  const double middle_um = 0.55 * radius_um;
  std::int64_t covered = 0;
  for (std::int64_t row = 0; row < 512; ++row) {
    for (std::int64_t column = 0; column < 512; ++column) {
      const double dx = view.frame.x_um(column) - 0.4, dy = view.frame.y_um(row) + 0.7;
      const double under = radius_um * radius_um - dx * dx - dy * dy;
      const std::size_t at = view.index(row, column);
      covered += view.owner[at];
      // The shadow is the ball's equator, which stands above the dish.
      ASSERT_EQ(view.owner[at], under >= 0.0 ? 1u : 0u) << row << " " << column;
      if (under >= 0.0) {
        ASSERT_NEAR(view.height_um[at], middle_um + std::sqrt(under), 1e-5) << row << " " << column;
      }
    }
  }
  const double area_um2 = static_cast<double>(covered) * view.frame.um_per_px * view.frame.um_per_px;
  EXPECT_NEAR(area_um2, maths::kPi * radius_um * radius_um, 0.002 * maths::kPi * radius_um * radius_um);
}

TEST(TopView, EqualNeighboursMeetInTheMidPlane) {
  const Colony colony = found(paper_without_noise(), {ball_at(-4.0, 0.0, 7.0), ball_at(4.0, 0.0, 7.0)});
  const TopView view = top_view(colony, square_frame(26.0, 333));  // odd: one column lies on the plane itself
  std::int64_t left = 0, right = 0;
  for (std::int64_t row = 0; row < 333; ++row) {
    for (std::int64_t column = 0; column < 333; ++column) {
      const std::uint32_t owner = view.owner[view.index(row, column)];
      left += owner == 1;
      right += owner == 2;
      if (owner == 0 || std::abs(view.frame.x_um(column)) < view.frame.um_per_px) continue;
      ASSERT_EQ(owner, view.frame.x_um(column) < 0.0 ? 1u : 2u) << row << " " << column;
    }
  }
  EXPECT_GT(left, 10000);
  EXPECT_NEAR(static_cast<double>(left), static_cast<double>(right), 333.0);
}

TEST(TopView, OverlappingTripleIsSharedByTheNearestCentre) {
  std::vector<Cell> cells;
  for (int i = 0; i < 3; ++i) {
    const maths::SinCos angle = maths::sincos(2.0 * maths::kPi * i / 3.0);
    cells.push_back(ball_at(4.5 * angle.cos, 4.5 * angle.sin, 7.0));
  }
  const Colony colony = found(paper_without_noise(), cells);
  const TopView view = top_view(colony, square_frame(26.0, 200));
  int counts[3] = {0, 0, 0};
  for (std::int64_t row = 0; row < 200; ++row) {
    for (std::int64_t column = 0; column < 200; ++column) {
      const std::uint32_t owner = view.owner[view.index(row, column)];
      if (owner == 0) continue;
      const Vec2 at(view.frame.x_um(column), view.frame.y_um(row));
      double distance[3];
      for (int i = 0; i < 3; ++i) distance[i] = std::sqrt((cells[i].centre_um.head<2>() - at).squaredNorm());
      const auto nearest = std::min_element(distance, distance + 3) - distance;
      ++counts[owner - 1];
      ASSERT_LE(distance[owner - 1], distance[nearest] + view.frame.um_per_px) << row << " " << column;
    }
  }
  for (const int count : counts) EXPECT_GT(count, 3000);
}

// Under the middle of three deeply overlapping cells the rule `sum` leaves a void and `max` does not; from above both
// look alike.
TEST(TopView, ShowsTheSameUnderBothContactRules) {
  std::vector<Cell> cells;
  for (int i = 0; i < 3; ++i) {
    const maths::SinCos angle = maths::sincos(2.0 * maths::kPi * i / 3.0);
    cells.push_back(ball_at(3.0 * angle.cos, 3.0 * angle.sin, 7.0));
  }
  const Colony balls = found(paper_without_noise(), cells);
  const Body* bodies[3] = {&balls.body(CellId{1}), &balls.body(CellId{2}), &balls.body(CellId{3})};
  const std::vector<const Body*> others = {bodies[1], bodies[2]};
  EXPECT_LT(deformed_field(*bodies[0], others, ContactRule::kSum, Vec3(0.0, 0.0, 3.0)), 0.0);
  EXPECT_GE(deformed_field(*bodies[0], others, ContactRule::kMax, Vec3(0.01, 0.0, 3.0)), 0.0);

  constexpr double kStep_um = 0.02;
  const std::int64_t side_px = 30;
  const Colony noisy = found(paper(), scattered_cells(7, 22.0, 4));
  for (const Colony* colony : {&balls, &noisy}) {
    const TopView view = top_view(*colony, square_frame(30.0, side_px));
    for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
      int compared = 0, owners_differ = 0;
      for (std::int64_t row = 0; row < side_px; ++row) {
        for (std::int64_t column = 0; column < side_px; ++column) {
          const Seen seen = seen_by_definition(*colony, rule, view.frame.x_um(column), view.frame.y_um(row), kStep_um);
          const std::size_t at = view.index(row, column);
          const double height_um = view.height_um[at];
          // The steps may pass over the thin upper rim of a face or the tip of a lobe: never find more than there is.
          ASSERT_LE(seen.height_um, height_um + 1e-4) << row << " " << column;
          if (seen.owner == 0) continue;
          ASSERT_NEAR(seen.height_um, height_um, 3.0 * kStep_um) << row << " " << column;
          ++compared;
          owners_differ += seen.owner != view.owner[at];
        }
      }
      EXPECT_GT(compared, 250);
      EXPECT_LE(owners_differ, compared / 100);  // pixels on a border, where the tops differ by less than a step
    }
  }
}

TEST(TopView, ColumnFieldIsTheBodysField) {
  const Colony colony = found(paper(), scattered_cells(20, 10.0, 9));
  for (const Cell& cell : colony.cells()) {
    const Body& body = colony.body(cell.id);
    const ColumnScan scan(body);
    Stream stream(1, cell.id, 0, Purpose::kSettlePoints);
    for (int i = 0; i < 500; ++i) {
      const double x = stream.uniform({body.box().low.x(), body.box().high.x()});
      const double y = stream.uniform({body.box().low.y(), body.box().high.y()});
      const double z = stream.uniform({0.0, body.box().high.z()});
      ASSERT_NEAR(scan.column(x, y).field(z), body.field(Vec3(x, y, z)), kColumnFieldError);
    }
  }
}

TEST(TopView, NothingOfTheBodyStandsAboveItsTop) {
  for (const NoiseParams noise :
       {NoiseParams{0.40, 5.0, 1.4}, NoiseParams{0.45, 5.0, 6.2}, NoiseParams{0.40, 8.0, 1.4}}) {
    Params params = paper();
    params.noise = noise;
    const Colony colony = found(params, scattered_cells(12, 10.0, 11));
    for (const Cell& cell : colony.cells()) {
      const Body& body = colony.body(cell.id);
      const ColumnScan scan(body);
      Stream stream(2, cell.id, 0, Purpose::kSettlePoints);
      for (int i = 0; i < 60; ++i) {
        const double x = stream.uniform({body.box().low.x(), body.box().high.x()});
        const double y = stream.uniform({body.box().low.y(), body.box().high.y()});
        const double top_um = scan.top_um(x, y, 0.0);
        int outside_run = 0;
        for (double z = top_um + 1e-3; z <= body.box().high.z(); z += 0.005) {
          // A lobe thinner than the smallest step may be missed, nothing more.
          outside_run = body.contains(Vec3(x, y, z)) ? outside_run + 1 : 0;
          ASSERT_LE(outside_run * 0.005, kScanStepMin_um + 0.005);
        }
        if (top_um > 0.0) {
          ASSERT_NEAR(body.field(Vec3(x, y, top_um)), 0.0, 2e-3);
        }
      }
    }
  }
}

TEST(TopView, ColumnsSideBySideAreTheScalarScanToTheLastBit) {
  for (const NoiseParams noise : {NoiseParams{0.40, 5.0, 1.4}, NoiseParams{0.45, 5.0, 6.2}, NoiseParams{0.0, 5.0, 1.4}}) {
    Params params = paper();
    params.noise = noise;
    const Colony colony = found(params, scattered_cells(6, 10.0, 13));
    testing::on_every_target([&](const std::string&) {
      int raised = 0;
      for (const Cell& cell : colony.cells()) {
        const Body& body = colony.body(cell.id);
        const ColumnScan scan(body);
        const kernel::TopBody prepared = scan.prepared();
        Stream stream(4, cell.id, 0, Purpose::kSettlePoints);
        for (int round = 0; round < 20; ++round) {
          std::array<double, kernel::kTopRun> x{}, floor{}, top{};
          const double y = stream.uniform({body.box().low.y(), body.box().high.y()});
          for (std::size_t i = 0; i < x.size(); ++i) {
            x[i] = stream.uniform({body.box().low.x() - 1.0, body.box().high.x() + 1.0});
            // What another cell left there: nothing, something, or more than this cell can reach.
            floor[i] = i % 3 == 0 ? 0.0 : stream.uniform({0.0, 1.2 * body.box().high.z()});
          }
          const std::size_t count = 1 + static_cast<std::size_t>(stream.uniform({0.0, 63.0}));
          kernel::column_tops(prepared, x.data(), y, floor.data(), count, top.data());
          for (std::size_t i = 0; i < count; ++i) {
            ASSERT_EQ(top[i], scan.top_um(x[i], y, floor[i])) << i << " of " << count;
            raised += top[i] > floor[i] ? 1 : 0;
          }
        }
      }
      EXPECT_GT(raised, 500);
    }, false);
  }
}

TEST(TopView, NoiseLimitsHold) {
  const Colony colony = found(paper(), scattered_cells(15, 10.0, 5));
  double tightest = 1.0;
  for (const Cell& cell : colony.cells()) {
    const Body& body = colony.body(cell.id);
    const ColumnScan scan(body);
    Stream stream(3, cell.id, 0, Purpose::kSettlePoints);
    for (int i = 0; i < 50; ++i) {
      const double x = stream.uniform({body.box().low.x(), body.box().high.x()});
      const double y = stream.uniform({body.box().low.y(), body.box().high.y()});
      const double low = stream.uniform({0.0, body.box().high.z()});
      const double high = low + stream.uniform({0.05, 1.5});
      const NoiseLimits limits = scan.noise_limits(scan.column(x, y), low, high);
      tightest = std::min(tightest, limits.bound / body.noise_bound());
      const auto noise = [&](double z) { return body.field(Vec3(x, y, z)) - body.smooth_field(Vec3(x, y, z)); };
      for (int k = 0; k < 40; ++k) {
        const double z = low + (high - low) * k / 40.0, next = low + (high - low) * (k + 1) / 40.0;
        ASSERT_LE(std::abs(noise(z)), limits.bound + 1e-12);
        ASSERT_LE(std::abs(noise(next) - noise(z)), limits.slope_max_per_um * (next - z) + 1e-12);
      }
    }
  }
  EXPECT_LT(tightest, 0.6);  // or they would earn nothing
}

TEST(TopView, RowsDoNotDependOnTheStripTheyAreIn) {
  const Colony colony = found(paper(), scattered_cells(12, 40.0, 6));
  const Frame frame = square_frame(64.0, 160);
  const TopView whole = top_view(colony, frame);
  for (std::int64_t first = 0; first < 160; first += 37) {
    const TopView strip = top_view(colony, frame, {first, std::min<std::int64_t>(first + 37, 160)});
    const auto begin = static_cast<std::ptrdiff_t>(whole.index(first, 0));
    EXPECT_TRUE(std::equal(strip.owner.begin(), strip.owner.end(), whole.owner.begin() + begin));
    EXPECT_TRUE(std::equal(strip.height_um.begin(), strip.height_um.end(), whole.height_um.begin() + begin));
    EXPECT_TRUE(std::equal(strip.nucleus.begin(), strip.nucleus.end(), whole.nucleus.begin() + begin));
  }
}

TEST(TopView, NucleusIsADiscAndDoesNotShowUnderAnotherCell) {
  // The second cell is much higher and covers the nucleus of the first.
  std::vector<Cell> cells = {testing::cell_at(0.0, 0.0, Vec3(8.0, 8.0, 3.0)), ball_at(6.0, 0.0, 7.0)};
  cells[0].nucleus_um = Vec3(3.5, 0.0, 1.0);
  cells[1].nucleus_um = Vec3(8.0, 1.0, 3.0);
  const TopView view = top_view(found(paper_without_noise(), cells), square_frame(30.0, 600));
  double shown[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < view.owner.size(); ++i) {
    if (view.owner[i] != 0) shown[view.owner[i] - 1] += view.nucleus[i] / 255.0;
    if (view.owner[i] == 0) {
      ASSERT_EQ(view.nucleus[i], 0);
    }
  }
  const double disc_px = maths::kPi * 2.5 * 2.5 / (view.frame.um_per_px * view.frame.um_per_px);
  EXPECT_NEAR(shown[1], disc_px, 0.005 * disc_px);
  EXPECT_LT(shown[0], 0.2 * disc_px);
}

}  // namespace
}  // namespace colony
