#include "engine/analysis/box_counting.hpp"

#include <algorithm>
#include <array>
#include <type_traits>

#include "engine/analysis/parallel.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr std::uint64_t kMassMax = std::uint64_t{1} << 53;
constexpr std::size_t kTableSize = 4096;

Error wrong(ErrorCode code, const std::string& field, const std::string& message) {
  return {code, field + ": " + message, {{field, message}}};
}

double m_log_m(std::uint64_t mass) {
  const auto m = static_cast<double>(mass);
  return mass < 2 ? 0.0 : m * maths::log(m);
}

using Table = std::array<double, kTableSize>;
Table make_table() {
  Table table{};
  for (std::size_t i = 0; i < kTableSize; ++i) table[i] = m_log_m(i);
  return table;
}

/// Of one grid.
struct GridCount {
  std::uint64_t boxes = 0;  // with any mass
  double m_log_m = 0.0;     // sum over the boxes, from left to right and top to bottom
};

struct Task {
  std::size_t side_index = 0;
  std::int64_t side = 0;
  std::int64_t row_offset = 0;
  std::vector<std::int64_t> column_offsets;
  std::vector<GridCount> counts;  // by column offset
};

std::vector<std::int64_t> offsets_of(std::int64_t side, int per_axis) {
  std::vector<std::int64_t> offsets;
  for (int i = 0; i < per_axis; ++i) {
    const std::int64_t offset = i * side / per_axis;
    if (offsets.empty() || offsets.back() != offset) offsets.push_back(offset);
  }
  return offsets;
}

/// The mass that one pixel stands for: 1 in a binary image, its value in a measure.
inline std::uint32_t mass_of(std::uint8_t value) { return value != 0 ? 1 : 0; }
inline std::uint32_t mass_of(std::uint32_t value) { return value; }

/// Adds up bands of rows, and counts the boxes of each for every column offset. `Sum` holds the mass of a whole band.
template <class Sum, class T>
void run_task(const ImageOf<T>& image, const PixelBox& part, const Table& table, Task& task) {
  const auto width = static_cast<std::size_t>(part.width);
  std::vector<Sum> columns(width);
  // prefix[i] = mass of the band's first i columns.
  std::vector<Sum> prefix(width + 1, 0);
  task.counts.assign(task.column_offsets.size(), {});
  const std::int64_t bottom = part.top + part.height;
  // The band before the offset is the part of a box that begins above.
  std::int64_t band_end = task.row_offset > 0 ? part.top + task.row_offset : part.top + task.side;
  for (std::int64_t row = part.top; row < bottom; band_end += task.side) {
    std::fill(columns.begin(), columns.end(), Sum{0});
    for (const std::int64_t end = std::min(band_end, bottom); row < end; ++row) {
      const T* pixels = image.row(row) + part.left;
      for (std::size_t i = 0; i < width; ++i) columns[i] += static_cast<Sum>(mass_of(pixels[i]));
    }
    Sum total = 0;
    for (std::size_t i = 0; i < width; ++i) prefix[i + 1] = total += columns[i];
    if (total == 0) continue;
    for (std::size_t c = 0; c < task.column_offsets.size(); ++c) {
      GridCount& count = task.counts[c];
      std::uint64_t boxes = 0;
      double sum = count.m_log_m;
      const auto add = [&](Sum mass) {
        boxes += mass != 0 ? 1 : 0;
        sum += mass < kTableSize ? table[static_cast<std::size_t>(mass)] : m_log_m(mass);
      };
      const std::size_t side = static_cast<std::size_t>(task.side);
      std::size_t left = std::min(width, static_cast<std::size_t>(task.column_offsets[c]));
      if (left > 0) add(prefix[left]);
      for (; left + side <= width; left += side) add(prefix[left + side] - prefix[left]);
      if (left < width) add(total - prefix[left]);
      count.boxes += boxes;
      count.m_log_m = sum;
    }
  }
}

template <class T>
PixelBox box_of(const ImageOf<T>& image) {
  std::int64_t left = image.width_px, right = -1, top = -1, bottom = -1;
  for (std::int64_t row = 0; row < image.height_px; ++row) {
    const T* pixels = image.row(row);
    std::int64_t first = 0;
    while (first < image.width_px && pixels[first] == 0) ++first;
    if (first == image.width_px) continue;
    std::int64_t last = image.width_px - 1;
    while (pixels[last] == 0) --last;
    left = std::min(left, first);
    right = std::max(right, last);
    if (top < 0) top = row;
    bottom = row;
  }
  if (right < 0) return {};
  return {left, top, right - left + 1, bottom - top + 1};
}

