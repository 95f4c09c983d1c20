#include "engine/analysis/series.hpp"

#include <algorithm>
#include <cmath>
#include <compare>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr double kUm2PerMm2 = 1e6;
constexpr double kCoordinateMax_um = 2e9;  // a grid index fits 32 bits; cells lie within 1e9 um (grid.cpp)

/// Grid cells first..last of one row, whose centres (first + 0.5, row + 0.5) ... lie in one footprint.
struct RowSpan {
  std::int32_t row = 0;
  std::int32_t first = 0;
  std::int32_t last = 0;
  friend auto operator<=>(const RowSpan&, const RowSpan&) = default;
};

std::int32_t grid_index(double coordinate_um) {
  CHECK(std::abs(coordinate_um) < kCoordinateMax_um);
  const auto truncated = static_cast<std::int32_t>(coordinate_um);
  return static_cast<double>(truncated) > coordinate_um ? truncated - 1 : truncated;
}

/// A footprint is convex: the centres inside it in one row are those from the first to the last that it contains.
void add_spans(const Body& body, std::vector<RowSpan>& spans) {
  const Vec2 half_um = body.footprint_half_extent_um();
  const Vec3& centre_um = body.centre_um();
  // One more on every side: the extent and the containment test round differently.
  const std::int32_t left = grid_index(centre_um.x() - half_um.x()) - 1,
                     right = grid_index(centre_um.x() + half_um.x()) + 1;
  const std::int32_t bottom = grid_index(centre_um.y() - half_um.y()) - 1,
                     top = grid_index(centre_um.y() + half_um.y()) + 1;
  for (std::int32_t row = bottom; row <= top; ++row) {
    const double y_um = static_cast<double>(row) + 0.5;
    const auto inside = [&](std::int32_t column) {
      return body.footprint_contains(static_cast<double>(column) + 0.5, y_um);
    };
    std::int32_t first = left, last = right;
    while (first <= last && !inside(first)) ++first;
    while (last > first && !inside(last)) --last;
    if (first <= last) spans.push_back({row, first, last});
  }
}

/// Grid cells in the union. Spans, not a bitmap: the memory follows the cells, however far apart they lie.
std::uint64_t union_area_um2(const Colony& colony) {
  std::vector<RowSpan> spans;
  for (const Cell& cell : colony.cells()) add_spans(colony.body(cell.id), spans);
  std::sort(spans.begin(), spans.end());
  std::uint64_t area_um2 = 0;
  for (std::size_t i = 0; i < spans.size();) {
    std::int32_t last = spans[i].last;
    std::size_t next = i + 1;
    for (; next < spans.size() && spans[next].row == spans[i].row && spans[next].first <= last + 1; ++next) {
      last = std::max(last, spans[next].last);
    }
    area_um2 += static_cast<std::uint64_t>(last - spans[i].first) + 1;
    i = next;
  }
  return area_um2;
}

}  // namespace

SeriesRow measure_series(const Colony& colony, double time_h) {
  SeriesRow row;
  row.time_h = time_h;
  row.cell_count = colony.cells().size();
  row.active_count = colony.count(Activity::kActive);
  row.passive_count = colony.count(Activity::kPassive);
  row.senescent_count = colony.count(Activity::kSenescent);
  if (row.cell_count == 0) return row;

  // In id order, in two passes: the same bits wherever it runs, and no cancellation.
  const auto count = static_cast<double>(row.cell_count);
  double sum_um3 = 0.0;
  for (const Cell& cell : colony.cells()) sum_um3 += cell.volume_um3;
  row.volume_mean_um3 = sum_um3 / count;
  double squares = 0.0;
  for (const Cell& cell : colony.cells()) {
    const double difference_um3 = cell.volume_um3 - row.volume_mean_um3;
    squares += difference_um3 * difference_um3;
  }
  row.volume_sd_um3 = std::sqrt(squares / count);

  row.area_um2 = static_cast<double>(union_area_um2(colony));
  row.radius_um = std::sqrt(row.area_um2 / maths::kPi);
  // Bodies too small to hold the centre of any grid cell have no area here, and then no density.
  if (row.area_um2 > 0.0) row.density_per_mm2 = count / row.area_um2 * kUm2PerMm2;
  return row;
}

}  // namespace colony
