#include "engine/analysis/morphology.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/controls.hpp"
#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

Error wrong(ErrorCode code, const std::string& message) { return {code, "image: " + message, {{"image", message}}}; }

/// The columns of one label in one row, from the first to the last.
struct RowExtent {
  std::int32_t row = 0, first = 0, end = 0;
};

struct Sums {
  std::uint64_t count = 0;
  std::int64_t x = 0, y = 0;
  std::int64_t xx = 0, xy = 0, yy = 0;  // at most 4e8 x 4e8: fits
  std::uint64_t across = 0, along = 0, diagonal = 0;
  std::vector<RowExtent> extents;
  bool at_frame = false;
};

/// Everything that a shape is made of, one pass. `index` is a label's place, counted from 1; 0 is background.
class Collector {
 public:
  explicit Collector(const std::vector<LabelArea>& areas) : areas_(areas), sums_(areas.size() + 1) {}

  /// False when there are too many runs.
  bool collect(const LabelImage& labels, StopFlag stop) {
    const std::int64_t width = labels.width_px, height = labels.height_px;
    // Two rows with a margin of background on every side, so that the frame's edge is a border like any other.
    std::vector<std::uint32_t> above(static_cast<std::size_t>(width) + 2, 0), here = above;
    for (std::int64_t row = 0; row <= height; ++row) {
      throw_if_stopped(stop);
      std::fill(here.begin(), here.end(), 0);
      if (row < height && !add_runs(labels, row, here)) return false;
      for (std::size_t i = 1; i < here.size(); ++i) {
        change(here[i], above[i], &Sums::along);
        change(here[i], here[i - 1], &Sums::across);
        change(here[i], above[i - 1], &Sums::diagonal);
        change(here[i - 1], above[i], &Sums::diagonal);
      }
      std::swap(above, here);
    }
    return true;
  }

