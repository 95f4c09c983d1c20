#include "engine/analysis/morphology.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/analysis/controls.hpp"
#include "engine/analysis/neighbours.hpp"
#include "engine/analysis/packing.hpp"
#include "engine/analysis/radial.hpp"
#include "engine/analysis/sides.hpp"
#include "engine/base/maths.hpp"
#include "engine/space/overlap.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/label_images.hpp"

namespace colony {
namespace {

using namespace testing;

Shape shape_of(const LabelImage& image) { return cell_shapes(image)->front(); }

LabelImage ellipse(double a, double b, double angle, std::int64_t side) {
  return painted(side, side, [=](double x, double y) {
    const double dx = x - 0.5 * static_cast<double>(side) - 0.3, dy = y - 0.5 * static_cast<double>(side) + 0.2;
    const double u = (dx * std::cos(angle) + dy * std::sin(angle)) / a, v = (dy * std::cos(angle) - dx * std::sin(angle)) / b;
    return u * u + v * v <= 1.0 ? 1u : 0u;
  });
}

TEST(Morphology, DiscsAndEllipsesHaveTheirOwnMeasures) {
  for (const double radius : {20.0, 50.0, 150.0}) {
    const Shape disc = shape_of(ellipse(radius, radius, 0.0, 400));
    EXPECT_NEAR(static_cast<double>(disc.area_px), maths::kPi * radius * radius, 0.01 * radius * radius);
    EXPECT_NEAR(disc.perimeter_px, 2.0 * maths::kPi * radius, 0.01 * 2.0 * maths::kPi * radius);
    EXPECT_NEAR(disc.circularity, 1.0, 0.02);
    EXPECT_NEAR(disc.solidity, 1.0, 2.0 / radius);
    EXPECT_LT(disc.eccentricity, 0.12);
    EXPECT_NEAR(disc.centre_x_px, 200.3, 0.1);
    EXPECT_NEAR(disc.centre_y_px, 199.8, 0.1);
    EXPECT_FALSE(disc.at_frame);
  }
  for (const double angle : {0.0, 0.4, 1.1}) {
    const Shape flat = shape_of(ellipse(100.0, 50.0, angle, 400));
    EXPECT_NEAR(flat.eccentricity, std::sqrt(0.75), 0.003);
    EXPECT_NEAR(flat.perimeter_px, 484.42, 0.03 * 484.42);  // 4 a E(e)
    EXPECT_NEAR(flat.solidity, 1.0, 0.03);
  }
}

TEST(Morphology, PixelShapesAreExact) {
  const Shape square = shape_of(drawn({"......", ".aaaa.", ".aaaa.", ".aaaa.", ".aaaa.", "......"}));
  EXPECT_EQ(square.area_px, 16u);
  EXPECT_EQ(square.hull_area_px, 16.0);
  EXPECT_EQ(square.hull_perimeter_px, 16.0);
  EXPECT_EQ(square.solidity, 1.0);
  EXPECT_DOUBLE_EQ(square.eccentricity, 0.0);
  EXPECT_DOUBLE_EQ(square.perimeter_px, maths::kPi / 8.0 * (8 + 8 + 2 * 14 / std::sqrt(2.0)));
  const Shape pixel = shape_of(drawn({"a"}));
  EXPECT_EQ(pixel.solidity, 1.0);
  EXPECT_EQ(pixel.centre_x_px, 0.5);
  EXPECT_TRUE(pixel.at_frame);
  // An L of three pixels: hull of 3.5.
  EXPECT_EQ(shape_of(drawn({"....", ".a..", ".aa.", "...."})).hull_area_px, 3.5);
  // The frame's edge is a border like any other.
  EXPECT_EQ(shape_of(drawn({"aaaa", "aaaa", "aaaa", "aaaa"})).perimeter_px, square.perimeter_px);
  const auto two = *cell_shapes(drawn({"ab", "ab", "a."}));
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].label, static_cast<std::uint32_t>('a'));
  EXPECT_EQ(two[0].area_px, 3u);
  EXPECT_EQ(two[1].area_px, 2u);
}

