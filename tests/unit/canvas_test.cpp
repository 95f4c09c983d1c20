// The canvas of figures: ink lies where it was asked for, in the amount asked for; texts stand within the boxes that are told of them.
#include "engine/analysis/canvas.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr Ink kBlack{0, 0, 0};

/// Of black on white: how much ink (a full pixel is 1), its middle, and the pixels it reaches.
struct Found {
  double mass = 0.0, x = 0.0, y = 0.0;
  std::int64_t left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
};
Found ink_of(const Canvas& canvas) {
  const StepImage image = canvas.picture();
  Found found;
  for (std::int64_t row = 0; row < image.height_px; ++row) {
    for (std::int64_t column = 0; column < image.width_px; ++column) {
      const double dark = (255.0 - image.values[static_cast<std::size_t>(3 * (row * image.width_px + column))]) / 255.0;
      if (dark == 0.0) continue;
      found.mass += dark;
      found.x += dark * (static_cast<double>(column) + 0.5);
      found.y += dark * (static_cast<double>(row) + 0.5);
      found.left = std::min(found.left, column);
      found.right = std::max(found.right, column);
      found.top = std::min(found.top, row);
      found.bottom = std::max(found.bottom, row);
    }
  }
  if (found.mass > 0.0) {
    found.x /= found.mass;
    found.y /= found.mass;
  }
  return found;
}

TEST(Canvas, ALineJoinsItsEndsAndIsAsWideAsAsked) {
  for (const double width : {1.0, 2.0, 4.0}) {
    for (const auto& [dx, dy] : {std::pair{120.0, 0.0}, {0.0, 120.0}, {96.0, 72.0}, {-72.0, 96.0}, {100.0, -10.0}}) {
      Canvas canvas(300, 300);
      canvas.line({150.0 - dx / 2.0, 150.0 - dy / 2.0}, {150.0 + dx / 2.0, 150.0 + dy / 2.0}, kBlack, width);
      const Found found = ink_of(canvas);
      const double length = std::hypot(dx, dy);
      SCOPED_TRACE(testing::Message() << width << " " << dx << " " << dy);
      EXPECT_NEAR(found.x, 150.25, 0.3);  // a whole number is the middle of the first of a pixel's two halves
      EXPECT_NEAR(found.y, 150.25, 0.3);
      EXPECT_NEAR(found.mass / length, width, 0.3);
      EXPECT_NEAR(static_cast<double>(found.right - found.left + 1), std::abs(dx) + width, width + 2.0);
      EXPECT_NEAR(static_cast<double>(found.bottom - found.top + 1), std::abs(dy) + width, width + 2.0);
    }
  }
}

TEST(Canvas, ABarHasExactlyItsArea) {
  for (const double length : {20.0, 20.5, 101.0}) {
    Canvas canvas(200, 100);
    canvas.box({30.0, 40.0}, length, 6.0, kBlack, true);
    const Found found = ink_of(canvas);
    EXPECT_NEAR(found.mass, length * 6.0, 0.02) << "a scale bar is read off";
    EXPECT_NEAR(found.x, 30.0 + length / 2.0, 0.01);
    EXPECT_NEAR(found.y, 43.0, 0.01);
  }
}

TEST(Canvas, AFrameEnclosesNothingButItsLines) {
  Canvas canvas(200, 100);
  canvas.box({30.0, 40.0}, 100.0, 50.0, kBlack, false);
  const Found found = ink_of(canvas);
  EXPECT_NEAR(found.mass, 300.0, 2.0) << "of one pixel";
  EXPECT_NEAR(found.x, 80.0, 1e-3);
  EXPECT_NEAR(found.y, 65.0, 1e-3);
}

