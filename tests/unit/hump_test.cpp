// Noise and things told apart by the levels that a threshold parts: noise of several widths, sizes and seeds warns, a single disc does not.
#include "engine/analysis/hump.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "engine/analysis/segment.hpp"
#include "tests/support/image_scenes.hpp"

namespace colony {
namespace {

using namespace testing;

/// Normal or even noise without anything in it.
GreyImage noise(std::int64_t side_px, double mean, double sd, std::uint64_t seed, bool is_even = false) {
  GreyImage image(side_px, side_px);
  Stream stream(seed, CellId{1}, 0, Purpose::kFounder);
  for (std::uint8_t& value : image.values) {
    const double draw = is_even ? (2.0 * stream.uniform() - 1.0) * 1.732 : stream.normal();
    value = static_cast<std::uint8_t>(std::clamp(mean + sd * draw, 0.0, 255.0) + 0.5);
  }
  return image;
}

TEST(Segment, NoiseIsOneHumpOfLevelsAndSaysThatNothingMayBeThere) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const double sd : {3.0, 10.0, 25.0}) {
      for (const std::int64_t side_px : {200, 500}) {
        for (const Pipeline pipeline : {Pipeline::kAuto, Pipeline::kPhase, Pipeline::kNuclei}) {
          if (side_px == 500 && (seed > 2 || pipeline == Pipeline::kAuto)) continue;  // time
          const Segmentation found = *segment(noise(side_px, 120.0, sd, seed, seed % 3 == 0), {.pipeline = pipeline, .keep_steps = false, .sweep = false});
          ASSERT_TRUE(found.levels);
          EXPECT_NE(found.doubt.find("there may be nothing in this picture"), std::string::npos)
              << "seed " << seed << ", sd " << sd << ", " << side_px << " px, pipeline " << static_cast<int>(pipeline) << ": " << found.levels->between_share << ' '
              << found.levels->skewness << ' ' << found.levels->kurtosis;
        }
      }
    }
  }
  // A threshold that somebody gives changes what is counted, not what is there.
  EXPECT_NE(segment(noise(200, 120.0, 10.0, 1), {.pipeline = Pipeline::kPhase, .threshold = 110})->doubt, "");
  // What is there has two kinds of pixels, few as they may be.
  GreyImage one = noise(300, 60.0, 5.0, 3);
  draw(one, {150.0, 150.0, 20.0}, 180);
  EXPECT_EQ(segment(one, {.pipeline = Pipeline::kNuclei})->doubt, "");
}

TEST(HumpFigures, AreThoseOfTheDistribution) {
  // Half the pixels 0, half 200: all of the variance lies between the classes, and the kurtosis is the least there is.
  GreyImage two(10, 10);
  std::fill_n(two.values.begin(), 50, std::uint8_t{200});
  const HumpFigures figures = *hump_figures(two);
  EXPECT_DOUBLE_EQ(figures.between_share, 1.0);
  EXPECT_NEAR(figures.skewness, 0.0, 1e-12);
  EXPECT_NEAR(figures.kurtosis, 1.0, 1e-12);
  EXPECT_FALSE(is_one_hump(figures));
  const HumpFigures normal = *hump_figures(noise(500, 128.0, 20.0, 1));
  EXPECT_NEAR(normal.between_share, 2.0 / 3.14159265, 0.01);
  EXPECT_NEAR(normal.skewness, 0.0, 0.03);
  EXPECT_NEAR(normal.kurtosis, 3.0, 0.06);
  EXPECT_FALSE(hump_figures(GreyImage(5, 5))) << "one level";
}

}  // namespace
}  // namespace colony
