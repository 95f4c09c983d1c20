// segment, image_analysis: drawn pictures whose count and area are known, and input that must be refused by name.
#include "engine/analysis/segment.hpp"

#include <atomic>
#include <cmath>
#include <numbers>
#include <opencv2/core/utility.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/image_analysis.hpp"
#include "tests/support/image_files.hpp"
#include "tests/support/image_scenes.hpp"

namespace colony {
namespace {

using namespace testing;
using ::testing::HasSubstr;

Segmentation found_in(const GreyImage& image, const SegmentOptions& options = {}) {
  Result<Segmentation> result = segment(image, options);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? std::move(*result) : Segmentation{};
}

/// 100 discs of radius 8 on a jittered lattice, on light that falls off to one side, with noise.
GreyImage nuclei_scene(std::uint64_t seed, double* area_px) {
  GreyImage image(400, 400);
  for (std::int64_t y = 0; y < 400; ++y) {
    for (std::int64_t x = 0; x < 400; ++x) image.at(y, x) = static_cast<std::uint8_t>(15 + x / 10);
  }
  Stream stream(seed, CellId{1}, 0, Purpose::kFounderPlace);
  for (int i = 0; i < 100; ++i) {
    const Disc disc{20.0 + 40.0 * (i % 10) + 16.0 * stream.uniform() - 8.0,
                    20.0 + 40.0 * (i / 10) + 16.0 * stream.uniform() - 8.0, 8.0};
    const int light = 60 + static_cast<int>(120 * stream.uniform());
    for (std::int64_t y = 0; y < 400; ++y) {
      for (std::int64_t x = 0; x < 400; ++x) {
        if (disc.holds(y, x)) image.at(y, x) = static_cast<std::uint8_t>(image.at(y, x) + light);
      }
    }
  }
  add_noise(image, 6, seed);
  *area_px = 100 * std::numbers::pi * 64.0;
  return image;
}

TEST(Segment, NucleiOnUnevenLightAreAllCountedLightOrDark) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    double area_px = 0.0;
    const GreyImage light = nuclei_scene(seed, &area_px);
    GreyImage dark = light;
    for (std::uint8_t& value : dark.values) value = static_cast<std::uint8_t>(255 - value);
    for (const GreyImage* image : {&light, static_cast<const GreyImage*>(&dark)}) {
      const Segmentation result = found_in(*image);
      EXPECT_EQ(result.pipeline, Pipeline::kNuclei);
      EXPECT_EQ(result.foreground, image == &light ? Foreground::kLight : Foreground::kDark);
      EXPECT_EQ(result.areas_px.size(), 100U) << seed;
      EXPECT_NEAR(static_cast<double>(result.foreground_px), area_px, 0.12 * area_px) << seed;
      EXPECT_FALSE(result.dish_found);
    }
  }
}

TEST(Segment, TheSweepStandsAroundTheThresholdAndContainsTheAnswer) {
  double area_px = 0.0;
  const Segmentation result = found_in(nuclei_scene(5, &area_px));
  ASSERT_EQ(result.sweep.size(), 9U);
  EXPECT_EQ(result.sweep[4].threshold, result.threshold);
  EXPECT_EQ(result.sweep[4].object_count, static_cast<std::int64_t>(result.areas_px.size()));
  EXPECT_EQ(result.sweep[4].foreground_px, result.foreground_px);
  for (std::size_t i = 1; i < 9; ++i) EXPECT_LE(result.sweep[i].foreground_px, result.sweep[i - 1].foreground_px);
  SegmentOptions options;
  options.threshold = result.sweep[7].threshold;
  const Segmentation given = found_in(nuclei_scene(5, &area_px), options);
  EXPECT_TRUE(given.threshold_given);
  EXPECT_EQ(given.foreground_px, result.sweep[7].foreground_px);
}

