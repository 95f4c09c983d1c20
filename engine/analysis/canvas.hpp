// canvas: a drawing for print: smooth lines, marks and texts on white, for figures.
// Method:  drawn at twice the size with OpenCV's lines and Hershey letters, then averaged two by two: even strokes at every angle.
// Units:   pixels of the result; x to the right, y down.      Texts are ASCII: the letters have no others.
// Errors:  CHECKs sides of 1..4,096 and ASCII: what is drawn is our own. What lies outside is not drawn.
// Promise: the same bytes on any x86-64 CPU for one build of OpenCV (opencv.hpp).
// Threads: a canvas is one thread's.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/analysis/segment.hpp"

namespace colony {

struct Ink {
  std::uint8_t red = 0, green = 0, blue = 0;
};
struct CanvasPoint {
  double x = 0.0, y = 0.0;
};
enum class Align { kLeft, kCentre, kRight };
/// Where a text stands, letters below the base line included.
struct TextBox {
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;
  std::string text;
};

class Canvas {
 public:
  Canvas(std::int64_t width_px, std::int64_t height_px);
  void line(CanvasPoint from, CanvasPoint to, Ink ink, double width_px = 1.0);
  void lines(const std::vector<CanvasPoint>& points, Ink ink, double width_px = 1.0);
  void box(CanvasPoint corner, double width_px, double height_px, Ink ink, bool is_filled);
  void dot(CanvasPoint centre, double radius_px, Ink ink, bool is_filled);
  /// `at`: on the base line, left end, middle or right end.
  void text(CanvasPoint at, std::string_view ascii, Ink ink, Align align = Align::kLeft, double height_px = 14.0);
  /// One pixel of the result, `share` of the way from what is there to `ink`.
  void shade(std::int64_t row, std::int64_t column, Ink ink, double share);
  /// All texts so far: a layout can be held to letting none run into another.
  const std::vector<TextBox>& texts() const { return texts_; }
  /// RGB, `name` and `text` empty.
  StepImage picture() const;

 private:
  std::int64_t width_px_, height_px_;
  std::vector<std::uint8_t> twice_;  // RGB at twice the sides
  std::vector<TextBox> texts_;
};

}  // namespace colony
