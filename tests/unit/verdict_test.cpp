// What is said about box counts: one case of each kind, with the sentence that a reader must not miss.
#include "engine/analysis/verdict.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/controls.hpp"
#include "engine/analysis/report.hpp"
#include "engine/base/maths.hpp"
#include "tests/support/fractals.hpp"

namespace colony {
namespace {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

MeasuredLine counted(const BinaryImage& image, const BoxOptions& options = {}) {
  auto dimensions = box_dimensions(image, options);
  EXPECT_TRUE(dimensions) << (dimensions ? "" : dimensions.error().message);
  return dimensions ? MeasuredLine{std::move(*dimensions), {}} : MeasuredLine{{}, "none"};
}

std::string text_of(const LineFinding& finding) {
  std::string text;
  for (const std::string& sentence : finding.sentences) text += sentence + "\n";
  return text;
}

LineFinding judged(const MeasuredLine& line, const std::vector<NamedLine>& controls = {}) { return judge_line("cell walls", line, controls); }

/// The walls of `count` equal discs of 25 px radius in hexagonal packing.
MeasuredLine hexagonal_walls(int count, const BoxOptions& options = {}) {
  std::vector<LabelArea> areas;
  for (int i = 1; i <= count; ++i) areas.push_back({static_cast<std::uint32_t>(i), 1963});
  return analyse_lines(*hexagonal_control(areas), 0, options).walls;
}

TEST(Verdict, TrueFractalsAreConsistentWithScalingOverTheirWholeRange) {
  const MeasuredLine smooth = hexagonal_walls(81);
  for (const BinaryImage& image : {koch_curve(1000), vicsek(6), gasket(10), carpet(6)}) {
    const LineFinding found = judged(counted(image), {{"hexagonal", &smooth}});
    EXPECT_EQ(found.finding, Finding::kScaling) << text_of(found);
    EXPECT_DOUBLE_EQ(found.slopes.plateau_decades, found.slopes.decades) << text_of(found);
    EXPECT_THAT(found.sentences.front(), HasSubstr("consistent with scaling"));
    EXPECT_THAT(found.unlike_controls, ElementsAre("hexagonal"));
    EXPECT_THAT(text_of(found), HasSubstr("What follows for the cell walls: a power law fits over this range. What does not: that it goes on beyond"));
  }
}

TEST(Verdict, ALatticeIsACrossoverAndSaysWhereItsSlopesGo) {
  const MeasuredLine walls = hexagonal_walls(180);
  const LineFinding found = judged(walls);
  EXPECT_EQ(found.finding, Finding::kCrossover);
  EXPECT_LT(found.slopes.first, 1.25);
  EXPECT_GT(found.slopes.last, 1.7);
  EXPECT_LT(found.slopes.plateau_decades, 0.7 * found.slopes.decades);
  EXPECT_THAT(found.sentences.front(), HasSubstr("a crossover, not scaling. From small to large boxes the local slopes rise from 1."));
  EXPECT_THAT(found.sentences.front(), HasSubstr("without a plateau"));
  EXPECT_THAT(found.sentences.front(), HasSubstr("hangs on the range and is no dimension"));
  EXPECT_THAT(text_of(found), HasSubstr("No control could be counted"));
  EXPECT_THAT(text_of(found), HasSubstr("What does not: that anything about the cell walls is fractal"));
}

TEST(Verdict, AControlWithTheSameValueTakesTheMeaningFromIt) {
  // Koch's own curve as its control: it scales, and the value still shows nothing that the control does not have.
  const MeasuredLine koch = counted(koch_curve(1000)), again = counted(koch_curve(900)), lattice = hexagonal_walls(180);
  const LineFinding found = judged(koch, {{"without_noise", &again}, {"hexagonal", &lattice}});
  EXPECT_EQ(found.finding, Finding::kScaling);
  EXPECT_THAT(found.like_controls, ElementsAre("without_noise"));
  EXPECT_THAT(found.unlike_controls, ElementsAre("hexagonal"));
  EXPECT_THAT(text_of(found), HasSubstr("The control without_noise (" + with_error(again.dimensions->capacity) + " for " + boxes_of(*again.dimensions) + ") gives the same within errors and bias, "
                                        "so the value says nothing about a fractal nature"));
  EXPECT_THAT(text_of(found), HasSubstr("The control hexagonal (" + with_error(lattice.dimensions->capacity) + " for " + boxes_of(*lattice.dimensions) + ") differs"));
  EXPECT_THAT(text_of(found), HasSubstr("a control that is not has the same value"));
  const LineFinding crossover = judged(lattice, {{"hexagonal", &lattice}, {"random_discs", &lattice}});
  EXPECT_THAT(text_of(crossover), HasSubstr("The controls hexagonal (1."));
  EXPECT_THAT(text_of(crossover), HasSubstr(" give the same"));
}

TEST(Verdict, LessThanADecadeIsTooSmallARange) {
  BoxOptions few;
  few.sides_px = {4, 5, 7, 9, 12, 16};
  const LineFinding found = judged(counted(koch_curve(1000), few));
  EXPECT_EQ(found.finding, Finding::kShortRange);
  EXPECT_THAT(found.sentences.front(), HasSubstr("too small a range"));
  EXPECT_THAT(found.sentences.front(), HasSubstr("0.60 decades"));
  EXPECT_THAT(text_of(found), HasSubstr("nothing about scaling"));
  // Also where the slopes drift: then it says that as well.
  few.sides_px = {6, 9, 13, 18, 25, 35, 50};
  const MeasuredLine lattice = counted(hexagonal_circles(9, 25.0), few);
  ASSERT_TRUE(lattice.dimensions->crossover.found);
  EXPECT_EQ(judged(lattice).finding, Finding::kShortRange);
  EXPECT_THAT(judged(lattice).sentences.front(), HasSubstr("and even there the local slopes rise from"));
}

TEST(Verdict, FewerThanTenThingsHaveNoFindingWhateverTheirSlopes) {
  MeasuredLine koch = counted(koch_curve(1000));
  ASSERT_EQ(finding_of(koch), Finding::kScaling) << "a set from elsewhere has no number";
  koch.object_count = kObjectsMin;
  EXPECT_EQ(finding_of(koch), Finding::kScaling);
  koch.object_count = kObjectsMin - 1;
  EXPECT_EQ(finding_of(koch), Finding::kTooFew);
  const LineFinding found = judged(koch, {{"hexagonal", &koch}});
  EXPECT_EQ(name_of(found.finding), "too_few");
  ASSERT_EQ(found.sentences.size(), 1u);
  EXPECT_THAT(found.sentences.front(), HasSubstr("9 objects were counted"));
  EXPECT_THAT(found.sentences.front(), HasSubstr(boxes_of(*koch.dimensions)));
  EXPECT_THAT(found.like_controls, IsEmpty());
  EXPECT_EQ(up_to(koch, 100).object_count, koch.object_count);
}

TEST(Verdict, SlopesThatGoUpAndDownAreNoScaling) {
  // N of dimension 1 below 20 px, 1.6 up to 80, 1 again beyond: no drift over the whole, no plateau of a decade.
  std::vector<BoxCount> counts;
  double log_count = 12.0, last = 3.0;
  for (const std::int64_t side : {3, 4, 5, 7, 9, 11, 14, 19, 24, 32, 41, 54, 70, 91, 118, 153, 199, 259, 337}) {
    const double slope = side <= 20 || side > 80 ? 1.0 : 1.6;
    log_count -= slope * maths::log(static_cast<double>(side) / last);
    last = static_cast<double>(side);
    BoxCount count;
    count.side_px = side;
    count.offset_count = 1;
    count.count_mean = maths::exp(log_count);
    count.count_min = count.count_max = static_cast<std::uint64_t>(count.count_mean) + 1;
    count.information_mean = log_count;
    counts.push_back(count);
  }
  const LineFinding found = judged({fit_dimensions(counts), {}});
  EXPECT_EQ(found.finding, Finding::kWandering) << text_of(found);
  EXPECT_GT(found.slopes.high - found.slopes.low, 0.4);
  EXPECT_THAT(found.sentences.front(), HasSubstr("no clear scaling"));
}

TEST(Verdict, SmoothLinesAndFilledAreasNeedNoFractal) {
  BinaryImage circle(1300, 1300), square(1000, 1000);
  draw_circle(circle, 650.2, 650.9, 600.0);
  for (std::int64_t row = 50; row < 950; ++row) std::fill_n(square.row(row) + 50, 900, std::uint8_t{1});
  EXPECT_THAT(text_of(judged(counted(circle))), HasSubstr("1 is the dimension of a smooth line"));
  EXPECT_THAT(text_of(judged(counted(circle))), HasSubstr("this value needs no fractal"));
  EXPECT_THAT(text_of(judged(counted(square))), HasSubstr("2 is the dimension of a filled area"));
}

TEST(Verdict, WithoutFiguresItSaysWhyAndNothingElse) {
  const LineFinding found = judged({{}, "image: has no foreground"});
  EXPECT_EQ(found.finding, Finding::kNoFigures);
  EXPECT_THAT(found.sentences, ElementsAre("The cell walls: no dimension here: image: has no foreground."));
  EXPECT_THAT(found.like_controls, IsEmpty());
}

// The circles that pass for a fractal: 1.47 +- 0.05 is their slope for boxes up to two diameters, whichever way that range comes about: 81
// discs counted to a quarter of their extent, or the 180 of a colony to the usual eighth. To an eighth of 81 it is 1.34: a slope is
// a property of the range.
TEST(Verdict, TheHexagonalControlIs147UpToTwoDiametersAndACrossoverEverywhere) {
  BoxOptions wide, from_four, wide_from_four;
  wide.extent_share = wide_from_four.extent_share = 0.25;
  from_four.side_min_px = wide_from_four.side_min_px = 4.0;
  const struct {
    const char* what;
    MeasuredLine line;
    double value, tolerance;
  } cases[] = {{"180 discs, 4 px to 1/8", hexagonal_walls(180, from_four), 1.47, 0.01},
               {"180 discs, 3 px to 1/8", hexagonal_walls(180), 1.47, 0.05},
               {"81 discs, 4 px to 1/4", hexagonal_walls(81, wide_from_four), 1.47, 0.01},
               {"81 discs, 3 px to 1/4", hexagonal_walls(81, wide), 1.47, 0.05},
               {"81 discs, 3 px to 1/8", hexagonal_walls(81), 1.34, 0.01}};
  for (const auto& c : cases) {
    ASSERT_TRUE(c.line.dimensions) << c.what;
    const BoxDimensions& found = *c.line.dimensions;
    std::printf("figure: %s: D0 %s, smallest cover %s, r2 %.3f, drift %.2f\n", c.what, with_error(found.capacity).c_str(),
                with_error(found.smallest_cover).c_str(), found.capacity.r2, found.crossover.drift);
    EXPECT_NEAR(found.capacity.value, c.value, c.tolerance) << c.what;
    // The error and the R2 that look like proof.
    EXPECT_NEAR(found.capacity.standard_error, 0.035, 0.005) << c.what;
    EXPECT_GT(found.capacity.r2, 0.99) << c.what;
    EXPECT_EQ(judged(c.line).finding, Finding::kCrossover) << c.what;
  }
}

TEST(Verdict, DecimalsAreRoundedWithoutALocale) {
  EXPECT_EQ(decimals(1.005001), "1.01");
  EXPECT_EQ(decimals(-0.001), "0.00");
  EXPECT_EQ(decimals(-2.5, 1), "-2.5");
  EXPECT_EQ(decimals(0.0375, 3), "0.038");
  EXPECT_EQ(decimals(12.0, 3), "12.000");
}

}  // namespace
}  // namespace colony