TEST(Morphology, HolesPiecesAndOpenSpace) {
  const LabelImage image = drawn({"............",
                                  ".aaaa...bb..",
                                  ".a..a...bb..",
                                  ".a..a.......",
                                  ".aaaa.......",
                                  "............"});
  const ColonyShape colony = *colony_shape(image);
  EXPECT_EQ(colony.covered_px, 16u);
  EXPECT_EQ(colony.piece_count, 2u);
  EXPECT_EQ(colony.hole_count, 1u);
  EXPECT_EQ(colony.hole_px, 4u);
  EXPECT_EQ(colony.shape.area_px, 16u);  // the piece of a, filled
  // Corners (1,1) (10,1) (10,3) (5,5) (1,5).
  EXPECT_EQ(colony.hull_area_px, 31.0);
  EXPECT_DOUBLE_EQ(colony.open_share, 1.0 - 16.0 / 31.0);
}

TEST(Morphology, RoughnessOfADiscIsNoneAndOfAStarIsItsOwn) {
  const LabelImage disc = painted(500, 500, [](double x, double y) { return (x - 250) * (x - 250) + (y - 250) * (y - 250) < 40'000 ? 3u : 0u; });
  const ColonyShape smooth = *colony_shape(disc);
  EXPECT_LT(smooth.roughness, 0.003);
  EXPECT_NEAR(smooth.excess_perimeter, 0.0, 0.01);
  EXPECT_NEAR(smooth.radius_mean_px, 199.5, 0.5);
  // r = 180 + 18 cos(8 phi) deviates by 18 / sqrt(2) per angle; outline pixels weigh by length, which is nearly the same on both flanks.
  const LabelImage star = painted(500, 500, [](double x, double y) {
    const double dx = x - 250, dy = y - 250;
    return std::sqrt(dx * dx + dy * dy) < 180.0 + 18.0 * std::cos(8.0 * std::atan2(dy, dx)) ? 3u : 0u;
  });
  const ColonyShape rough = *colony_shape(star);
  EXPECT_NEAR(rough.radius_rms_px, 18.0 / std::sqrt(2.0), 0.6);
  double length = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const double angle = 2.0 * maths::kPi * i / 100'000, r = 180.0 + 18.0 * std::cos(8.0 * angle), dr = -144.0 * std::sin(8.0 * angle);
    length += std::sqrt(r * r + dr * dr) * 2.0 * maths::kPi / 100'000;
  }
  EXPECT_NEAR(rough.shape.perimeter_px, length, 0.02 * length);
  EXPECT_GT(rough.excess_perimeter, 0.04);
}

/// Labels by the nearest point of a hexagonal lattice: every interior cell has six sides.
LabelImage honeycomb(double spacing, int across) {
  const double height = spacing * std::sqrt(3.0) / 2.0;
  return painted(static_cast<std::int64_t>(spacing * (across + 2)), static_cast<std::int64_t>(height * (across + 2)), [=](double x, double y) {
    double best = spacing * spacing * 0.36;
    std::uint32_t label = 0;
    for (int j = 0; j < across; ++j) {
      for (int i = 0; i < across; ++i) {
        const double dx = x - spacing * (1.3 + i + 0.5 * (j % 2)), dy = y - height * (1.3 + j);
        if (dx * dx + dy * dy >= best) continue;
        best = dx * dx + dy * dy;
        label = static_cast<std::uint32_t>(across * j + i + 1);
      }
    }
    return label;
  });
}

TEST(Neighbours, AHoneycombHasSixSidesInside) {
  const Contacts contacts = *find_contacts(honeycomb(24.0, 9));
  const SideStatistics sides = side_statistics(contacts);
  EXPECT_EQ(sides.counts[2], 49u);
  EXPECT_EQ(sides.shares[2], 1.0);
  EXPECT_EQ(sides.sides_mean, 6.0);
  EXPECT_NEAR(sides.difference_max, 1.0 - kGibsonShares[2], 1e-12);
  EXPECT_EQ(sides.other_count, 0u);
  ASSERT_TRUE(sides.p_value);
  EXPECT_LT(*sides.p_value, 1e-6);
  for (const Border& border : contacts.borders) {
    // A side of the hexagon, straight to the pixel.
    EXPECT_LT(border.deviation_px, 0.5);
    EXPECT_NEAR(border.length_px, 24.0 / std::sqrt(3.0), 2.5);
  }
}

/// A honeycomb with a hole wherever three cells meet.
TEST(Sides, HolesWhereCellsMeetAreGivenToTheirCells) {
  const LabelImage whole = honeycomb(24.0, 9);
  LabelImage holed = whole;
  const auto near = [&](std::int64_t row, std::int64_t column) {
    constexpr std::int64_t kReach = 6, kSquaredReach = 46;
    std::vector<std::uint32_t> labels;
    for (std::int64_t y = -kReach; y <= kReach; ++y) {
      for (std::int64_t x = -kReach; x <= kReach; ++x) {
        if (x * x + y * y <= kSquaredReach) labels.push_back(whole.at_or(row + y, column + x, 0));
      }
    }
    std::sort(labels.begin(), labels.end());
    labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
    return labels;
  };
  // All that has three cells within 6.8 px: sides are 13.9 px long, so the slanted ones are gone.
  for (std::int64_t row = 0; row < whole.height_px; ++row) {
    for (std::int64_t column = 0; column < whole.width_px; ++column) {
      const auto labels = near(row, column);
      if (labels.size() >= 3 && labels.front() != 0) holed.at(row, column) = 0;
    }
  }
  const SideStatistics seen = side_statistics(*find_contacts(holed));
  EXPECT_EQ(seen.other_count, 49u);  // two neighbours each
  const ClosedSides closed = *closed_sides(holed, 24.0 * 24.0 * std::sqrt(3.0) / 2.0);
  EXPECT_EQ(closed.sides.counts[2], 49u);
  EXPECT_EQ(closed.sides.sides_mean, 6.0);
  EXPECT_EQ(closed.hole_count, 128u);  // the corners of 81 cells that three share
  EXPECT_EQ(closed.hole_max_px, 249u);
  EXPECT_EQ(*closed_sides(whole, 498.8)->sides.p_value, *closed.sides.p_value);
}

TEST(Sides, AHoleIsSharedFairlyAndALargeOneStays) {
  const LabelImage image = drawn({"........",
                                  ".aaabbb.",
                                  ".a....b.",
                                  ".a....b.",
                                  ".aaabbb.",
                                  "........",
                                  "...c.c..",
                                  "........"});
  const GivenHoles given = *give_holes(image, 8);
  EXPECT_EQ(given.hole_count, 1u);
  EXPECT_EQ(given.hole_px, 8u);
  for (std::int64_t row = 2; row < 4; ++row) {
    for (std::int64_t column = 2; column < 6; ++column) {
      EXPECT_EQ(given.labels.at(row, column), static_cast<std::uint32_t>(column < 4 ? 'a' : 'b')) << row << ' ' << column;
    }
  }
  EXPECT_EQ(given.labels.at(6, 4), 0u);  // outside
  EXPECT_EQ(give_holes(image, 7)->labels.values, image.values);
  EXPECT_EQ(give_holes(image, 7)->hole_count, 0u);
  // A gap that is closed lies at the frame's edge here: there is no row before it.
  EXPECT_EQ(give_holes(drawn({"...", "a.b", "..."}), 8, 1)->labels.values, drawn({"...", "aab", "..."}).values);
  EXPECT_EQ(give_holes(drawn({"a.b", "a.b", "a.b"}), 8, 1)->labels.values, drawn({"aab", "aab", "aab"}).values);
  const std::atomic<bool> stop{true};
  EXPECT_THROW((void)give_holes(image, 8, 0, &stop), Stopped);
  EXPECT_THROW((void)find_contacts(image, 0, &stop), Stopped);
}

/// What the header says of circularities above 1: discs, ellipses and octagons at all places of the grid.
TEST(Shapes, CircularityExceedsOneByPixelsAndByOctagonsOnly) {
  double most = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const double radius = 1.2 + 14.0 * (k % 50) / 50.0, x0 = 20.0 + 0.13 * (k % 7), y0 = 20.0 + 0.17 * (k % 5);
    LabelImage image(40, 40);
    for (std::int64_t row = 0; row < 40; ++row) {
      for (std::int64_t column = 0; column < 40; ++column) {
        const double dx = std::abs(static_cast<double>(column) + 0.5 - x0), dy = std::abs(static_cast<double>(row) + 0.5 - y0);
        const bool is_octagon = k % 2 == 0 && std::max(dx, dy) <= radius && dx + dy <= (1.2 + 0.05 * (k % 9)) * radius;
        if (is_octagon || (k % 2 == 1 && dx * dx + dy * dy <= radius * radius)) image.at(row, column) = 1;
      }
    }
    const Shape shape = cell_shapes(image)->front();
    if (shape.area_px >= 5) most = std::max(most, shape.circularity);
    EXPECT_EQ(shape.is_measured, shape.area_px >= kShapePxMin);
  }
  EXPECT_GT(most, 1.055);
  EXPECT_LT(most, 1.085);
  EXPECT_NEAR(cell_shapes(drawn({"...", ".a.", "..."}))->front().circularity, 1.748, 0.001);
  EXPECT_NEAR(cell_shapes(drawn({"....", ".aa.", ".aa.", "...."}))->front().circularity, 1.199, 0.001);
}

