#include "engine/analysis/scaling.hpp"

#include <algorithm>
#include <cmath>

#include "engine/analysis/parallel.hpp"
#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

Error wrong(ErrorCode code, const std::string& field, const std::string& message) {
  return {code, field + ": " + message, {{field, message}}};
}

/// y is ln N or I: what falls with the dimension as its slope.
Dimension dimension_of(const std::vector<double>& log_side, const std::vector<double>& y) {
  const LineFit fit = fit_line(log_side, y);
  Dimension dimension{-fit.slope, fit.slope_se, fit.r2, {}};
  for (std::size_t i = 1; i < y.size(); ++i) {
    dimension.local.push_back({maths::exp((log_side[i] + log_side[i - 1]) / 2.0),
                               -(y[i] - y[i - 1]) / (log_side[i] - log_side[i - 1])});
  }
  return dimension;
}

Crossover crossover_of(const std::vector<double>& log_side, const std::vector<double>& log_count) {
  Crossover crossover;
  if (log_side.size() < 5) return crossover;  // no degrees of freedom worth a test
  const ParabolaFit parabola = fit_parabola(log_side, log_count);
  const double range = log_side.back() - log_side.front();
  crossover.drift = -2.0 * parabola.curvature * range;
  crossover.drift_se = 2.0 * parabola.curvature_se * range;
  // Counts are integers of at least 1: what is below 1e-9 is rounding, of a line as of a parabola.
  constexpr double kRounding = 1e-9;
  crossover.t = std::abs(crossover.drift) / std::max(crossover.drift_se, kRounding);
  crossover.t_critical = student_t_two_sided(kCrossoverAlpha, log_side.size() - 3);
  crossover.found = std::abs(crossover.drift) > kDriftMax && crossover.t > crossover.t_critical;
  return crossover;
}

template <class T>
std::uint64_t foreground_px(const ImageOf<T>& image) {
  std::uint64_t count = 0;
  for (const T value : image.values) count += value != 0 ? 1 : 0;
  return count;
}

template <class T>
Result<BoxDimensions> dimensions_of(const ImageOf<T>& image, const BoxOptions& options, StopFlag stop) {
  if (const Status status = check_image(image, "image"); !status) return status.error();
  if (const Status status = check_box_options(options); !status) return status.error();
  const std::uint64_t foreground = foreground_px(image);
  if (foreground == 0) return wrong(ErrorCode::kInvalid, "image", "has no foreground: there is nothing to count");
  BoxGrid grid;
  grid.offsets_per_axis = options.offsets_per_axis;
  if (!options.sides_px.empty()) {
    grid.part = options.part.width == 0 ? PixelBox{0, 0, image.width_px, image.height_px} : options.part;
    grid.sides_px = options.sides_px;
  } else {
    if (foreground == image.values.size()) {
      return wrong(ErrorCode::kInvalid, "image", "is nothing but foreground: there is no structure to measure");
    }
    grid.part = foreground_box(image);
    grid.sides_px = geometric_sides(grid.part.longer_side(), options);
    if (grid.sides_px.size() < kSidesMin) {
      return wrong(ErrorCode::kInvalid, "image",
                   "the foreground is " + std::to_string(grid.part.width) + " x " + std::to_string(grid.part.height) +
                       " pixels, which leaves " + std::to_string(grid.sides_px.size()) +
                       " box sides between the smallest and the largest; at least " + std::to_string(kSidesMin) +
                       " are needed");
    }
  }
  Result<std::vector<BoxCount>> counts = count_boxes(image, grid, options.threads, stop);
  if (!counts) return counts.error();
  BoxDimensions result = fit_dimensions(std::move(*counts));
  result.part = grid.part;
  result.foreground_px = foreground;
  return result;
}

}  // namespace

Status check_box_options(const BoxOptions& options) {
  // Each written so that NaN is refused.
  if (!(options.side_min_px >= 1.0 && options.side_min_px <= 100.0)) {
    return wrong(ErrorCode::kInvalid, "side_min_px", "must lie in 1..100");
  }
  if (!(options.side_ratio >= 1.05 && options.side_ratio <= 4.0)) {
    return wrong(ErrorCode::kInvalid, "side_ratio", "must lie in 1.05..4");
  }
  if (!(options.extent_share >= 0.01 && options.extent_share <= 0.5)) {
    return wrong(ErrorCode::kInvalid, "extent_share", "must lie in 0.01..0.5");
  }
  if (options.offsets_per_axis < 1 || options.offsets_per_axis > kBoxOffsetsPerAxisMax) {
    return wrong(ErrorCode::kInvalid, "offsets_per_axis", "must lie in 1..32");
  }
  if (options.threads < 1 || options.threads > kAnalysisThreadsMax) {
    return wrong(ErrorCode::kInvalid, "threads", "must lie in 1..256");
  }
  if (!options.sides_px.empty()) {
    if (options.sides_px.size() < 3) return wrong(ErrorCode::kInvalid, "sides_px", "at least 3 are needed for a line");
    for (std::size_t i = 1; i < options.sides_px.size(); ++i) {
      if (options.sides_px[i] <= options.sides_px[i - 1]) return wrong(ErrorCode::kInvalid, "sides_px", "must rise");
    }
  }
  return Ok{};
}

std::vector<std::int64_t> geometric_sides(std::int64_t extent_px, const BoxOptions& options) {
  const double largest = static_cast<double>(extent_px) * options.extent_share;
  std::vector<std::int64_t> sides;
  for (double side = options.side_min_px; side <= largest && sides.size() < kBoxSidesMax; side *= options.side_ratio) {
    const auto rounded = static_cast<std::int64_t>(side + 0.5);
    if (sides.empty() || sides.back() != rounded) sides.push_back(rounded);
  }
  return sides;
}

BoxDimensions fit_dimensions(std::vector<BoxCount> counts) {
  CHECK(counts.size() >= 3);
  std::vector<double> log_side, log_mean, log_min, information;
  for (const BoxCount& count : counts) {
    CHECK(count.count_min >= 1);
    log_side.push_back(maths::log(static_cast<double>(count.side_px)));
    log_mean.push_back(maths::log(count.count_mean));
    log_min.push_back(maths::log(static_cast<double>(count.count_min)));
    information.push_back(count.information_mean);
  }
  BoxDimensions result;
  result.side_min_px = counts.front().side_px;
  result.side_max_px = counts.back().side_px;
  result.capacity = dimension_of(log_side, log_mean);
  result.smallest_cover = dimension_of(log_side, log_min);
  result.information = dimension_of(log_side, information);
  result.crossover = crossover_of(log_side, log_mean);
  result.counts = std::move(counts);
  return result;
}

Result<BoxDimensions> box_dimensions(const BinaryImage& image, const BoxOptions& options, StopFlag stop) {
  return dimensions_of(image, options, stop);
}

Result<BoxDimensions> box_dimensions(const ImageOf<std::uint32_t>& mass, const BoxOptions& options, StopFlag stop) {
  return dimensions_of(mass, options, stop);
}

}  // namespace colony