TEST(Segment, TheSweepHandsOverWhatItCountsTheAnswerFirst) {
  double area_px = 0.0;
  const GreyImage image = nuclei_scene(5, &area_px);
  std::vector<SweepPoint> seen;
  SegmentOptions options;
  options.at_threshold = [&](const ThresholdView& view) {
    std::int64_t objects = 0, pixels = 0;
    for (const std::uint32_t label : view.labels.values) {
      objects = std::max<std::int64_t>(objects, label);
      pixels += label != 0;
    }
    seen.push_back({view.threshold, pixels, objects});
    EXPECT_EQ(view.pipeline, Pipeline::kNuclei);
    EXPECT_EQ(view.mask.values.size(), view.labels.values.size());
  };
  const Segmentation result = found_in(image, options);
  ASSERT_EQ(seen.size(), 9U);
  EXPECT_EQ(seen[0].threshold, result.threshold);
  std::sort(seen.begin(), seen.end(), [](const SweepPoint& a, const SweepPoint& b) { return a.threshold < b.threshold; });
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(seen[i].threshold, result.sweep[i].threshold);
    EXPECT_EQ(seen[i].foreground_px, result.sweep[i].foreground_px);
    EXPECT_EQ(seen[i].object_count, result.sweep[i].object_count);
  }
  seen.clear();
  options.sweep = false;
  EXPECT_TRUE(found_in(image, options).sweep.empty());
  EXPECT_TRUE(seen.empty());
}

TEST(Segment, SaysWhyItChoseAndWhatElseThereIs) {
  double area_px = 0.0;
  const GreyImage image = nuclei_scene(1, &area_px);
  const Segmentation chosen = found_in(image);
  EXPECT_FALSE(chosen.pipeline_given || chosen.foreground_given);
  EXPECT_THAT(chosen.pipeline_reason, HasSubstr("an even ground at one end of the histogram"));
  EXPECT_THAT(chosen.pipeline_reason, HasSubstr("pipeline=phase"));  // who sent actin reads here what to do
  EXPECT_THAT(chosen.foreground_reason, HasSubstr("the light end"));
  const Segmentation asked = found_in(image, {.pipeline = Pipeline::kPhase, .foreground = Foreground::kLight});
  EXPECT_TRUE(asked.pipeline_given && asked.foreground_given);
  EXPECT_EQ(asked.pipeline_reason, "asked for");
}

TEST(Segment, EveryStepIsKeptByNameOrOnlyTheOneAskedFor) {
  double area_px = 0.0;
  const GreyImage image = nuclei_scene(1, &area_px);
  const auto names = [](const Segmentation& result) {
    std::vector<std::string> list;
    for (const StepImage& step : result.steps) {
      list.push_back(step.name);
      EXPECT_FALSE(step.text.empty());
      EXPECT_EQ(step.values.size(), static_cast<std::size_t>(step.width_px * step.height_px * step.channel_count));
    }
    return list;
  };
  EXPECT_EQ(names(found_in(image)), (std::vector<std::string>{"grey", "background", "corrected", "signal", "threshold",
                                                              "cleaned", "distance", "overlay"}));
  SegmentOptions options;
  for (const StepImage& step : found_in(image).steps) {
    options.keep_only = step.name;
    const Segmentation one = found_in(image, options);
    ASSERT_EQ(names(one), std::vector<std::string>{step.name});
    EXPECT_EQ(one.steps.front().values, step.values) << step.name;
    EXPECT_TRUE(one.sweep.empty()) << step.name;
    EXPECT_EQ(one.labels.values.empty(), step.name != "overlay") << step.name;  // what comes after it is not made
  }
  options.keep_only = "";
  options.keep_steps = false;
  EXPECT_TRUE(found_in(image, options).steps.empty());
  options = {.pipeline = Pipeline::kPhase, .clahe = true};
  EXPECT_EQ(names(found_in(image, options)),
            (std::vector<std::string>{"grey", "clahe", "signal", "threshold", "cleaned", "overlay"}));
}

