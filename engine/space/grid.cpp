#include "engine/space/grid.hpp"

#include <algorithm>

#include "engine/base/check.hpp"

namespace colony {
namespace {

// The column index of a coordinate; |coordinate| <= 1e9 um, so the quotient fits. No floor(): SSE2 would call the C library.
std::int32_t column_of(double coordinate_um, double pitch_um) {
  CHECK(coordinate_um >= -1e9 && coordinate_um <= 1e9);
  const double quotient = coordinate_um / pitch_um;
  const auto truncated = static_cast<std::int64_t>(quotient);
  return static_cast<std::int32_t>(truncated - (static_cast<double>(truncated) > quotient ? 1 : 0));
}

std::uint64_t key(std::int32_t column_x, std::int32_t column_y) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(column_x)) << 32) | static_cast<std::uint32_t>(column_y);
}

}  // namespace

Grid::Grid(double half_extent_max_um) : half_extent_max_um_(half_extent_max_um), pitch_um_(std::max(half_extent_max_um, 1.0)) {
  CHECK(half_extent_max_um > 0.0);
}

Grid::Key Grid::key_of(double x_um, double y_um) const { return key(column_of(x_um, pitch_um_), column_of(y_um, pitch_um_)); }

void Grid::put(CellId id, const Vec3& centre_um, const Box& box) {
  for (int axis = 0; axis < 2; ++axis) {
    CHECK(box.high[axis] - centre_um[axis] <= half_extent_max_um_ && centre_um[axis] - box.low[axis] <= half_extent_max_um_);
  }
  columns_[key_of(centre_um.x(), centre_um.y())].push_back(id);
}

void Grid::remove(CellId id, const Vec3& centre_um) {
  const auto found = columns_.find(key_of(centre_um.x(), centre_um.y()));
  CHECK(found != columns_.end());
  std::vector<CellId>& column = found->second;
  const auto place = std::find(column.begin(), column.end(), id);
  CHECK(place != column.end());
  *place = column.back();
  column.pop_back();
  if (column.empty()) columns_.erase(found);
}

void Grid::candidates(const Box& box, std::vector<CellId>& out) const {
  out.clear();
  const std::int32_t x0 = column_of(box.low.x() - half_extent_max_um_, pitch_um_);
  const std::int32_t x1 = column_of(box.high.x() + half_extent_max_um_, pitch_um_);
  const std::int32_t y0 = column_of(box.low.y() - half_extent_max_um_, pitch_um_);
  const std::int32_t y1 = column_of(box.high.y() + half_extent_max_um_, pitch_um_);
  for (std::int32_t x = x0; x <= x1; ++x) {
    for (std::int32_t y = y0; y <= y1; ++y) {
      const auto found = columns_.find(key(x, y));
      if (found != columns_.end()) out.insert(out.end(), found->second.begin(), found->second.end());
    }
  }
  std::sort(out.begin(), out.end());  // ids are distinct: one order only
}

}  // namespace colony
