#include "engine/analysis/filters.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/analysis/opencv.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr std::int64_t kOpeningSide_px = 64;  // of the square, after averaging blocks
constexpr double kClaheClip = 2.0;
constexpr int kClaheTiles = 8;

GreyImage like(const GreyImage& image) { return GreyImage(image.width_px, image.height_px, image.um_per_px); }

template <class Value>
GreyImage mapped(const GreyImage& image, Value&& value) {
  std::array<std::uint8_t, 256> table{};
  for (int v = 0; v < 256; ++v) table[static_cast<std::size_t>(v)] = static_cast<std::uint8_t>(value(v));
  GreyImage result = like(image);
  for (std::size_t i = 0; i < image.values.size(); ++i) result.values[i] = table[image.values[i]];
  return result;
}

cv::Mat square(std::int64_t side_px) {
  return cv::getStructuringElement(cv::MORPH_RECT, cv::Size(static_cast<int>(side_px), static_cast<int>(side_px)));
}
/// Own rows of a disc: OpenCV's ellipse is not symmetric for every size.
cv::Mat disc(std::int64_t radius_px) {
  const int side = static_cast<int>(2 * radius_px + 1);
  cv::Mat kernel(side, side, CV_8UC1, cv::Scalar(0));
  for (std::int64_t y = -radius_px; y <= radius_px; ++y) {
    for (std::int64_t x = -radius_px; x <= radius_px; ++x) {
      if (x * x + y * y <= radius_px * radius_px + radius_px) {
        kernel.at<std::uint8_t>(static_cast<int>(y + radius_px), static_cast<int>(x + radius_px)) = 1;
      }
    }
  }
  return kernel;
}

/// Means of blocks of side x side; the last ones of what is left.
GreyImage shrunk(const GreyImage& image, std::int64_t side) {
  GreyImage result((image.width_px + side - 1) / side, (image.height_px + side - 1) / side);
  for (std::int64_t row = 0; row < result.height_px; ++row) {
    for (std::int64_t column = 0; column < result.width_px; ++column) {
      const std::int64_t bottom = std::min((row + 1) * side, image.height_px),
                         right = std::min((column + 1) * side, image.width_px);
      std::int64_t sum = 0;
      for (std::int64_t y = row * side; y < bottom; ++y) {
        for (std::int64_t x = column * side; x < right; ++x) sum += image.at(y, x);
      }
      const std::int64_t count = (bottom - row * side) * (right - column * side);
      result.at(row, column) = static_cast<std::uint8_t>((sum + count / 2) / count);
    }
  }
  return result;
}

/// Linear interpolation between the centres of blocks, in 1/(2 side) of a block.
GreyImage spread(const GreyImage& small, const GreyImage& shape, std::int64_t side) {
  GreyImage result = like(shape);
  const auto place = [side](std::int64_t pixel, std::int64_t count) {
    const std::int64_t at = std::clamp<std::int64_t>(2 * pixel + 1 - side, 0, 2 * side * (count - 1));
    const std::int64_t first = std::min(at / (2 * side), std::max<std::int64_t>(count - 2, 0));
    return std::array<std::int64_t, 3>{first, std::min(first + 1, count - 1), at - 2 * side * first};
  };
  const std::int64_t unit = 2 * side;
  for (std::int64_t y = 0; y < shape.height_px; ++y) {
    const auto [top, bottom, down] = place(y, small.height_px);
    for (std::int64_t x = 0; x < shape.width_px; ++x) {
      const auto [left, right, across] = place(x, small.width_px);
      const std::int64_t upper = small.at(top, left) * (unit - across) + small.at(top, right) * across;
      const std::int64_t lower = small.at(bottom, left) * (unit - across) + small.at(bottom, right) * across;
      result.at(y, x) =
          static_cast<std::uint8_t>((upper * (unit - down) + lower * down + unit * unit / 2) / (unit * unit));
    }
  }
  return result;
}

std::int64_t mirrored(std::int64_t at, std::int64_t count) {
  if (at < 0) at = -at - 1;
  if (at >= count) at = 2 * count - 1 - at;
  return std::clamp<std::int64_t>(at, 0, count - 1);
}

std::int64_t floor_sqrt(std::int64_t value) {
  auto root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(value)));
  while (root * root > value) --root;
  while ((root + 1) * (root + 1) <= value) ++root;
  return root;
}

}  // namespace

void settle_opencv() {
  static std::once_flag once;
  std::call_once(once, [] {
    cv::setNumThreads(1);
    cv::setUseOptimized(false);
  });
}

std::array<std::int64_t, 256> histogram(const GreyImage& image) {
  std::array<std::int64_t, 256> counts{};
  for (const std::uint8_t value : image.values) ++counts[value];
  return counts;
}