/// Noise everywhere, strong texture inside two discs of the same mean: thresholds of grey see nothing.
GreyImage phase_scene() {
  GreyImage image(300, 200, {}, 100);
  add_noise(image, 4, 1);
  GreyImage rough(300, 200, {}, 100);
  add_noise(rough, 50, 2);
  for (std::int64_t y = 0; y < 200; ++y) {
    for (std::int64_t x = 0; x < 300; ++x) {
      if (Disc{80, 100, 40}.holds(y, x) || Disc{220, 90, 30}.holds(y, x)) image.at(y, x) = rough.at(y, x);
    }
  }
  return image;
}

TEST(Segment, PhaseFindsTexturedRegionsWithTheWindowsReachTakenBack) {
  const Segmentation result = found_in(phase_scene());
  EXPECT_EQ(result.pipeline, Pipeline::kPhase);
  ASSERT_EQ(result.areas_px.size(), 2U);
  const double truth = std::numbers::pi * (1600 + 900);
  // The window decides within about a pixel of the border.
  EXPECT_NEAR(static_cast<double>(result.foreground_px), truth, 2 * std::numbers::pi * 70 * 1.5);
}

TEST(Segment, WhatIsThereRaisesNoDoubt) {
  double area_px = 0.0;
  EXPECT_EQ(segment(nuclei_scene(1, &area_px), {.pipeline = Pipeline::kNuclei})->doubt, "");
  EXPECT_EQ(segment(phase_scene(), {.pipeline = Pipeline::kPhase})->doubt, "");
}

TEST(Segment, ADishIsFoundByItsWallAndOnlyItsInsideIsLookedAt) {
  GreyImage image(400, 400, {}, 0);
  draw(image, {200, 200, 190}, 100);
  for (std::int64_t y = 0; y < 400; ++y) {
    for (std::int64_t x = 0; x < 400; ++x) {
      const bool wall = Disc{200, 200, 190}.holds(y, x) && !Disc{200, 200, 175}.holds(y, x);
      if (wall) image.at(y, x) = (x / 3 + y / 3) % 2 == 0 ? 20 : 220;
    }
  }
  GreyImage inside = image;
  add_noise(inside, 4, 1);
  for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = image.values[i] == 0 ? 0 : inside.values[i];
  GreyImage rough(400, 400, {}, 100);
  add_noise(rough, 90, 2);
  for (std::int64_t y = 0; y < 400; ++y) {
    for (std::int64_t x = 0; x < 400; ++x) {
      for (const Disc& colony : {Disc{120, 150, 9}, Disc{200, 220, 9}, Disc{290, 180, 9}, Disc{12, 12, 9}}) {
        if (colony.holds(y, x)) image.at(y, x) = rough.at(y, x);
      }
    }
  }
  const Segmentation result = found_in(image);
  EXPECT_TRUE(result.dish_found);
  EXPECT_EQ(result.areas_px.size(), 3U);  // not the wall, and not the dirt in the corner
  EXPECT_NEAR(static_cast<double>(result.field_px), std::numbers::pi * 172 * 172, 4000);
}

TEST(Segment, ADrawingIsTakenAsItIs) {
  GreyImage image(120, 120, {}, 255);
  for (std::int64_t k = 10; k < 110; ++k)
    image.at(10, k) = image.at(109, k) = image.at(k, 10) = image.at(k, 109) = image.at(k, 60) = 0;
  const Segmentation result = found_in(image);
  EXPECT_EQ(result.pipeline, Pipeline::kContours);
  EXPECT_EQ(result.foreground, Foreground::kDark);
  EXPECT_EQ(result.foreground_px, 4 * 100 - 4 + 98);  // each corner once, and the bar between top and bottom
  for (std::size_t i = 0; i < image.values.size(); ++i) ASSERT_EQ(result.mask.values[i] != 0, image.values[i] == 0);
  // Two filled discs are objects, not lines.
  GreyImage discs(120, 120);
  draw(discs, {30, 30, 12}, 255);
  draw(discs, {80, 80, 12}, 255);
  EXPECT_EQ(found_in(discs).pipeline, Pipeline::kNuclei);
}