TEST(Canvas, ADotIsADisc) {
  for (const double radius : {3.0, 4.5, 20.0}) {
    Canvas canvas(100, 100);
    canvas.dot({50.0, 40.0}, radius, kBlack, true);
    const Found found = ink_of(canvas);
    EXPECT_NEAR(found.mass / (3.14159265 * radius * radius), 1.0, 2.5 / radius);
    EXPECT_NEAR(found.x, 50.25, 0.3);
    EXPECT_NEAR(found.y, 40.25, 0.3);
  }
  // A hollow one hides what runs behind it.
  Canvas canvas(100, 100);
  canvas.line({10.0, 50.0}, {90.0, 50.0}, kBlack, 3.0);
  canvas.dot({50.0, 50.0}, 10.0, kBlack, false);
  EXPECT_EQ(canvas.picture().values[3 * (50 * 100 + 50)], 255);
}

TEST(Canvas, TextsStandInTheirBoxes) {
  for (const Align align : {Align::kLeft, Align::kCentre, Align::kRight}) {
    for (const char* text : {"1", "D0 1.846 +- 0.012", "gypsy jog (Q)", "control, hexagonal discs"}) {
      Canvas canvas(600, 100);
      canvas.text({300.0, 50.0}, text, kBlack, align, 14.0);
      ASSERT_EQ(canvas.texts().size(), 1u);
      const TextBox& box = canvas.texts()[0];
      EXPECT_EQ(box.text, text);
      const double anchor = align == Align::kLeft ? box.left : align == Align::kCentre ? (box.left + box.right) / 2.0 : box.right;
      EXPECT_NEAR(anchor, 300.0, 0.6);
      const Found found = ink_of(canvas);
      EXPECT_GE(static_cast<double>(found.left) + 1.0, box.left) << text;
      EXPECT_LE(static_cast<double>(found.right), box.right) << text;
      EXPECT_GE(static_cast<double>(found.top) + 1.0, box.top) << text;
      EXPECT_LE(static_cast<double>(found.bottom), box.bottom) << text;
      EXPECT_GE(static_cast<double>(found.right - found.left), 0.85 * (box.right - box.left) - 8.0) << "no wider than need be: " << text;
    }
  }
}

TEST(Canvas, ShadesAShareOfOnePixel) {
  Canvas canvas(20, 20);
  canvas.shade(5, 7, {0, 100, 255}, 0.5);
  const StepImage image = canvas.picture();
  const std::uint8_t* pixel = image.values.data() + 3 * (5 * 20 + 7);
  EXPECT_EQ(pixel[0], 128);
  EXPECT_EQ(pixel[1], 178);
  EXPECT_EQ(pixel[2], 255);
  EXPECT_EQ(std::count(image.values.begin(), image.values.end(), 255), 3 * 400 - 2);
  canvas.shade(5, 7, kBlack, 7.0);
  EXPECT_EQ(canvas.picture().values[3 * (5 * 20 + 7)], 0);
}

TEST(Canvas, WhatLiesOutsideIsNotDrawnAndWhatCannotBeDrawnIsRefused) {
  Canvas canvas(50, 40);
  canvas.line({-1e300, -5.0}, {1e300, -5.0}, kBlack, 2.0);
  canvas.line({100.0, 10.0}, {4000.0, 1e9}, kBlack);
  canvas.box({60.0, 0.0}, 1e12, 10.0, kBlack, true);
  canvas.dot({-30.0, 20.0}, 10.0, kBlack, true);
  canvas.text({200.0, 20.0}, "far", kBlack);
  canvas.shade(-1, 3, kBlack, 1.0);
  canvas.shade(3, 50, kBlack, 1.0);
  EXPECT_EQ(ink_of(canvas).mass, 0.0);
  canvas.line({-1e300, 20.0}, {1e300, 20.0}, kBlack, 2.0);
  EXPECT_NEAR(ink_of(canvas).mass, 100.0, 15.0) << "the part inside of a line that goes on";
  EXPECT_THROW(canvas.text({5.0, 20.0}, "5 \xc2\xb5m", kBlack), CheckFailure);
  EXPECT_THROW(Canvas(0, 40), CheckFailure);
  EXPECT_THROW(Canvas(4097, 40), CheckFailure);
}

}  // namespace
}  // namespace colony