GreyImage inverted(const GreyImage& image) {
  return mapped(image, [](int v) { return 255 - v; });
}

GreyImage square_root(const GreyImage& image) {
  // The nearest integer to sqrt(255 v) is floor((sqrt(4 * 255 v) + 1) / 2).
  return mapped(image, [](int v) { return (floor_sqrt(std::int64_t{4 * 255} * v) + 1) / 2; });
}

GreyImage background(const GreyImage& image, std::int64_t reach_px) {
  CHECK(reach_px >= 1);
  settle_opencv();
  const std::int64_t block = (reach_px + kOpeningSide_px - 1) / kOpeningSide_px;
  GreyImage small = block == 1 ? image : shrunk(image, block);
  const std::int64_t side = (reach_px / block) | 1;
  cv::Mat matrix = view(small);
  cv::morphologyEx(matrix, matrix, cv::MORPH_OPEN, square(side));
  cv::blur(matrix, matrix, cv::Size(static_cast<int>(side), static_cast<int>(side)));
  return block == 1 ? small : spread(small, image, block);
}

GreyImage subtracted(const GreyImage& image, const GreyImage& background) {
  CHECK(image.values.size() == background.values.size());
  GreyImage result = like(image);
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    result.values[i] = static_cast<std::uint8_t>(std::max(0, image.values[i] - background.values[i]));
  }
  return result;
}

GreyImage clahe(const GreyImage& image) {
  settle_opencv();
  GreyImage result = like(image);
  cv::Mat to = view(result);
  cv::createCLAHE(kClaheClip, cv::Size(kClaheTiles, kClaheTiles))->apply(view(image), to);
  return result;
}

GreyImage smoothed(const GreyImage& image) {
  GreyImage result = like(image);
  for (std::int64_t y = 0; y < image.height_px; ++y) {
    const std::uint8_t* rows[] = {image.row(mirrored(y - 1, image.height_px)), image.row(y),
                                  image.row(mirrored(y + 1, image.height_px))};
    for (std::int64_t x = 0; x < image.width_px; ++x) {
      const std::int64_t left = mirrored(x - 1, image.width_px), right = mirrored(x + 1, image.width_px);
      int sum = 8;
      for (int row = 0; row < 3; ++row) {
        sum += (row == 1 ? 2 : 1) * (rows[row][left] + 2 * rows[row][x] + rows[row][right]);
      }
      result.at(y, x) = static_cast<std::uint8_t>(sum / 16);
    }
  }
  return result;
}

GreyImage local_deviation(const GreyImage& image, std::int64_t radius_px) {
  CHECK(radius_px >= 1 && radius_px <= kWindowRadiusMax_px);
  // Sixteenths of a grey level: below that a window of 8-bit values says nothing.
  std::array<std::uint8_t, 16 * 128 + 1> scale{};
  for (std::size_t i = 0; i < scale.size(); ++i) {
    const double share = maths::log(1.0 + static_cast<double>(i) / 16.0) / maths::log(128.5);
    scale[i] = static_cast<std::uint8_t>(std::min(255.0, 255.0 * share + 0.5));
  }
  GreyImage result = like(image);
  const auto width = static_cast<std::size_t>(image.width_px);
  std::vector<std::int64_t> sums(width, 0), squares(width, 0);  // of the window's rows, column by column
  const auto add_row = [&](std::int64_t y, std::int64_t sign) {
    const std::uint8_t* row = image.row(mirrored(y, image.height_px));
    for (std::size_t x = 0; x < width; ++x) {
      sums[x] += sign * row[x];
      squares[x] += sign * row[x] * row[x];
    }
  };
  const std::int64_t count = (2 * radius_px + 1) * (2 * radius_px + 1);
  for (std::int64_t y = -radius_px; y < radius_px; ++y) add_row(y, 1);
  for (std::int64_t y = 0; y < image.height_px; ++y) {
    add_row(y + radius_px, 1);
    if (y > 0) add_row(y - radius_px - 1, -1);
    std::int64_t sum = 0, square_sum = 0;
    const auto add_column = [&](std::int64_t x, std::int64_t sign) {
      const auto at = static_cast<std::size_t>(mirrored(x, image.width_px));
      sum += sign * sums[at];
      square_sum += sign * squares[at];
    };
    for (std::int64_t x = -radius_px; x < radius_px; ++x) add_column(x, 1);
    for (std::int64_t x = 0; x < image.width_px; ++x) {
      add_column(x + radius_px, 1);
      if (x > 0) add_column(x - radius_px - 1, -1);
      // n^2 times the variance, below 2^53 for every radius allowed.
      const std::int64_t deviation = floor_sqrt(256 * (count * square_sum - sum * sum)) / count;
      result.at(y, x) = scale[static_cast<std::size_t>(std::min<std::int64_t>(deviation, 16 * 128))];
    }
  }
  return result;
}