TEST(Segment, OpenCvsThreadsAndVectorKernelsWouldNotChangeTheObjects) {
  // The settings are made once, by the first call; this test undoes them and sets them back, so it shows what they guard against on this machine.
  double area_px = 0.0;
  for (const SegmentOptions& options :
       {SegmentOptions{.pipeline = Pipeline::kNuclei}, SegmentOptions{.pipeline = Pipeline::kPhase},
        SegmentOptions{.pipeline = Pipeline::kPhase, .clahe = true}}) {
    const GreyImage image = nuclei_scene(4, &area_px);
    const Segmentation settled = found_in(image, options);
    EXPECT_EQ(cv::getNumThreads(), 1);
    EXPECT_FALSE(cv::useOptimized());
    cv::setNumThreads(2);
    cv::setUseOptimized(true);
    const Segmentation free = found_in(image, options);
    cv::setNumThreads(1);
    cv::setUseOptimized(false);
    EXPECT_EQ(settled.labels, free.labels);
    ASSERT_EQ(settled.steps.size(), free.steps.size());
    for (std::size_t i = 0; i < settled.steps.size(); ++i)
      EXPECT_EQ(settled.steps[i].values, free.steps[i].values) << settled.steps[i].name;
  }
}

TEST(Segment, AStopIsHeard) {
  double area_px = 0.0;
  const GreyImage image = nuclei_scene(1, &area_px);
  const std::atomic<bool> stop = true;
  EXPECT_THROW((void)segment(image, {}, &stop), Stopped);
}

TEST(Segment, WhatCannotBeSegmentedIsRefusedByName) {
  SegmentOptions options;
  const auto message = [&](const GreyImage& image) {
    const Result<Segmentation> result = segment(image, options);
    EXPECT_FALSE(result);
    return result ? std::string() : result.error().message;
  };
  EXPECT_THAT(message(GreyImage(100, 100, {}, 255)), HasSubstr("all its pixels are alike"));
  EXPECT_THAT(message(GreyImage(1, 1, {}, 7)), HasSubstr("all its pixels are alike"));
  double area_px = 0.0;
  const GreyImage image = nuclei_scene(1, &area_px);
  options.threshold = 254;
  EXPECT_THAT(message(image), HasSubstr("nothing is left in the foreground"));
  GreyImage drawing(9, 9, {}, 100);
  drawing.at(1, 1) = 101;
  options = {.pipeline = Pipeline::kContours, .foreground = Foreground::kLight, .threshold = 20};
  EXPECT_THAT(message(drawing), HasSubstr("everything is foreground"));
  for (const auto& [change, field] :
       std::vector<std::pair<SegmentOptions, std::string>>{{{.threshold = 255}, "threshold"},
                                                           {{.threshold = -1}, "threshold"},
                                                           {{.background_reach_px = 2}, "background_reach_px"},
                                                           {{.window_radius_px = 51}, "window_radius_px"},
                                                           {{.area_min_px = 0}, "area_min_px"},
                                                           {{.hole_max_px = -1}, "hole_max_px"}}) {
    const Result<Segmentation> result = segment(image, change);
    ASSERT_FALSE(result) << field;
    ASSERT_EQ(result.error().fields.size(), 1U);
    EXPECT_EQ(result.error().fields[0].pointer, field);
  }
}

TEST(Segment, ThinAndTinyPicturesAreAnswersOrErrorsNeverMore) {
  for (const auto& [width, height] :
       {std::pair{2, 1}, std::pair{1, 2}, std::pair{3, 3}, std::pair{1, 2000}, std::pair{2000, 1}, std::pair{5, 700}}) {
    GreyImage image(width, height, {}, 90);
    add_noise(image, 60, 4);
    for (const Pipeline pipeline : {Pipeline::kAuto, Pipeline::kNuclei, Pipeline::kPhase, Pipeline::kContours}) {
      const Result<Segmentation> result = segment(image, {.pipeline = pipeline, .clahe = true});
      EXPECT_TRUE(result || !result.error().message.empty());
    }
  }
}