  Shape shape(std::size_t i) const {
    const Sums& sums = sums_[i + 1];
    Shape shape;
    shape.label = areas_[i].label;
    shape.area_px = sums.count;
    shape.at_frame = sums.at_frame;
    shape.is_measured = shape.area_px >= kShapePxMin;
    const auto n = static_cast<double>(sums.count);
    const double mean_x = static_cast<double>(sums.x) / n, mean_y = static_cast<double>(sums.y) / n;
    shape.centre_x_px = mean_x + 0.5;
    shape.centre_y_px = mean_y + 0.5;
    shape.perimeter_px = maths::kPi / 8.0 *
                         (static_cast<double>(sums.across + sums.along) + static_cast<double>(sums.diagonal) / std::sqrt(2.0));
    shape.circularity = 4.0 * maths::kPi * n / (shape.perimeter_px * shape.perimeter_px);
    const double xx = static_cast<double>(sums.xx) / n - mean_x * mean_x + 1.0 / 12.0;
    const double yy = static_cast<double>(sums.yy) / n - mean_y * mean_y + 1.0 / 12.0;
    const double xy = static_cast<double>(sums.xy) / n - mean_x * mean_y;
    const double spread = std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy);
    shape.eccentricity = std::sqrt(std::clamp(2.0 * spread / (xx + yy + spread), 0.0, 1.0));
    add_hull(sums.extents, shape);
    return shape;
  }

 private:
  void change(std::uint32_t a, std::uint32_t b, std::uint64_t Sums::*counter) {
    if (a == b) return;
    if (a != 0) ++(sums_[a].*counter);
    if (b != 0) ++(sums_[b].*counter);
  }

  bool add_runs(const LabelImage& labels, std::int64_t row, std::vector<std::uint32_t>& indices) {
    const std::uint32_t* pixels = labels.row(row);
    for (std::int64_t column = 0; column < labels.width_px;) {
      const std::uint32_t label = pixels[column];
      const std::int64_t first = column;
      while (column < labels.width_px && pixels[column] == label) ++column;
      if (label == 0) continue;
      if (++run_count_ > kRunsMax) return false;
      const auto found = std::lower_bound(areas_.begin(), areas_.end(), label,
                                          [](const LabelArea& area, std::uint32_t value) { return area.label < value; });
      const auto index = static_cast<std::uint32_t>(found - areas_.begin() + 1);
      std::fill(indices.begin() + first + 1, indices.begin() + column + 1, index);
      Sums& sums = sums_[index];
      const std::int64_t n = column - first;
      // Sums of first..column-1 and of their squares.
      const std::int64_t x = n * (first + column - 1) / 2;
      const auto squares = [](std::int64_t k) { return (k - 1) * k * (2 * k - 1) / 6; };
      sums.count += static_cast<std::uint64_t>(n);
      sums.x += x;
      sums.y += n * row;
      sums.xx += squares(column) - squares(first);
      sums.xy += x * row;
      sums.yy += n * row * row;
      sums.at_frame |= row == 0 || row == labels.height_px - 1 || first == 0 || column == labels.width_px;
      const auto row32 = static_cast<std::int32_t>(row);
      if (sums.extents.empty() || sums.extents.back().row != row32) {
        sums.extents.push_back({row32, static_cast<std::int32_t>(first), static_cast<std::int32_t>(column)});
      } else {
        sums.extents.back().end = static_cast<std::int32_t>(column);
      }
    }
    return true;
  }

  static void add_hull(const std::vector<RowExtent>& extents, Shape& shape) {
    std::vector<cv::Point> corners, hull;
    corners.reserve(4 * extents.size());
    for (const RowExtent& extent : extents) {
      for (const int below : {0, 1}) {
        corners.emplace_back(extent.first, extent.row + below);
        corners.emplace_back(extent.end, extent.row + below);
      }
    }
    cv::convexHull(corners, hull);
    // Of integer corners twice the area is an integer; in 64 bits, since 20,000^2 exceeds 32 and OpenCV's sum is in single steps of it.
    std::int64_t twice = 0;
    double length = 0.0;
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const cv::Point& a = hull[i];
      const cv::Point& b = hull[(i + 1) % hull.size()];
      twice += static_cast<std::int64_t>(a.x) * b.y - static_cast<std::int64_t>(b.x) * a.y;
      const double dx = b.x - a.x, dy = b.y - a.y;
      length += std::sqrt(dx * dx + dy * dy);
    }
    shape.hull_area_px = static_cast<double>(twice < 0 ? -twice : twice) / 2.0;
    shape.hull_perimeter_px = length;
    shape.solidity = static_cast<double>(shape.area_px) / shape.hull_area_px;
  }

  const std::vector<LabelArea>& areas_;
  std::vector<Sums> sums_;
  std::size_t run_count_ = 0;
};

LabelImage labels_of(const BinaryImage& image, std::uint8_t wanted) {
  LabelImage labels;
  labels.width_px = image.width_px;
  labels.height_px = image.height_px;
  labels.um_per_px = image.um_per_px;
  labels.values.resize(image.values.size());
  for (std::size_t i = 0; i < labels.values.size(); ++i) labels.values[i] = image.values[i] == wanted ? 1 : 0;
  return labels;
}

/// Numbers the connected parts of what is not 0, in place, 1, 2, ...; returns how many.
std::uint32_t number_parts(BinaryImage& mask, int connectivity, LabelImage& parts) {
  const cv::Mat pixels(static_cast<int>(mask.height_px), static_cast<int>(mask.width_px), CV_8UC1, mask.values.data());
  cv::Mat numbers;
  const int count = cv::connectedComponents(pixels, numbers, connectivity, CV_32S);
  parts.width_px = mask.width_px;
  parts.height_px = mask.height_px;
  parts.values.resize(mask.values.size());
  for (std::int64_t row = 0; row < mask.height_px; ++row) {
    const int* from = numbers.ptr<int>(static_cast<int>(row));
    for (std::int64_t column = 0; column < mask.width_px; ++column) {
      parts.at(row, column) = static_cast<std::uint32_t>(from[column]);
    }
  }
  return static_cast<std::uint32_t>(count - 1);
}

