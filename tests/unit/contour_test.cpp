#include "engine/analysis/contour.hpp"

#include <cmath>
#include <numeric>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/controls.hpp"
#include "engine/analysis/report.hpp"
#include "engine/analysis/threshold_sweep.hpp"
#include "engine/base/maths.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/fractals.hpp"
#include "tests/support/label_images.hpp"

namespace colony {
namespace {

using namespace testing;
using ::testing::ElementsAre;

const LabelImage kRing = drawn({"........",
                                ".aaaab..",
                                ".aaaabb.",
                                ".aa.abb.",
                                ".aaabbb.",
                                "........"});

TEST(Contour, OutlineLeavesHolesAndWallsOut) {
  EXPECT_THAT(text_of(*colony_outline(kRing)), ElementsAre("........",
                                                           ".#####..",
                                                           ".#....#.",
                                                           ".#....#.",
                                                           ".######.",
                                                           "........"));
}

TEST(Contour, WallsAreDrawnOnceOnTheHigherLabel) {
  EXPECT_THAT(text_of(*cell_walls(kRing)), ElementsAre("........",
                                                       ".#####..",
                                                       ".#.#.##.",
                                                       ".##.###.",
                                                       ".######.",
                                                       "........"));
}

TEST(Contour, TheFrameIsNoBorder) {
  const LabelImage cut = drawn({"aaa.", "aaa.", "bbb."});
  EXPECT_THAT(text_of(*colony_outline(cut)), ElementsAre("..#.", "..#.", "..#."));
  EXPECT_THAT(text_of(*cell_walls(cut)), ElementsAre("..#.", "..#.", "###."));
  EXPECT_THAT(text_of(*colony_outline(drawn({"aa", "aa"}))), ElementsAre("..", ".."));
}

TEST(Contour, AClosedGapLetsNoBackgroundIn) {
  const LabelImage parted = drawn({"........", ".aa.bb..", ".aa.bb..", ".aa.bb..", "........"});
  EXPECT_EQ(outside_of(parted)->at(2, 3), 255);
  EXPECT_EQ(outside_of(parted, 1)->at(2, 3), 0);
  EXPECT_EQ(outside_of(parted, 1)->at(2, 6), 255);
  EXPECT_FALSE(outside_of(parted, 9));
}

/// No 4-connected way leads from one label to another but over a drawn pixel: what makes the line a line.
TEST(Contour, WallsSeparateLabels) {
  const LabelImage labels = *random_disc_control(std::vector<LabelArea>(60, {0, 300}), 1);
  LabelImage numbered = labels;
  const BinaryImage walls = *cell_walls(numbered);
  for (std::int64_t row = 0; row < labels.height_px; ++row) {
    for (std::int64_t column = 0; column + 1 < labels.width_px; ++column) {
      if (labels.at(row, column) == labels.at(row, column + 1)) continue;
      EXPECT_TRUE(walls.at(row, column) != 0 || walls.at(row, column + 1) != 0);
    }
  }
}

std::vector<LabelArea> areas_of(std::size_t count, std::uint64_t first, std::uint64_t step) {
  std::vector<LabelArea> areas;
  for (std::size_t i = 0; i < count; ++i) areas.push_back({static_cast<std::uint32_t>(i + 1), first + step * i});
  return areas;
}

TEST(Report, ControlsStandBesideTheAnswerAndTheCrossoverIsSaid) {
  // A colony that is the hexagonal control itself, so what must come out is known.
  const LabelImage labels = *hexagonal_control(areas_of(169, 1600, 0), 0.25);
  LabelInput input;
  input.labels = &labels;
  input.without_noise = &labels;
  const LabelReport report = *analyse_labels(input);
  ASSERT_EQ(report.controls.size(), 3u);
  EXPECT_EQ(report.controls[0].name, "without_noise");
  EXPECT_EQ(report.controls[1].name, "hexagonal");
  EXPECT_EQ(report.controls[2].name, "random_discs");
  ASSERT_TRUE(report.lines.walls.dimensions && report.controls[1].lines.walls.dimensions);
  EXPECT_EQ(report.lines.walls.dimensions->counts, report.controls[0].lines.walls.dimensions->counts);
  EXPECT_NEAR(report.lines.walls.dimensions->capacity.value, report.controls[1].lines.walls.dimensions->capacity.value, 0.02);
  EXPECT_TRUE(report.lines.walls.dimensions->crossover.found);
  EXPECT_EQ(report.cell_count, 169u);
  EXPECT_NEAR(report.px_per_cell_diameter, 2.0 * std::sqrt(1600.0 / maths::kPi), 0.2);
  ASSERT_FALSE(report.verdict.empty());
  EXPECT_NE(report.verdict[0].find("crossover, not scaling"), std::string::npos) << report.verdict[0];
  EXPECT_NE(report.verdict[1].find("give the same within errors and bias"), std::string::npos) << report.verdict[1];
}

TEST(Report, HiddenCellsAreCountedAndNotMeasured) {
  // A sheet of 169 whole cells over 30 more, of which one shows by a sliver of 25 pixels and one by a single pixel.
  LabelImage labels = *hexagonal_control(areas_of(169, 1600, 0), 0.25);
  const LabelImage sheet = labels;
  std::vector<LabelArea> whole;
  for (std::uint32_t label = 1; label <= 199; ++label) whole.push_back({label, 1600});
  std::size_t shown = 0;
  for (std::size_t at = 0; at < labels.values.size() && shown < 26; ++at) {
    if (labels.values[at] != 0) labels.values[at] = shown++ < 25 ? 180 : 190;
  }
  LabelInput input;
  input.labels = &labels;
  input.whole = whole;
  const LabelReport report = *analyse_labels(input);
  EXPECT_EQ(report.cell_count, 199u);
  EXPECT_EQ(report.visible_count, 171u);
  EXPECT_EQ(report.partly_hidden_count, 2u);
  EXPECT_EQ(report.measured_count, 169u);
  std::uint64_t in_rings = 0;
  for (const Ring& ring : report.rings) {
    in_rings += ring.cell_count;
    if (ring.cell_count > 0) {
      EXPECT_NEAR(ring.area_mean_px, 1600.0, 60.0);
    }
  }
  EXPECT_EQ(in_rings, 171u);
  EXPECT_LT(report.apart.other_area_cv, 0.03) << "slivers are in no mean";
  const std::string words = std::accumulate(report.verdict.begin(), report.verdict.end(), std::string());
  EXPECT_NE(words.find("Of the colony's 199 cells, 28 are hidden under others: the figures of the picture are about the 171 that"), std::string::npos) << words;
  EXPECT_NE(words.find("Of 2 cells less than half is seen"), std::string::npos) << words;
  EXPECT_NE(words.find("not held against Gibson's table: the table is of a sheet"), std::string::npos) << words;
  EXPECT_EQ(words.find("against Gibson's table p"), std::string::npos) << words;
  // The sheet alone is judged by it.
  whole.resize(169);
  input.labels = &sheet;
  input.whole = whole;
  const LabelReport plain = *analyse_labels(input);
  EXPECT_EQ(plain.sides_reason, "");
  EXPECT_EQ(plain.cell_count, plain.visible_count);
  EXPECT_TRUE(hidden_sentences(plain).empty());
}

TEST(Report, OfOneCellNothingFollows) {
  LabelImage one(600, 600);
  draw_discs({{1, 300.0, 300.0, 250.0}}, one);
  LabelInput input;
  input.labels = &one;
  input.without_noise = &one;
  const LabelReport report = *analyse_labels(input);
  ASSERT_TRUE(report.lines.walls.dimensions);
  for (const LineFinding* finding : {&report.findings.walls, &report.findings.outline}) {
    EXPECT_EQ(finding->finding, Finding::kTooFew);
    EXPECT_TRUE(finding->like_controls.empty());
  }
  const std::string words = std::accumulate(report.verdict.begin(), report.verdict.end(), std::string());
  EXPECT_NE(words.find("too few for a finding: 1 object was counted, and fewer than 10 say"), std::string::npos) << words;
  EXPECT_NE(words.find("Controls of fewer than 10 cells show nothing"), std::string::npos) << words;
  for (const char* wrong : {"consistent with scaling", "tile it", "gives the same", "give the same"}) EXPECT_EQ(words.find(wrong), std::string::npos) << words;
  // A region holds many cells: its outline is that of a colony, and one is enough.
  input.objects = ObjectKind::kRegions;
  EXPECT_NE(analyse_labels(input)->findings.outline.finding, Finding::kTooFew);
}

TEST(Report, WhatCannotBeMeasuredSaysWhy) {
  const LabelImage tiny = drawn({".....", ".aab.", ".aab.", "....."});
  LabelInput input;
  input.labels = &tiny;
  const LabelReport report = *analyse_labels(input);
  EXPECT_FALSE(report.lines.walls.dimensions);
  EXPECT_NE(report.lines.walls.reason.find("box sides"), std::string::npos);
  EXPECT_EQ(report.cell_count, 2u);
  const LabelImage empty(100, 100);
  input.labels = &empty;
  EXPECT_EQ(analyse_labels(input).error().fields.front().pointer, "image");
  input.labels = &tiny;
  input.boxes.offsets_per_axis = 0;
  EXPECT_EQ(analyse_labels(input).error().fields.front().pointer, "offsets_per_axis");
}

TEST(Sweep, EveryThresholdIsCountedWithTheSameBoxes) {
  // A cone: the set above t is a disc, its boundary a circle, whatever the threshold.
  GreyImage cone(600, 600);
  for (std::int64_t row = 0; row < 600; ++row) {
    for (std::int64_t column = 0; column < 600; ++column) {
      const double dx = static_cast<double>(column) - 300.0, dy = static_cast<double>(row) - 300.0;
      cone.at(row, column) = static_cast<std::uint8_t>(std::max(0.0, 255.0 - 0.85 * std::sqrt(dx * dx + dy * dy)));
    }
  }
  ThresholdLines lines({}), as_regions({});
  for (const int threshold : {120, 40, 80, 160}) {  // the answer's own first, as `segment` calls
    BinaryImage disc(600, 600);
    LabelImage one(600, 600);
    for (std::size_t i = 0; i < disc.values.size(); ++i) {
      disc.values[i] = cone.values[i] >= threshold ? 255 : 0;
      one.values[i] = disc.values[i] != 0 ? 1 : 0;
    }
    lines.add({threshold, Pipeline::kNuclei, disc, one});
    as_regions.add({threshold, Pipeline::kPhase, disc, one});
  }
  const ThresholdSweep sweep = lines.finish(), regions = as_regions.finish(ObjectKind::kRegions);
  ASSERT_EQ(sweep.rows.size(), 4u);
  int last = 0;
  for (const ThresholdRow& row : sweep.rows) {
    EXPECT_LT(std::exchange(last, row.threshold), row.threshold);
    for (const MeasuredLine* line : {&row.walls, &row.outline}) {
      ASSERT_TRUE(line->dimensions) << line->reason;
      ASSERT_EQ(line->dimensions->counts.size(), sweep.sides_px.size());
      for (std::size_t i = 0; i < sweep.sides_px.size(); ++i) EXPECT_EQ(line->dimensions->counts[i].side_px, sweep.sides_px[i]);
      EXPECT_NEAR(line->dimensions->capacity.value, 1.0, 0.1);
    }
  }
  ASSERT_EQ(sweep.sentences.size(), 3u);
  EXPECT_NE(sweep.sentences[0].find("Threshold 40 to 160: the cell walls could be counted at 4 of 4 levels, with D0 for boxes of 3 to "),
            std::string::npos) << sweep.sentences[0];
  EXPECT_NE(sweep.sentences[2].find("one grid from the frame's corner"), std::string::npos);
  // One disc a level is too few for a finding at any of them; regions are not counted so.
  EXPECT_EQ(finding_of(sweep.rows[1].walls), Finding::kTooFew);
  EXPECT_EQ(regions.rows[1].walls.object_count, std::nullopt);
}

TEST(Sweep, SaysWhereTheValueIsTheThresholdsAndWhereNothingCanBeCounted) {
  // Lines whose ink is a ring at one level and a filled disc at the next: what is counted is the choice of the level.
  BinaryImage ring(600, 600), disc(600, 600);
  for (std::int64_t row = 0; row < 600; ++row) {
    for (std::int64_t column = 0; column < 600; ++column) {
      const double d = std::hypot(static_cast<double>(column) - 300.0, static_cast<double>(row) - 300.0);
      ring.at(row, column) = std::abs(d - 250.0) < 1.0 ? 255 : 0;
      disc.at(row, column) = d < 250.0 ? 255 : 0;
    }
  }
  const LabelImage none(600, 600);
  ThresholdLines lines({});
  lines.add({100, Pipeline::kContours, ring, none});
  lines.add({96, Pipeline::kContours, disc, none});
  lines.add({104, Pipeline::kContours, BinaryImage(600, 600), none});
  const ThresholdSweep sweep = lines.finish();
  EXPECT_NE(sweep.sentences[0].find("more than errors and bias: part of the value is the threshold's"), std::string::npos) << sweep.sentences[0];
  EXPECT_NE(sweep.sentences[1].find("does not hang on the threshold"), std::string::npos) << sweep.sentences[1];
  EXPECT_NE(sweep.rows[2].walls.reason.find("no foreground"), std::string::npos);
  ThresholdLines small({});
  small.add({100, Pipeline::kContours, BinaryImage(20, 20, {}, 255), LabelImage(20, 20)});
  const ThresholdSweep nothing = small.finish();
  EXPECT_TRUE(nothing.sides_px.empty());
  EXPECT_NE(nothing.rows[0].walls.reason.find("fewer than 6 box sides"), std::string::npos);
}

}  // namespace
}  // namespace colony