TEST(Sides, TheVerdictSaysWhichCountToCompare) {
  SideStatistics seen;
  seen.counts = {30, 40, 20, 5, 0, 0};
  seen.sides_mean = 4.83;
  seen.p_value = 1.4e-38;
  ClosedSides closed;
  closed.hole_count = 198;
  closed.sides = seen;
  closed.sides.sides_mean = 5.91;
  closed.sides.p_value = 0.74;
  const std::vector<std::string> words = judge_sides(seen, closed);
  ASSERT_EQ(words.size(), 3u);
  EXPECT_NE(words[0].find("4.830 sides on average"), std::string::npos);
  EXPECT_NE(words[0].find("p is below 0.001: they differ"), std::string::npos);
  EXPECT_NE(words[1].find("198 holes"), std::string::npos);
  EXPECT_NE(words[1].find("p = 0.740: no difference"), std::string::npos);
  EXPECT_NE(words[2].find("not the cells"), std::string::npos);
  closed.sides.p_value = 0.001;
  EXPECT_EQ(judge_sides(seen, closed).size(), 2u);
  EXPECT_TRUE(judge_sides({}, {}).empty());  // nothing inside
}

/// Gibson's chain: a dividing cell of i sides leaves j - 4 of its i - 4 free sides to a daughter by a fair coin, and gains one, on average,
/// by its neighbours' divisions. The table is what this leaves as it is.
TEST(Neighbours, GibsonsTableIsTheStationaryDistribution) {
  std::array<double, 6> next{};
  for (std::size_t i = 0; i < 6; ++i) {
    double binomial = std::pow(0.5, static_cast<double>(i));
    for (std::size_t j = 0; j <= i; ++j) {
      if (j + 1 < 6) next[j + 1] += kGibsonShares[i] * binomial;
      binomial *= static_cast<double>(i - j) / static_cast<double>(j + 1);
    }
  }
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(next[i], kGibsonShares[i], 5e-5);
}

