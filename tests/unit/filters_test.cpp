// filters, split: each step against its definition, written out the slow way, or against a drawn answer.
#include "engine/analysis/filters.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/analysis/split.hpp"
#include "tests/support/image_scenes.hpp"

namespace colony {
namespace {

using namespace testing;

GreyImage noise(std::int64_t width, std::int64_t height, std::uint64_t seed) {
  GreyImage image(width, height, {}, 128);
  add_noise(image, 128, seed);
  return image;
}

std::int64_t mirror(std::int64_t at, std::int64_t count) {
  if (at < 0) at = -at - 1;
  if (at >= count) at = 2 * count - 1 - at;
  return std::clamp<std::int64_t>(at, 0, count - 1);
}

TEST(Filters, LocalDeviationIsThatOfTheWindowAlsoAtTheFrameAndInThinImages) {
  for (const auto& [width, height] : {std::pair{17, 13}, std::pair{1, 40}, std::pair{40, 1}, std::pair{3, 3}}) {
    const GreyImage image = noise(width, height, 3);
    for (const std::int64_t radius : {1, 3, 5}) {
      const GreyImage result = local_deviation(image, radius);
      for (std::int64_t y = 0; y < height; ++y) {
        for (std::int64_t x = 0; x < width; ++x) {
          double sum = 0.0, squares = 0.0, count = 0.0;
          for (std::int64_t dy = -radius; dy <= radius; ++dy) {
            for (std::int64_t dx = -radius; dx <= radius; ++dx) {
              const double value = image.at(mirror(y + dy, height), mirror(x + dx, width));
              sum += value;
              squares += value * value;
              count += 1.0;
            }
          }
          const double deviation = std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
          ASSERT_NEAR(result.at(y, x), 255.0 * std::log(1.0 + deviation) / std::log(128.5), 4.0) << x << " " << y;
        }
      }
    }
  }
  // segment.cpp takes what is below 37 for rounding: stripes one level to each side of their mean must be, one and a half must not.
  GreyImage stripes(20, 20);
  for (const int step : {2, 3}) {
    for (std::size_t i = 0; i < stripes.values.size(); ++i)
      stripes.values[i] = static_cast<std::uint8_t>(i % 2 == 0 ? 9 : 9 + step);
    EXPECT_EQ(local_deviation(stripes, 4).at(10, 10) < 37, step == 2);
  }
  EXPECT_EQ(local_deviation(GreyImage(9, 9, {}, 77), 2).at(4, 4), 0);
}

TEST(Filters, OtsuPartsTwoPeaksInTheMiddleAndRefusesOne) {
  GreyImage image(100, 10, {}, 40);
  for (std::size_t i = 0; i < 300; ++i) image.values[i] = 200;
  EXPECT_EQ(otsu(image), 119);  // every level of 40..199 parts them: the middle one
  EXPECT_EQ(otsu(GreyImage(5, 5, {}, 7)), -1);
  image.values[0] = 0;
  EXPECT_EQ(otsu(image, 41), -1);  // only 200 is left
}

TEST(Filters, OtsuIsTheBestOfAllLevels) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    GreyImage image = noise(30, 30, seed);
    for (std::uint8_t& value : image.values) value = static_cast<std::uint8_t>(value * value / 255);
    const auto between = [&](int level) {
      double low = 0, low_sum = 0, high = 0, high_sum = 0;
      for (const std::uint8_t value : image.values)
        (value <= level ? (low += 1, low_sum) : (high += 1, high_sum)) += value;
      if (low == 0 || high == 0) return 0.0;
      const double gap = low_sum / low - high_sum / high;
      return low * high * gap * gap;
    };
    double best = 0.0;
    for (int level = 0; level < 255; ++level) best = std::max(best, between(level));
    EXPECT_NEAR(between(otsu(image)), best, 1e-9 * best) << seed;
  }
}

TEST(Filters, TheBackgroundOfARampIsTheRampAndObjectsAreNotInIt) {
  for (const std::int64_t reach : {31, 101}) {  // straight, and on blocks
    GreyImage ramp(200, 160);
    for (std::int64_t y = 0; y < 160; ++y) {
      for (std::int64_t x = 0; x < 200; ++x) ramp.at(y, x) = static_cast<std::uint8_t>(20 + x / 2);
    }
    GreyImage image = ramp;
    for (const Disc& disc : {Disc{50, 80, 9}, Disc{100, 80, 9}, Disc{150, 60, 9}}) draw(image, disc, 250);
    const GreyImage ground = background(image, reach);
    for (std::int64_t y = 0; y < 160; ++y) {
      // An opening lags behind a slope by half its side at most, here half a level a pixel; at the frame it flattens.
      for (std::int64_t x = reach; x < 200 - reach; ++x)
        ASSERT_NEAR(ground.at(y, x), ramp.at(y, x), static_cast<double>(reach) / 4 + 2) << x;
    }
    EXPECT_GT(subtracted(image, ground).at(80, 100), 140);
  }
}