int otsu(const GreyImage& image, int from) {
  const auto counts = histogram(image);
  std::int64_t total = 0, moment = 0;
  for (int v = from; v < 256; ++v) {
    total += counts[static_cast<std::size_t>(v)];
    moment += v * counts[static_cast<std::size_t>(v)];
  }
  // Variance between the classes, times total^2: (moment w - m total)^2 / (w (total - w)). Doubles: one rounding order, the same everywhere.
  double best = 0.0;
  int first = -1, last = -1;
  std::int64_t weight = 0, below = 0;
  for (int v = from; v < 255; ++v) {
    weight += counts[static_cast<std::size_t>(v)];
    below += v * counts[static_cast<std::size_t>(v)];
    if (weight == 0 || weight == total) continue;
    const double difference = static_cast<double>(moment) * static_cast<double>(weight) -
                              static_cast<double>(below) * static_cast<double>(total);
    const double between =
        difference / static_cast<double>(weight) * (difference / static_cast<double>(total - weight));
    if (between > best) {
      best = between;
      first = last = v;
    } else if (between == best) {
      last = v;
    }
  }
  return first < 0 ? -1 : (first + last) / 2;
}

BinaryImage above(const GreyImage& image, int level) {
  return mapped(image, [level](int v) { return v > level ? 255 : 0; });
}

BinaryImage eroded(const BinaryImage& mask, std::int64_t radius_px) {
  settle_opencv();
  BinaryImage result = like(mask);
  cv::Mat to = view(result);
  cv::erode(view(mask), to, disc(radius_px));
  return result;
}

BinaryImage opened(const BinaryImage& mask, std::int64_t radius_px) {
  settle_opencv();
  BinaryImage result = like(mask);
  cv::Mat to = view(result);
  cv::morphologyEx(view(mask), to, cv::MORPH_OPEN, disc(radius_px));
  return result;
}

namespace {

Pieces pieces_connected(const BinaryImage& mask, int connectivity) {
  settle_opencv();
  Pieces result;
  result.labels = LabelImage(mask.width_px, mask.height_px, mask.um_per_px);
  cv::Mat labels(static_cast<int>(mask.height_px), static_cast<int>(mask.width_px), CV_32SC1,
                 result.labels.values.data());
  cv::Mat stats, centroids;
  const int count =
      cv::connectedComponentsWithStats(view(mask), labels, stats, centroids, connectivity, CV_32S, cv::CCL_SAUF);
  CHECK(reinterpret_cast<std::uint32_t*>(labels.data) == result.labels.values.data());
  for (int i = 1; i < count; ++i) {
    Piece piece;
    piece.area_px = stats.at<int>(i, cv::CC_STAT_AREA);
    piece.left = stats.at<int>(i, cv::CC_STAT_LEFT);
    piece.top = stats.at<int>(i, cv::CC_STAT_TOP);
    piece.width = stats.at<int>(i, cv::CC_STAT_WIDTH);
    piece.height = stats.at<int>(i, cv::CC_STAT_HEIGHT);
    piece.touches_frame = piece.left == 0 || piece.top == 0 || piece.left + piece.width == mask.width_px ||
                          piece.top + piece.height == mask.height_px;
    result.pieces.push_back(piece);
  }
  return result;
}

}  // namespace

Pieces pieces_of(const BinaryImage& mask) { return pieces_connected(mask, 8); }

BinaryImage holes_filled(const BinaryImage& mask, std::int64_t hole_max_px) {
  const Pieces outside = pieces_connected(mapped(mask, [](int v) { return v == 0 ? 255 : 0; }), 4);
  BinaryImage result = mask;
  for (std::size_t i = 0; i < result.values.size(); ++i) {
    const std::uint32_t label = outside.labels.values[i];
    if (label == 0) continue;
    const Piece& piece = outside.pieces[label - 1];
    if (!piece.touches_frame && piece.area_px <= hole_max_px) result.values[i] = 255;
  }
  return result;
}

Grey16Image distance_inside(const BinaryImage& mask) {
  settle_opencv();
  cv::Mat distance;
  cv::distanceTransform(view(mask), distance, cv::DIST_L2, cv::DIST_MASK_5, CV_32F);
  Grey16Image result(mask.width_px, mask.height_px, mask.um_per_px);
  for (std::int64_t y = 0; y < mask.height_px; ++y) {
    const float* row = distance.ptr<float>(static_cast<int>(y));
    for (std::int64_t x = 0; x < mask.width_px; ++x) {
      // A mask without background has no nearest one: OpenCV gives a huge number.
      result.at(y, x) = static_cast<std::uint16_t>(std::min(16.0F * row[x] + 0.5F, 65535.0F));
    }
  }
  return result;
}

}  // namespace colony