TEST(Neighbours, TheTableItselfFits) {
  Contacts contacts;
  std::uint32_t label = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (int k = 0; k < static_cast<int>(10'000 * kGibsonShares[i] + 0.5); ++k) {
      contacts.cells.push_back({++label, static_cast<std::uint32_t>(4 + i), true});
    }
  }
  contacts.cells.push_back({++label, 12, true});
  contacts.cells.push_back({++label, 5, false});
  const SideStatistics sides = side_statistics(contacts);
  EXPECT_LT(sides.difference_max, 1e-3);
  EXPECT_GT(*sides.p_value, 0.99);
  EXPECT_EQ(sides.degrees, 3u);
  EXPECT_EQ(sides.other_count, 1u);
}

TEST(Neighbours, GapsCornersAndCellsApart) {
  const LabelImage image = drawn({"aab.c", "aab.c", "..b.c", "d.b.c"});
  const Contacts touching = *find_contacts(image);
  ASSERT_EQ(touching.borders.size(), 1u);
  EXPECT_EQ(touching.borders[0].edge_count, 2u);
  EXPECT_EQ(touching.cells[2].neighbour_count, 0u);
  const Contacts closed = *find_contacts(image, 1);
  EXPECT_EQ(closed.borders.size(), 2u);
  EXPECT_EQ(closed.borders[1].edge_count, 4u);
  // b and d meet over one gap of one pixel: a single edge is a corner.
  EXPECT_EQ(closed.cells[3].neighbour_count, 0u);
  const ApartCells apart = apart_cells(*cell_shapes(image), touching);
  EXPECT_EQ(apart.apart_count, 2u);
  EXPECT_EQ(apart.other_count, 2u);
  EXPECT_DOUBLE_EQ(apart.share, 0.5);
}

