#include "engine/analysis/box_counting.hpp"

#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "engine/analysis/parallel.hpp"
#include "engine/random/stream.hpp"
#include "tests/support/fractals.hpp"

namespace colony {
namespace {

BinaryImage random_image(std::int64_t width, std::int64_t height, double share, Seed seed) {
  BinaryImage image(width, height);
  Stream stream(seed, CellId{1}, 0, Purpose::kFounder);
  // 255 as well as 1: any value but 0 is foreground.
  for (std::uint8_t& value : image.values) value = stream.uniform() < share ? (stream.uniform() < 0.5 ? 1 : 255) : 0;
  return image;
}

/// By the definition, box by box, for one grid.
struct Brute {
  std::uint64_t boxes = 0;
  double information = 0.0;
};
template <class T>
Brute brute_force(const ImageOf<T>& image, const PixelBox& part, std::int64_t side, std::int64_t row_offset,
                  std::int64_t column_offset) {
  std::map<std::pair<std::int64_t, std::int64_t>, double> masses;
  double total = 0.0;
  for (std::int64_t row = 0; row < part.height; ++row) {
    for (std::int64_t column = 0; column < part.width; ++column) {
      const T value = image.at(part.top + row, part.left + column);
      if (value == 0) continue;
      const double mass = sizeof(T) == 1 ? 1.0 : static_cast<double>(value);
      masses[{(row - row_offset + side) / side, (column - column_offset + side) / side}] += mass;
      total += mass;
    }
  }
  Brute brute;
  brute.boxes = masses.size();
  for (const auto& [box, mass] : masses) brute.information -= mass / total * std::log(mass / total);
  return brute;
}

TEST(BoxCounting, EqualsTheDefinitionForEveryOffset) {
  const BinaryImage image = random_image(61, 47, 0.03, 3);
  for (const PixelBox& part : {PixelBox{0, 0, 61, 47}, PixelBox{5, 9, 40, 31}}) {
    for (const std::int64_t side : {1, 2, 3, 5, 7, 16, 46, 47, 61, 100}) {
      const int per_axis = static_cast<int>(std::min<std::int64_t>(side, 9));
      const auto counts = count_boxes(image, {part, {side}, per_axis}, 1);
      ASSERT_TRUE(counts);
      double boxes = 0.0, information = 0.0;
      std::uint64_t least = UINT64_MAX, most = 0;
      for (int i = 0; i < per_axis; ++i) {
        for (int j = 0; j < per_axis; ++j) {
          const Brute brute = brute_force(image, part, side, i * side / per_axis, j * side / per_axis);
          boxes += static_cast<double>(brute.boxes);
          information += brute.information;
          least = std::min(least, brute.boxes);
          most = std::max(most, brute.boxes);
        }
      }
      const BoxCount& count = counts->front();
      EXPECT_EQ(count.offset_count, per_axis * per_axis);
      EXPECT_DOUBLE_EQ(count.count_mean, boxes / (per_axis * per_axis)) << side;
      EXPECT_EQ(count.count_min, least);
      EXPECT_EQ(count.count_max, most);
      EXPECT_NEAR(count.information_mean, information / (per_axis * per_axis), 1e-12);
    }
  }
}

TEST(BoxCounting, AMeasureCountsItsMass) {
  ImageOf<std::uint32_t> mass(33, 21);
  Stream stream(5, CellId{1}, 0, Purpose::kFounder);
  for (std::uint32_t& value : mass.values) value = stream.below(3) == 0 ? stream.below(4'000'000'000u) : 0;
  const auto counts = count_boxes(mass, {{0, 0, 33, 21}, {4}, 1}, 1);
  ASSERT_TRUE(counts);
  const Brute brute = brute_force(mass, {0, 0, 33, 21}, 4, 0, 0);
  EXPECT_EQ(counts->front().count_min, brute.boxes);
  EXPECT_NEAR(counts->front().information_mean, brute.information, 1e-12);
}

/// Over all s x s offsets, the mean of N(s) s^2 is the area of the set spread by a square of side s: box counting by the offset
/// mean is Minkowski's measurement.
TEST(BoxCounting, MeanOverAllOffsetsIsTheAreaOfTheSpreadSet) {
  const BinaryImage image = random_image(50, 40, 0.02, 9);
  for (const std::int64_t side : {2, 5, 12}) {
    std::set<std::pair<std::int64_t, std::int64_t>> spread;
    for (std::int64_t row = 0; row < 40; ++row) {
      for (std::int64_t column = 0; column < 50; ++column) {
        if (image.at(row, column) == 0) continue;
        for (std::int64_t r = 0; r < side; ++r) {
          for (std::int64_t c = 0; c < side; ++c) spread.insert({row + r, column + c});
        }
      }
    }
    const auto counts = count_boxes(image, {{0, 0, 50, 40}, {side}, static_cast<int>(side)}, 1);
    ASSERT_TRUE(counts);
    EXPECT_DOUBLE_EQ(counts->front().count_mean * static_cast<double>(side * side), static_cast<double>(spread.size()));
  }
}

TEST(BoxCounting, TheThreadCountChangesNoBit) {
  const BinaryImage image = random_image(300, 200, 0.1, 4);
  const BoxGrid grid{{0, 0, 300, 200}, {3, 4, 5, 7, 9, 11, 15, 19, 24}, 8};
  const auto serial = count_boxes(image, grid, 1);
  ASSERT_TRUE(serial);
  for (const int threads : {2, 3, 7, 16}) {
    const auto parallel = count_boxes(image, grid, threads);
    ASSERT_TRUE(parallel);
    EXPECT_EQ(*serial, *parallel) << threads;
  }
}

TEST(BoxCounting, SmallSidesHaveOnlyTheirOwnOffsets) {
  const auto counts = count_boxes(random_image(20, 20, 0.5, 1), {{0, 0, 20, 20}, {1, 3, 8, 9}, 8}, 1);
  ASSERT_TRUE(counts);
  EXPECT_EQ((*counts)[0].offset_count, 1);
  EXPECT_EQ((*counts)[1].offset_count, 9);
  EXPECT_EQ((*counts)[2].offset_count, 64);
  EXPECT_EQ((*counts)[3].offset_count, 64);
}

std::string field_of(const Result<std::vector<BoxCount>>& result) {
  return result || result.error().fields.empty() ? "" : result.error().fields.front().pointer;
}

TEST(BoxCounting, RefusesByName) {
  const BinaryImage image = random_image(20, 20, 0.5, 1);
  const PixelBox all{0, 0, 20, 20};
  EXPECT_EQ(field_of(count_boxes(BinaryImage(20, 20), {all, {3}, 1}, 1)), "image");
  EXPECT_EQ(field_of(count_boxes(image, {all, {}, 1}, 1)), "sides_px");
  EXPECT_EQ(field_of(count_boxes(image, {all, {0}, 1}, 1)), "sides_px");
  EXPECT_EQ(field_of(count_boxes(image, {all, std::vector<std::int64_t>(65, 3), 1}, 1)), "sides_px");
  EXPECT_EQ(field_of(count_boxes(image, {all, {3}, 0}, 1)), "offsets_per_axis");
  EXPECT_EQ(field_of(count_boxes(image, {all, {3}, 33}, 1)), "offsets_per_axis");
  EXPECT_EQ(field_of(count_boxes(image, {{1, 0, 20, 20}, {3}, 1}, 1)), "part");
  EXPECT_EQ(field_of(count_boxes(image, {{0, 0, 0, 0}, {3}, 1}, 1)), "part");
  BinaryImage cut = image;
  cut.values.pop_back();
  EXPECT_EQ(field_of(count_boxes(cut, {all, {3}, 1}, 1)), "image");
  BinaryImage wide;  // refused before anything of that size is allocated
  wide.width_px = 1;
  wide.height_px = 50'000;
  const auto refused = count_boxes(wide, {all, {3}, 1}, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
  BinaryImage scaled = image;
  scaled.um_per_px = std::nan("");
  EXPECT_EQ(field_of(count_boxes(scaled, {all, {3}, 1}, 1)), "image");
}

TEST(BoxCounting, ForegroundBox) {
  BinaryImage image(9, 7);
  EXPECT_EQ(foreground_box(image).width, 0);
  image.at(2, 5) = 1;
  EXPECT_EQ(foreground_box(image), (PixelBox{5, 2, 1, 1}));
  image.at(6, 1) = 255;
  EXPECT_EQ(foreground_box(image), (PixelBox{1, 2, 5, 5}));
}

TEST(Parallel, CallsEachIndexOnceAndPassesTheFailureOn) {
  for (const int threads : {1, 4}) {
    std::vector<int> calls(1000, 0);
    for_each_index(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    EXPECT_EQ(calls, std::vector<int>(1000, 1));
    const auto failing = [](std::size_t i) {
      if (i == 17) throw std::runtime_error("17");
    };
    EXPECT_THROW(for_each_index(1000, threads, failing), std::runtime_error);
    std::atomic<bool> stop{true};
    EXPECT_THROW(for_each_index(3, threads, [](std::size_t) {}, &stop), Stopped);
  }
}

}  // namespace
}  // namespace colony