std::string png_of(const GreyImage& image) {
  return encode_step_png({"grey", "", image.width_px, image.height_px, 1, image.values});
}

TEST(AnalyseImage, FileInMeasuresOutAndLengthsInUmOnlyWhereAScaleIsGiven) {
  double area_px = 0.0;
  const std::string file = png_of(nuclei_scene(2, &area_px));
  AnalysisOptions options;
  const auto plain = analyse_image(file, options);
  ASSERT_TRUE(plain) << plain.error().message;
  EXPECT_EQ(plain->object_count, 100);
  EXPECT_FALSE(plain->area_mean_um2);
  options.um_per_px = 0.5;
  const auto scaled = analyse_image(file, options);
  ASSERT_TRUE(scaled);
  EXPECT_DOUBLE_EQ(*scaled->area_mean_um2, plain->area_mean_px * 0.25);
  EXPECT_DOUBLE_EQ(*scaled->density_per_mm2, 100 / 0.04);  // 200 um x 200 um
  EXPECT_EQ(scaled->segmentation.labels.um_per_px, 0.5);
  for (const double wrong : {0.0, -1.0, 1e9, std::nan("")}) {
    options.um_per_px = wrong;
    EXPECT_THAT(analyse_image(file, options).error().message, HasSubstr("um_per_px"));
  }
}

TEST(AnalyseImage, TheSameIn16BitsAndChannelsMustBeNamed) {
  double area_px = 0.0;
  const GreyImage image = nuclei_scene(3, &area_px);
  Picture16 deep{400, 400, 1, {}}, two{400, 400, 2, {}};
  for (const std::uint8_t value : image.values) {
    deep.samples.push_back(static_cast<std::uint16_t>(200 + 9 * value));  // a 12-bit camera
    two.samples.push_back(50);
    two.samples.push_back(value);
  }
  const auto wide = analyse_image(tiff_file({deep}, {.bits = 16, .compression = COMPRESSION_LZW}), {});
  ASSERT_TRUE(wide) << wide.error().message;
  EXPECT_EQ(wide->object_count, 100);
  EXPECT_GT(wide->metadata.level_low, 200);
  EXPECT_LT(wide->metadata.level_high, 200 + 9 * 256);
  const std::string channels = tiff_file({two}, {.planar = true});
  AnalysisOptions options;
  EXPECT_THAT(analyse_image(channels, options).error().message, HasSubstr("say which"));
  options.channel = 2;
  EXPECT_THAT(analyse_image(channels, options).error().message, HasSubstr("has 2 channels"));
  options.channel = 0;
  EXPECT_THAT(analyse_image(channels, options).error().message, HasSubstr("alike"));
  options.channel = 1;
  const auto second = analyse_image(channels, options);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->object_count, 100);
}

TEST(AnalyseImage, BadFilesAreRefusedByName) {
  const auto message = [](const std::string& file) {
    const auto result = analyse_image(file, {});
    EXPECT_FALSE(result);
    return result ? std::string() : result.error().message;
  };
  EXPECT_THAT(message("hello"), HasSubstr("like a text"));
  EXPECT_THAT(message(png_file(1, 50'000, {}, std::vector<std::uint8_t>(50'000, 7))), HasSubstr("at most 20000"));
  EXPECT_THAT(message(png_of(GreyImage(1, 1, {}, 200))), HasSubstr("alike"));
  EXPECT_THAT(message(png_of(GreyImage(300, 300, {}, 255))), HasSubstr("alike"));
  const std::string whole = png_of(GreyImage(300, 300, {}, 255));
  EXPECT_THAT(message(whole.substr(0, whole.size() / 2)), HasSubstr("cut-off PNG"));
}

}  // namespace
}  // namespace colony