TEST(Filters, HolesArePiecesOfBackgroundThatDoNotTouchTheFrame) {
  BinaryImage mask(20, 20);
  for (std::int64_t y = 2; y < 12; ++y) {
    for (std::int64_t x = 2; x < 12; ++x) mask.at(y, x) = 255;
  }
  mask.at(4, 4) = 0;
  for (std::int64_t x = 7; x < 11; ++x) mask.at(7, x) = 0;  // four
  BinaryImage open = mask;
  open.at(7, 11) = 0;  // a way out
  EXPECT_EQ(histogram(holes_filled(mask, 3))[255], 100 - 4);
  EXPECT_EQ(histogram(holes_filled(mask, 4))[255], 100);
  EXPECT_EQ(histogram(holes_filled(open, 400))[255], 100 - 5);
  // 8-connected foreground encloses: a diamond of corners has a hole.
  BinaryImage diamond(5, 5);
  diamond.at(1, 2) = diamond.at(2, 1) = diamond.at(2, 3) = diamond.at(3, 2) = 255;
  EXPECT_EQ(histogram(holes_filled(diamond, 9))[255], 5);
  EXPECT_EQ(pieces_of(diamond).pieces.size(), 1U);
}

TEST(Filters, DistanceIsEuclidWithinTwoPerCent) {
  BinaryImage mask(101, 101, {}, 255);
  mask.at(50, 50) = 0;
  const Grey16Image distance = distance_inside(mask);
  for (std::int64_t y = 0; y < 101; ++y) {
    for (std::int64_t x = 0; x < 101; ++x) {
      const double truth = 16.0 * std::sqrt(static_cast<double>((x - 50) * (x - 50) + (y - 50) * (y - 50)));
      ASSERT_NEAR(distance.at(y, x), truth, 0.02 * truth + 1.0);
    }
  }
  EXPECT_EQ(distance_inside(BinaryImage(4, 4, {}, 255)).at(2, 2), 65535);  // no background at all
}

LabelImage parted(const std::vector<Disc>& discs, std::int64_t side) {
  BinaryImage mask(side, side);
  for (const Disc& disc : discs) draw(mask, disc, 255);
  return split_touching(distance_inside(mask), 5);
}
std::uint32_t count_of(const LabelImage& labels) {
  return *std::max_element(labels.values.begin(), labels.values.end());
}

TEST(Split, TwoDiscsPartOnceTheirWaistIsAnEighthBelowTheirRadius) {
  for (const double radius : {6.0, 12.0, 30.0}) {
    for (const double angle : {0.0, 0.4, 0.8}) {
      const auto two = [&](double apart) {
        return parted(
            {{64, 64, radius}, {64 + apart * radius * std::cos(angle), 64 + apart * radius * std::sin(angle), radius}},
            160);
      };
      EXPECT_EQ(count_of(two(0.6)), 1U) << radius << " " << angle;
      EXPECT_EQ(count_of(two(1.5)), 2U) << radius << " " << angle;
      const LabelImage labels = two(1.7);
      // Parted down the middle, and every pixel of the mask belongs to one.
      std::int64_t first = 0, second = 0;
      for (const std::uint32_t label : labels.values) {
        first += label == 1;
        second += label == 2;
      }
      EXPECT_NEAR(static_cast<double>(first) / static_cast<double>(second), 1.0, 0.08) << radius << " " << angle;
    }
  }
}

TEST(Split, OneDiscOrEllipseStaysOneAndAChainIsCounted) {
  for (double radius = 2.0; radius < 40.0; radius += 1.7)
    EXPECT_EQ(count_of(parted({{64.3, 63.8, radius}}, 128)), 1U) << radius;
  BinaryImage ellipse(128, 128);
  for (std::int64_t y = 0; y < 128; ++y) {
    for (std::int64_t x = 0; x < 128; ++x) {
      const double u = static_cast<double>(x - 64) / 40.0, v = static_cast<double>(y - 64) / 15.0;
      ellipse.at(y, x) = u * u + v * v <= 1.0 ? 255 : 0;
    }
  }
  EXPECT_EQ(count_of(split_touching(distance_inside(ellipse), 5)), 1U);
  std::vector<Disc> chain;
  for (int i = 0; i < 8; ++i) chain.push_back({20.0 + 14.0 * i, 64.0 + (i % 2) * 6.0, 9.0});
  EXPECT_EQ(count_of(parted(chain, 140)), 8U);
}

TEST(Split, RenumberedGoesByTheFirstPixelAndDropsWhatIsSmall) {
  LabelImage labels(4, 2);
  labels.values = {9, 0, 4, 4, 9, 2, 4, 4};
  std::vector<std::int64_t> areas;
  EXPECT_EQ(renumbered(labels, 2, &areas).values, (std::vector<std::uint32_t>{1, 0, 2, 2, 1, 0, 2, 2}));
  EXPECT_EQ(areas, (std::vector<std::int64_t>{2, 4}));
}

}  // namespace
}  // namespace colony