/// Deviations of the outline's pixels from their mean distance to the centre.
void add_roughness(const LabelImage& piece, std::uint32_t number, ColonyShape& colony) {
  double count = 0.0, sum = 0.0, squares = 0.0;
  for (std::int64_t row = 0; row < piece.height_px; ++row) {
    for (std::int64_t column = 0; column < piece.width_px; ++column) {
      if (piece.at(row, column) != number) continue;
      // As in contour.hpp: the frame's edge is no outline.
      if (piece.at_or(row - 1, column, number) == number && piece.at_or(row + 1, column, number) == number &&
          piece.at_or(row, column - 1, number) == number && piece.at_or(row, column + 1, number) == number) {
        continue;
      }
      const double dx = static_cast<double>(column) + 0.5 - colony.shape.centre_x_px;
      const double dy = static_cast<double>(row) + 0.5 - colony.shape.centre_y_px;
      const double squared = dx * dx + dy * dy;
      count += 1.0;
      sum += std::sqrt(squared);
      squares += squared;
    }
  }
  if (count == 0.0) return;
  colony.radius_mean_px = sum / count;
  colony.radius_rms_px = std::sqrt(std::max(0.0, squares / count - colony.radius_mean_px * colony.radius_mean_px));
  if (colony.radius_mean_px > 0.0) colony.roughness = colony.radius_rms_px / colony.radius_mean_px;
}

}  // namespace

Result<std::vector<Shape>> cell_shapes(const LabelImage& labels, StopFlag stop) {
  if (const Status status = check_image(labels, "image"); !status) return status.error();
  const std::vector<LabelArea> areas = label_areas(labels);
  if (areas.empty()) return wrong(ErrorCode::kInvalid, "has no labels: there is nothing to measure");
  if (areas.size() > kLabelsMax) return wrong(ErrorCode::kLimit, "more than " + std::to_string(kLabelsMax) + " labels");
  Collector collector(areas);
  if (!collector.collect(labels, stop)) {
    return wrong(ErrorCode::kLimit, "the labels are in more than " + std::to_string(kRunsMax) + " runs: this is no picture of cells");
  }
  std::vector<Shape> shapes;
  shapes.reserve(areas.size());
  for (std::size_t i = 0; i < areas.size(); ++i) shapes.push_back(collector.shape(i));
  return shapes;
}

Result<ColonyShape> colony_shape(const LabelImage& labels, std::int64_t gap_px, StopFlag stop) {
  Result<BinaryImage> outside = outside_of(labels, gap_px);
  if (!outside) return outside.error();
  throw_if_stopped(stop);
  ColonyShape colony;
  BinaryImage holes = foreground_of(labels);
  for (const std::uint8_t value : holes.values) colony.covered_px += value != 0 ? 1 : 0;
  if (colony.covered_px == 0) return wrong(ErrorCode::kInvalid, "has no labels: there is nothing to measure");
  LabelImage parts;
  // Closed gaps between touching cells are neither holes nor open.
  for (std::size_t i = 0; i < holes.values.size(); ++i) {
    holes.values[i] = holes.values[i] == 0 && outside->values[i] == 0 ? 1 : 0;
    colony.hole_px += holes.values[i];
  }
  colony.hole_count = number_parts(holes, 4, parts);
  const Result<std::vector<Shape>> all = cell_shapes(labels_of(*outside, 0), stop);
  if (!all) return all.error();
  colony.hull_area_px = all->front().hull_area_px;
  colony.open_share = 1.0 - static_cast<double>(colony.covered_px) / colony.hull_area_px;
  for (std::uint8_t& value : outside->values) value = value == 0 ? 1 : 0;
  colony.piece_count = number_parts(*outside, 8, parts);
  // More pieces than labels are allowed are dust; the largest counts, and of equal ones the first.
  const std::vector<LabelArea> areas = label_areas(parts);
  const auto largest = std::max_element(areas.begin(), areas.end(), [](const LabelArea& a, const LabelArea& b) {
    return a.area_px < b.area_px;
  });
  const std::uint32_t number = largest->label;
  for (std::uint32_t& value : parts.values) value = value == number ? number : 0;
  const Result<std::vector<Shape>> piece = cell_shapes(parts, stop);
  if (!piece) return piece.error();
  colony.shape = piece->front();
  colony.excess_perimeter = colony.shape.perimeter_px / colony.shape.hull_perimeter_px - 1.0;
  add_roughness(parts, number, colony);
  return colony;
}

}  // namespace colony