TEST(Neighbours, StraightBordersAreToldFromBentOnes) {
  // Rows of bands: borders of siblings straight, the others a wave of amplitude 6 and period 60.
  const LabelImage image = painted(300, 420, [](double x, double y) {
    const double wave = y + 6.0 * std::sin(2.0 * maths::kPi * x / 60.0);
    const auto pair = static_cast<std::uint32_t>(std::max(0.0, wave) / 60.0);
    return 1 + 2 * pair + (y > 60.0 * pair + 30.0 ? 1u : 0u);
  });
  const Contacts contacts = *find_contacts(image);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> siblings;
  for (std::uint32_t i = 1; i < 15; i += 2) siblings.emplace_back(i + 1, i);
  const SiblingStraightness found = sibling_straightness(contacts, siblings);
  EXPECT_GT(found.siblings.count, 4u);
  EXPECT_GT(found.others.count, 4u);
  EXPECT_LT(found.siblings.mean, found.others.mean);
  EXPECT_GT(found.t, 2.0);
}

TEST(Radial, DensityFallsWhereCellsAreLarger) {
  // Cells of 10 x 10 within 60 pixels of the middle, 20 x 20 beyond.
  const LabelImage image = painted(400, 400, [](double x, double y) {
    const double dx = x - 200, dy = y - 200;
    if (dx * dx + dy * dy > 150.0 * 150.0) return 0u;
    const bool fine = std::max(std::abs(dx), std::abs(dy)) < 60.0;
    const double size = fine ? 10.0 : 20.0;
    return static_cast<std::uint32_t>((fine ? 1'000'000 : 1) + 1000 * static_cast<int>(x / size) + static_cast<int>(y / size));
  });
  const std::vector<Shape> shapes = *cell_shapes(image);
  std::vector<std::uint32_t> active;
  for (const Shape& shape : shapes) {
    if (shape.label < 1'000'000) active.push_back(shape.label);
  }
  const std::vector<Ring> rings = *radial_profile(image, shapes, active, 8);
  EXPECT_DOUBLE_EQ(rings.front().area_mean_px, 100.0);
  EXPECT_EQ(rings.front().active_share, 0.0);
  EXPECT_EQ(rings.back().active_share, 1.0);
  EXPECT_NEAR(rings[1].density_per_px, 0.01, 0.003);
  EXPECT_LT(rings[6].density_per_px, 0.004);
  std::uint64_t cells = 0;
  for (const Ring& ring : rings) cells += ring.cell_count;
  EXPECT_EQ(cells, shapes.size());
  EXPECT_FALSE(radial_profile(image, shapes, {}, 8)->front().active_share);
  EXPECT_FALSE(radial_profile(image, shapes, {}, 0));
}