Status check_grid(const BoxGrid& grid, std::int64_t width_px, std::int64_t height_px) {
  const PixelBox& part = grid.part;
  if (part.left < 0 || part.top < 0 || part.width < 1 || part.height < 1 || part.width > width_px - part.left ||
      part.height > height_px - part.top) {
    return wrong(ErrorCode::kInvalid, "part", "has no pixels or lies outside the image");
  }
  if (grid.sides_px.empty() || grid.sides_px.size() > kBoxSidesMax) {
    return wrong(ErrorCode::kLimit, "sides_px", "between 1 and " + std::to_string(kBoxSidesMax) + " box sides");
  }
  for (const std::int64_t side : grid.sides_px) {
    if (side < 1 || side > kImageSideMax_px) {
      return wrong(ErrorCode::kInvalid, "sides_px", std::to_string(side) + " is outside 1..20000");
    }
  }
  if (grid.offsets_per_axis < 1 || grid.offsets_per_axis > kBoxOffsetsPerAxisMax) {
    return wrong(ErrorCode::kInvalid, "offsets_per_axis",
                 "between 1 and " + std::to_string(kBoxOffsetsPerAxisMax) + ", not " + std::to_string(grid.offsets_per_axis));
  }
  return Ok{};
}

template <class T>
std::uint64_t mass_in(const ImageOf<T>& image, const PixelBox& part) {
  std::uint64_t mass = 0;
  for (std::int64_t row = part.top; row < part.top + part.height; ++row) {
    const T* pixels = image.row(row) + part.left;
    for (std::int64_t i = 0; i < part.width; ++i) mass += mass_of(pixels[i]);
  }
  return mass;
}

/// What the tasks of one side found, over all offsets in the order row offset, column offset.
BoxCount combine(const std::vector<Task>& tasks, std::size_t side_index, std::uint64_t mass) {
  const auto total = static_cast<double>(mass);
  BoxCount result;
  std::uint64_t boxes = 0;
  double information = 0.0;
  for (const Task& task : tasks) {
    if (task.side_index != side_index) continue;
    result.side_px = task.side;
    for (const GridCount& grid : task.counts) {
      // -sum p ln p with p = m / M is ln M - sum m ln m / M; rounding could leave a hair below 0 where one box holds all.
      const double here = std::max(0.0, maths::log(total) - grid.m_log_m / total);
      const bool first = result.offset_count++ == 0;
      result.count_min = first ? grid.boxes : std::min(result.count_min, grid.boxes);
      result.count_max = std::max(result.count_max, grid.boxes);
      result.information_min = first ? here : std::min(result.information_min, here);
      boxes += grid.boxes;
      information += here;
    }
  }
  result.count_mean = static_cast<double>(boxes) / static_cast<double>(result.offset_count);
  result.information_mean = information / static_cast<double>(result.offset_count);
  return result;
}

template <class T>
Result<std::vector<BoxCount>> count_all(const ImageOf<T>& image, const BoxGrid& grid, int threads, StopFlag stop) {
  if (const Status shape = check_image(image, "image"); !shape) return shape.error();
  if (const Status status = check_grid(grid, image.width_px, image.height_px); !status) return status.error();
  const std::uint64_t mass = mass_in(image, grid.part);
  if (mass == 0) return wrong(ErrorCode::kInvalid, "image", "has no foreground: there is nothing to count");
  if (mass >= kMassMax) return wrong(ErrorCode::kLimit, "image", "the whole mass must be below 2^53");

  std::vector<Task> tasks;
  for (std::size_t i = 0; i < grid.sides_px.size(); ++i) {
    const std::int64_t side = grid.sides_px[i];
    const std::vector<std::int64_t> offsets = offsets_of(side, grid.offsets_per_axis);
    for (const std::int64_t row_offset : offsets) tasks.push_back({i, side, row_offset, offsets, {}});
  }
  const Table table = make_table();
  for_each_index(
      tasks.size(), threads,
      [&](std::size_t i) {
        // A band of a binary image has at most 20,000 x 20,000 pixels, which 32 bits hold; in the sums of a measure only 64 are safe.
        using Sum = std::conditional_t<std::is_same_v<T, std::uint8_t>, std::uint32_t, std::uint64_t>;
        run_task<Sum>(image, grid.part, table, tasks[i]);
      },
      stop);
  std::vector<BoxCount> counts;
  for (std::size_t i = 0; i < grid.sides_px.size(); ++i) counts.push_back(combine(tasks, i, mass));
  return counts;
}

}  // namespace

PixelBox foreground_box(const BinaryImage& image) { return box_of(image); }
PixelBox foreground_box(const ImageOf<std::uint32_t>& image) { return box_of(image); }

Result<std::vector<BoxCount>> count_boxes(const BinaryImage& image, const BoxGrid& grid, int threads, StopFlag stop) {
  return count_all(image, grid, threads, stop);
}

Result<std::vector<BoxCount>> count_boxes(const ImageOf<std::uint32_t>& mass, const BoxGrid& grid, int threads,
                                          StopFlag stop) {
  return count_all(mass, grid, threads, stop);
}

}  // namespace colony
