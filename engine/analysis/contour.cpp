#include "engine/analysis/contour.hpp"

#include <opencv2/imgproc.hpp>

namespace colony {
namespace {

constexpr std::uint8_t kSet = 255;
constexpr std::uint8_t kOutside = 255;
constexpr std::uint8_t kInside = 1;      // foreground while the background is flooded
constexpr std::int64_t kGapMax_px = 8;

/// Foreground is kInside on entry, background 0; what the flood from the frame's edge reaches becomes 255, the rest 0.
void flood_from_edge(BinaryImage& image) {
  const auto width = static_cast<int>(image.width_px), height = static_cast<int>(image.height_px);
  cv::Mat pixels(height, width, CV_8UC1, image.values.data());
  const auto flood = [&](int row, int column) {
    if (image.at(row, column) == 0) cv::floodFill(pixels, cv::Point(column, row), cv::Scalar(kOutside), nullptr, 0, 0, 4);
  };
  for (int column = 0; column < width; ++column) {
    flood(0, column);
    flood(height - 1, column);
  }
  for (int row = 0; row < height; ++row) {
    flood(row, 0);
    flood(row, width - 1);
  }
  for (std::uint8_t& value : image.values) value = value == kOutside ? kOutside : 0;
}

/// Marks the background between pixel `from` and pixel `to` of one row or column, if it is short and joins two different labels.
void close_gaps(const LabelImage& labels, std::int64_t gap_px, BinaryImage& mask) {
  const auto scan = [&](std::int64_t count, const auto& index) {
    std::int64_t last = -1;
    for (std::int64_t i = 0; i < count; ++i) {
      const std::uint32_t label = labels.values[index(i)];
      if (label == 0) continue;
      if (last >= 0 && i - last - 1 <= gap_px && label != labels.values[index(last)]) {
        for (std::int64_t k = last + 1; k < i; ++k) mask.values[index(k)] = kInside;
      }
      last = i;
    }
  };
  for (std::int64_t row = 0; row < labels.height_px; ++row) {
    scan(labels.width_px, [&](std::int64_t i) { return labels.index(row, i); });
  }
  for (std::int64_t column = 0; column < labels.width_px; ++column) {
    scan(labels.height_px, [&](std::int64_t i) { return labels.index(i, column); });
  }
}

/// Pixels that `inside` and have a 4-neighbour within the frame that satisfies `beyond`.
template <class Inside, class Beyond>
BinaryImage draw_border(std::int64_t width, std::int64_t height, std::optional<double> um_per_px, const Inside& inside,
                        const Beyond& beyond) {
  BinaryImage line(width, height, um_per_px);
  for (std::int64_t row = 0; row < height; ++row) {
    for (std::int64_t column = 0; column < width; ++column) {
      if (!inside(row, column)) continue;
      const bool border = (row > 0 && beyond(row, column, row - 1, column)) ||
                          (row + 1 < height && beyond(row, column, row + 1, column)) ||
                          (column > 0 && beyond(row, column, row, column - 1)) ||
                          (column + 1 < width && beyond(row, column, row, column + 1));
      if (border) line.at(row, column) = kSet;
    }
  }
  return line;
}

BinaryImage outline_from(const BinaryImage& outside) {
  return draw_border(
      outside.width_px, outside.height_px, outside.um_per_px,
      [&](std::int64_t row, std::int64_t column) { return outside.at(row, column) == 0; },
      [&](std::int64_t, std::int64_t, std::int64_t row, std::int64_t column) { return outside.at(row, column) != 0; });
}

}  // namespace

BinaryImage foreground_of(const LabelImage& labels) {
  BinaryImage mask;
  mask.width_px = labels.width_px;
  mask.height_px = labels.height_px;
  mask.um_per_px = labels.um_per_px;
  mask.values.resize(labels.values.size());
  for (std::size_t i = 0; i < labels.values.size(); ++i) mask.values[i] = labels.values[i] != 0 ? kSet : 0;
  return mask;
}

Result<BinaryImage> outside_of(const BinaryImage& image) {
  if (const Status status = check_image(image, "image"); !status) return status.error();
  BinaryImage mask = image;
  for (std::uint8_t& value : mask.values) value = value != 0 ? kInside : 0;
  flood_from_edge(mask);
  return mask;
}

Result<BinaryImage> outside_of(const LabelImage& labels, std::int64_t gap_px) {
  if (const Status status = check_image(labels, "image"); !status) return status.error();
  if (gap_px < 0 || gap_px > kGapMax_px) {
    return Error{ErrorCode::kInvalid, "gap_px: must lie in 0..8", {{"gap_px", "must lie in 0..8"}}};
  }
  BinaryImage mask = foreground_of(labels);
  for (std::uint8_t& value : mask.values) value = value != 0 ? kInside : 0;
  if (gap_px > 0) close_gaps(labels, gap_px, mask);
  flood_from_edge(mask);
  return mask;
}

Result<BinaryImage> colony_outline(const BinaryImage& image) {
  const Result<BinaryImage> outside = outside_of(image);
  if (!outside) return outside.error();
  return outline_from(*outside);
}

Result<BinaryImage> colony_outline(const LabelImage& labels, std::int64_t gap_px) {
  const Result<BinaryImage> outside = outside_of(labels, gap_px);
  if (!outside) return outside.error();
  return outline_from(*outside);
}

Result<BinaryImage> cell_walls(const LabelImage& labels) {
  if (const Status status = check_image(labels, "image"); !status) return status.error();
  return draw_border(
      labels.width_px, labels.height_px, labels.um_per_px,
      [&](std::int64_t row, std::int64_t column) { return labels.at(row, column) != 0; },
      [&](std::int64_t row, std::int64_t column, std::int64_t other_row, std::int64_t other_column) {
        return labels.at(other_row, other_column) < labels.at(row, column);
      });
}

}  // namespace colony
