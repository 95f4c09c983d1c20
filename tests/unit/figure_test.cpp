// The figure of a comparison: ticks at round values, power laws as straight lines where they belong, a legend in the colours of the curves, and no
// text that runs into another.
#include "server/api/plot.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/compare.hpp"
#include "tests/unit/picture_support.hpp"

namespace colony::server::testing {
namespace {

using api::Curve;
using api::Panel;
using ::testing::DoubleNear;
using ::testing::Pointwise;

constexpr Panel kPanel{100.0, 50.0, 700.0, 500.0};

/// N = at_one side^-dimension, as no image has it exactly.
MeasuredLine power_law(double at_one, double dimension) {
  std::vector<BoxCount> counts;
  for (const std::int64_t side : {3, 4, 6, 10, 16, 25, 40, 63, 100, 160}) {
    const double count = at_one * std::pow(static_cast<double>(side), -dimension);
    counts.push_back({side, 64, count, static_cast<std::uint64_t>(count), static_cast<std::uint64_t>(count) + 1, std::log(count), std::log(count)});
  }
  return {fit_dimensions(std::move(counts)), {}};
}

/// How far the colour nearest to `ink` is, in a square of 3 pixels about the place: 0 if it is there.
double distance_from(const StepImage& image, CanvasPoint at, Ink ink) {
  double best = 1e9;
  for (std::int64_t row = std::llround(at.y) - 1; row <= std::llround(at.y) + 1; ++row) {
    for (std::int64_t column = std::llround(at.x) - 1; column <= std::llround(at.x) + 1; ++column) {
      const std::uint8_t* pixel = image.values.data() + 3 * (row * image.width_px + column);
      best = std::min(best, std::abs(pixel[0] - double{1} * ink.red) + std::abs(pixel[1] - double{1} * ink.green) + std::abs(pixel[2] - double{1} * ink.blue));
    }
  }
  return best;
}

const TextBox* find_text(const Canvas& canvas, const std::string& text) {
  const auto at = std::find_if(canvas.texts().begin(), canvas.texts().end(), [&](const TextBox& box) { return box.text == text; });
  return at == canvas.texts().end() ? nullptr : &*at;
}

TEST(Plot, TicksStandAtRoundValues) {
  const auto near = [](std::vector<double> values) { return Pointwise(DoubleNear(1e-9), std::move(values)); };
  EXPECT_THAT(api::ticks(2.7, 210.0), near({5, 10, 20, 50, 100, 200}));
  EXPECT_THAT(api::ticks(1.0, 10.0), near({1, 2, 5, 10})) << "both ends belong";
  EXPECT_THAT(api::ticks(7.0, 90'000.0), near({10, 100, 1000, 10'000})) << "only decades where there are many";
  EXPECT_THAT(api::ticks(0.4, 1.2), near({0.5, 1}));
  EXPECT_THAT(api::slope_ticks(0.95, 1.35), near({1.0, 1.1, 1.2, 1.3}));
  EXPECT_THAT(api::slope_ticks(0.9, 1.95), near({1.0, 1.2, 1.4, 1.6, 1.8}));
  EXPECT_THAT(api::slope_ticks(-0.1, 2.3), near({0.0, 0.5, 1.0, 1.5, 2.0}));
  EXPECT_DOUBLE_EQ(api::round_length(123.0), 100.0);
  EXPECT_DOUBLE_EQ(api::round_length(99.0), 50.0);
  EXPECT_DOUBLE_EQ(api::round_length(0.0049), 0.002);
}

TEST(Plot, AxesAreLogarithmicBothWays) {
  const api::Axes axes{1.0, 1000.0, 10.0, 100'000.0};
  EXPECT_DOUBLE_EQ(axes.x(kPanel, 1.0), kPanel.x);
  EXPECT_DOUBLE_EQ(axes.x(kPanel, 1000.0), kPanel.x + kPanel.width);
  EXPECT_DOUBLE_EQ(axes.y(kPanel, 10.0), kPanel.y + kPanel.height) << "y goes up";
  EXPECT_DOUBLE_EQ(axes.y(kPanel, 100'000.0), kPanel.y);
  for (const double decade : {1.0, 10.0, 100.0}) {
    EXPECT_NEAR(axes.x(kPanel, 10.0 * decade) - axes.x(kPanel, decade), kPanel.width / 3.0, 1e-9);
    EXPECT_NEAR(axes.y(kPanel, 10.0 * decade) - axes.y(kPanel, 100.0 * decade), kPanel.height / 4.0, 1e-9);
  }
}

TEST(Plot, ADashedCurveShowsTheOneItLiesOn) {
  const MeasuredLine walls = power_law(60'000.0, 1.5);
  const Ink green{0x2c, 0xa0, 0x2c};
  const std::vector<Curve> curves{{"cell walls", &walls, &walls, api::kBlackInk}, {"control, without noise", &walls, &walls, green, true, true}};
  api::Axes axes;
  axes.take(curves[0]);
  api::SlopeRange range;
  range.take(curves[0]);
  Canvas counts(900, 600), slopes(900, 600);
  api::draw_counts(counts, kPanel, axes, curves);
  api::draw_slopes(slopes, kPanel, axes, range, curves);
  for (const Canvas* canvas : {&counts, &slopes}) {
    const StepImage image = canvas->picture();
    std::int64_t black_px = 0, green_px = 0;
    for (std::size_t i = 0; i < image.values.size(); i += 3) {
      black_px += image.values[i] == 0 && image.values[i + 1] == 0 && image.values[i + 2] == 0 ? 1 : 0;
      green_px += image.values[i] == green.red && image.values[i + 1] == green.green && image.values[i + 2] == green.blue ? 1 : 0;
    }
    EXPECT_GT(black_px, 150);
    EXPECT_GT(green_px, 150);
  }
}

TEST(Plot, CurvesLieWhereTheirPowerLawSaysInTheColoursOfTheLegend) {
  const MeasuredLine walls = power_law(60'000.0, 1.5), outline = power_law(4000.0, 1.0), hexagonal = power_law(300'000.0, 1.8), random = power_law(900.0, 1.2);
  const std::vector<Curve> curves{{"cell walls", &walls, &walls, {0, 0, 0}, false},
                                  {"colony outline", &outline, &outline, {0x1f, 0x77, 0xb4}, false},
                                  {"control, hexagonal discs", &hexagonal, &hexagonal, {0xd6, 0x27, 0x28}, true},
                                  {"control, random discs", &random, &random, {0x2c, 0xa0, 0x2c}, true}};
  const double dimensions[] = {1.5, 1.0, 1.8, 1.2}, at_one[] = {60'000.0, 4000.0, 300'000.0, 900.0};
  api::Axes axes;
  api::SlopeRange slopes;
  for (const Curve& curve : curves) {
    axes.take(curve);
    slopes.take(curve);
  }
  EXPECT_DOUBLE_EQ(axes.x_low, 3.0);
  EXPECT_DOUBLE_EQ(axes.x_high, 160.0);
  EXPECT_NEAR(slopes.high, 1.85, 1e-6);
  axes = {axes.x_low / 1.12, axes.x_high * 1.12, axes.y_low / 1.4, axes.y_high * 1.4};
  Canvas counts(900, 620), course(900, 620), legend(900, 620);
  api::draw_counts(counts, kPanel, axes, curves);
  api::draw_slopes(course, kPanel, axes, slopes, curves);
  api::draw_legend(legend, {100.0, 50.0, 700.0, 0.0}, curves);
  const StepImage of_counts = counts.picture(), of_course = course.picture(), of_legend = legend.picture();
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const Ink ink = curves[i].ink;
    for (const double side : {3.5, 12.0, 80.0, 130.0}) {  // between the marks
      const CanvasPoint at{axes.x(kPanel, side), axes.y(kPanel, at_one[i] * std::pow(side, -dimensions[i]))};
      EXPECT_LT(distance_from(of_counts, at, ink), 90.0) << curves[i].name << " " << side;
    }
    EXPECT_LT(distance_from(of_course, {axes.x(kPanel, 20.0), slopes.y(kPanel, dimensions[i])}, ink), 90.0) << curves[i].name;
    const double row = 50.0 + 16.0 + static_cast<double>(i) * api::kLegendRow_px;
    EXPECT_LT(distance_from(of_legend, {105.0, row - 5.0}, ink), 90.0) << curves[i].name;
    const TextBox* name = find_text(legend, curves[i].name);
    ASSERT_NE(name, nullptr);
    EXPECT_TRUE(name->top < row - 5.0 && row - 5.0 < name->bottom) << "beside its line";
    const std::string value = api::format("D0 %.3f +- 0.000, r2 1.000", dimensions[i]);
    ASSERT_NE(find_text(legend, value), nullptr) << value;
    EXPECT_DOUBLE_EQ(find_text(legend, value)->bottom, name->bottom);
  }
  for (const double side : {5.0, 10.0, 20.0, 50.0, 100.0}) {
    const TextBox* label = find_text(counts, api::format("%.0f", side));
    ASSERT_NE(label, nullptr) << side;
    EXPECT_NEAR((label->left + label->right) / 2.0, axes.x(kPanel, side), 1.0);
    EXPECT_GT(label->top, kPanel.y + kPanel.height);
  }
  const TextBox* slope = find_text(course, "1.4");
  ASSERT_NE(slope, nullptr);
  EXPECT_NEAR(slope->bottom, slopes.y(kPanel, 1.4) + 6.0, 8.0);
  EXPECT_LT(slope->right, kPanel.x);
}

/// Every text of a figure lies in it and touches no other.
void expect_clear(const Canvas& canvas) {
  const StepImage image = canvas.picture();
  const std::vector<TextBox>& texts = canvas.texts();
  ASSERT_GT(texts.size(), 20u);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    EXPECT_TRUE(texts[i].left >= 0.0 && texts[i].top >= 0.0 && texts[i].right <= static_cast<double>(image.width_px) &&
                texts[i].bottom <= static_cast<double>(image.height_px))
        << texts[i].text << " leaves the figure: " << texts[i].left << " to " << texts[i].right;
    for (std::size_t j = i + 1; j < texts.size(); ++j) {
      const bool apart = texts[i].right <= texts[j].left || texts[j].right <= texts[i].left || texts[i].bottom <= texts[j].top || texts[j].bottom <= texts[i].top;
      EXPECT_TRUE(apart) << "'" << texts[i].text << "' and '" << texts[j].text << "'";
    }
  }
}

TEST(Figure, NoTextRunsIntoAnother) {
  FakeJobs jobs;
  api::ImageOptions options;
  options.pipeline = Pipeline::kNuclei;
  auto made = api::compare(*jobs.colony_at(kJobId, std::nullopt), discs_png(6, 9), options, {}, {1, nullptr}, api::Sweep::kLeaveOut);
  ASSERT_TRUE(made) << made.error().message;
  expect_clear(api::comparison_canvas(*made));
  // The longest names, the largest numbers, and a picture with a scale of its own.
  made->at.time_h = 9999.0;
  made->simulated.cell_count = made->real.object_count = 200'000;
  made->real.analysis.um_per_px = 0.123456;
  for (const ObjectKind kind : {ObjectKind::kCells, ObjectKind::kNuclei, ObjectKind::kRegions, ObjectKind::kObjects}) {
    made->match.simulated = kind == ObjectKind::kCells ? kind : ObjectKind::kNuclei;
    made->real.objects = kind;
    SCOPED_TRACE(name_of(kind));
    expect_clear(api::comparison_canvas(*made));
  }
  // As many boxes as the largest picture can have: numbers of seven digits on the axis.
  for (LineReport* lines : {&made->simulated.lines, &made->real.lines}) {
    const double factor = 4e6 / lines->walls.dimensions->counts.front().count_mean;
    for (BoxCount& count : lines->walls.dimensions->counts) count.count_mean *= factor;
  }
  expect_clear(api::comparison_canvas(*made));
  // And a line that has no fit over the common boxes.
  made->real_side.lines.walls.dimensions.reset();
  expect_clear(api::comparison_canvas(*made));
}

}  // namespace
}  // namespace colony::server::testing
