#include "engine/analysis/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "engine/analysis/opencv.hpp"
#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr int kTwice = 2;
constexpr int kShift = 4;  // OpenCV's sub-pixels: sixteenths
constexpr std::int64_t kCanvasSideMax_px = 4096;

cv::Mat matrix(std::vector<std::uint8_t>& pixels, std::int64_t width_px, std::int64_t height_px) {
  return {static_cast<int>(kTwice * height_px), static_cast<int>(kTwice * width_px), CV_8UC3, pixels.data()};
}

// Far outside is as good as outside: the clamp keeps conversions defined.
double near(double at) { return std::clamp(at, -4.0 * kCanvasSideMax_px, 4.0 * kCanvasSideMax_px); }
int fixed(double at) { return static_cast<int>(near(at) * kTwice * (1 << kShift) + (at < 0.0 ? -0.5 : 0.5)); }
cv::Point point(CanvasPoint at) { return {fixed(at.x), fixed(at.y)}; }
cv::Scalar colour(Ink ink) { return {static_cast<double>(ink.red), static_cast<double>(ink.green), static_cast<double>(ink.blue)}; }

constexpr double kSmoothing_px = 0.3;  // by which OpenCV's smoothing spreads each side of a polygon
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kCapital = 21, kTallest = 26;  // heights of this font at scale 1

}  // namespace

Canvas::Canvas(std::int64_t width_px, std::int64_t height_px) : width_px_(width_px), height_px_(height_px) {
  CHECK(width_px >= 1 && height_px >= 1 && width_px <= kCanvasSideMax_px && height_px <= kCanvasSideMax_px);
  twice_.assign(static_cast<std::size_t>(3 * kTwice * kTwice * width_px * height_px), 0xff);
  settle_opencv();
}

// As a polygon of our own: OpenCV's smoothed strokes know odd widths only, and are wider than asked.
void Canvas::line(CanvasPoint from, CanvasPoint to, Ink ink, double width_px) {
  cv::Mat all = matrix(twice_, width_px_, height_px_);
  from = {near(from.x), near(from.y)};
  to = {near(to.x), near(to.y)};
  const double dx = to.x - from.x, dy = to.y - from.y, length = std::sqrt(dx * dx + dy * dy);
  if (!(length > 0.0)) return;
  const double half = std::max(0.05, width_px / 2.0 - kSmoothing_px), x = -dy / length * half, y = dx / length * half;
  const cv::Point corners[4] = {point({from.x + x, from.y + y}), point({to.x + x, to.y + y}), point({to.x - x, to.y - y}), point({from.x - x, from.y - y})};
  cv::fillConvexPoly(all, corners, 4, colour(ink), cv::LINE_AA, kShift);
}

void Canvas::lines(const std::vector<CanvasPoint>& points, Ink ink, double width_px) {
  for (std::size_t i = 1; i < points.size(); ++i) line(points[i - 1], points[i], ink, width_px);
}

void Canvas::box(CanvasPoint corner, double width_px, double height_px, Ink ink, bool is_filled) {
  if (!is_filled) {
    const double x = corner.x - 0.5, y = corner.y - 0.5;  // lines of one pixel, their middles on the sides
    box({x, y}, width_px + 1.0, 1.0, ink, true);
    box({x, y + height_px}, width_px + 1.0, 1.0, ink, true);
    box({x, y}, 1.0, height_px + 1.0, ink, true);
    box({x + width_px, y}, 1.0, height_px + 1.0, ink, true);
    return;
  }
  cv::Mat all = matrix(twice_, width_px_, height_px_);
  // OpenCV's far corner is a pixel that belongs to the rectangle.
  const cv::Point far = point({corner.x + width_px, corner.y + height_px}) - cv::Point(1 << kShift, 1 << kShift);
  cv::rectangle(all, point(corner), far, colour(ink), cv::FILLED, cv::LINE_8, kShift);
}

void Canvas::dot(CanvasPoint centre, double radius_px, Ink ink, bool is_filled) {
  cv::Mat all = matrix(twice_, width_px_, height_px_);
  // A hollow one hides what runs behind it.
  if (!is_filled) cv::circle(all, point(centre), fixed(radius_px), cv::Scalar(255, 255, 255), cv::FILLED, cv::LINE_AA, kShift);
  cv::circle(all, point(centre), fixed(radius_px), colour(ink), is_filled ? cv::FILLED : kTwice, cv::LINE_AA, kShift);
}

void Canvas::text(CanvasPoint at, std::string_view ascii, Ink ink, Align align, double height_px) {
  CHECK(std::all_of(ascii.begin(), ascii.end(), [](char c) { return c >= ' ' && c <= '~'; }));
  cv::Mat all = matrix(twice_, width_px_, height_px_);
  const double scale = height_px * kTwice / kCapital;
  const int stroke = std::max(1, static_cast<int>(height_px / 7.0 + 0.5));
  const std::string copy(ascii);
  int below = 0;
  const cv::Size size = cv::getTextSize(copy, kFont, scale, stroke, &below);
  const int back = align == Align::kLeft ? 0 : align == Align::kCentre ? size.width / 2 : size.width;
  const cv::Point base{(fixed(at.x) >> kShift) - back, fixed(at.y) >> kShift};
  cv::putText(all, copy, base, kFont, scale, colour(ink), stroke, cv::LINE_AA);
  const auto of_result = [](int twice) { return static_cast<double>(twice) / kTwice; };
  // Brackets and some letters rise above the capitals, which is what OpenCV measures.
  texts_.push_back({of_result(base.x), of_result(base.y - size.height * kTallest / kCapital), of_result(base.x + size.width), of_result(base.y + below), copy});
}

void Canvas::shade(std::int64_t row, std::int64_t column, Ink ink, double share) {
  if (row < 0 || column < 0 || row >= height_px_ || column >= width_px_) return;
  const double part = std::clamp(share, 0.0, 1.0);
  const std::uint8_t values[3] = {ink.red, ink.green, ink.blue};
  for (std::int64_t y = kTwice * row; y < kTwice * (row + 1); ++y) {
    for (std::int64_t x = kTwice * column; x < kTwice * (column + 1); ++x) {
      std::uint8_t* pixel = twice_.data() + 3 * (y * kTwice * width_px_ + x);
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(pixel[c] + part * (values[c] - pixel[c]) + 0.5);
    }
  }
}

StepImage Canvas::picture() const {
  StepImage image;
  image.width_px = width_px_;
  image.height_px = height_px_;
  image.channel_count = 3;
  image.values.resize(static_cast<std::size_t>(3 * width_px_ * height_px_));
  const std::int64_t stride = 3 * kTwice * width_px_;
  for (std::int64_t row = 0; row < height_px_; ++row) {
    for (std::int64_t at = 0; at < 3 * width_px_; ++at) {
      const std::uint8_t* pixel = twice_.data() + kTwice * row * stride + kTwice * 3 * (at / 3) + at % 3;
      image.values[static_cast<std::size_t>(3 * width_px_ * row + at)] =
          static_cast<std::uint8_t>((pixel[0] + pixel[3] + pixel[stride] + pixel[stride + 3] + 2) / 4);
    }
  }
  return image;
}

}  // namespace colony