TEST(Packing, EqualBallsLoseHalfTheLensEach) {
  // Balls far above the dish would fall; here only their overlap counts. x = d / R = 1.2: the lens is (4 + x)(2 - x)^2 / 16 of a ball.
  Params params = paper_without_noise();
  Cell a = ball_at(0.0, 0.0, 6.0), b = ball_at(7.2, 0.0, 6.0);
  a.centre_um.z() = b.centre_um.z() = 10.0;
  const Colony colony = found(params, {a, b});
  const double lens = (4.0 + 1.2) * 0.8 * 0.8 / 16.0;
  for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
    const PackingStatistics packing = *packing_statistics(colony, rule, 1, 65'536);
    EXPECT_NEAR(packing.retained_mean, 1.0 - lens / 2.0, 0.003);
    EXPECT_NEAR(packing.union_um3, 4.0 / 3.0 * maths::kPi * 216.0 * (2.0 - lens), 0.005 * 1800.0);
    EXPECT_EQ(packing.void_share, 0.0);  // two cells leave nothing to nobody
  }
}

TEST(Packing, SumLeavesVoidsMaxDoesNotAndThreadsDoNotMatter) {
  const Colony colony = found(paper(), scattered_cells(30, 35.0, 2));
  const PackingStatistics sum = *packing_statistics(colony, ContactRule::kSum, 3, 256, 1);
  EXPECT_GT(sum.void_share, 0.01);
  EXPECT_EQ(packing_statistics(colony, ContactRule::kMax, 3, 256)->void_share, 0.0);
  EXPECT_EQ(sum, *packing_statistics(colony, ContactRule::kSum, 3, 256, 7));
  EXPECT_FALSE(packing_statistics(colony, ContactRule::kSum, 3, 100));
  EXPECT_FALSE(packing_statistics(Colony(paper()), ContactRule::kSum, 3));
  // The least share is what the overlap module finds for that cell, to the error of its own points.
  std::vector<CellId> ids;
  const Body& body = colony.body(sum.most_pressed);
  colony.cells_meeting(body.box(), ids);
  std::vector<const Body*> others;
  for (const CellId id : ids) {
    if (id != sum.most_pressed) others.push_back(&colony.body(id));
  }
  Stream stream(9, CellId{1}, 0, Purpose::kControl);
  const PointSet points = scrambled_sobol(4096, stream);
  EXPECT_NEAR(sum.retained_min, deformed_mass(body, others, ContactRule::kSum, points).volume_um3 /
                                    deformed_mass(body, {}, ContactRule::kSum, points).volume_um3, 0.06);
}

TEST(Packing, SiblingsAreTheLastDivision) {
  Cell parent = ball_at(0, 0, 5), daughter = ball_at(9, 0, 5), older = ball_at(20, 0, 5);
  older.parent_id = CellId{1};
  older.born_h = 10.0;
  daughter.parent_id = CellId{1};
  daughter.born_h = parent.born_h = 22.0;
  older.activity = Activity::kPassive;
  const Colony colony = found(paper(), {parent, older, daughter});
  EXPECT_EQ(sibling_pairs(colony), (std::vector<std::pair<std::uint32_t, std::uint32_t>>{{1, 3}}));
  EXPECT_EQ(active_labels(colony), (std::vector<std::uint32_t>{1, 3}));
}

}  // namespace
}  // namespace colony
