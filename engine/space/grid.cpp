#include "engine/space/grid.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr std::size_t kSlotsMin = 16;

// The column index of a coordinate; |coordinate| <= 1e9 um, so the quotient fits. No floor(): SSE2 would call the C library.
std::int32_t column_of(double coordinate_um, double pitch_um) {
  CHECK(coordinate_um >= -1e9 && coordinate_um <= 1e9);
  const double quotient = coordinate_um / pitch_um;
  const auto truncated = static_cast<std::int64_t>(quotient);
  return static_cast<std::int32_t>(truncated - (static_cast<double>(truncated) > quotient ? 1 : 0));
}

}  // namespace

Grid::Grid(double half_extent_max_um)
    : half_extent_max_um_(half_extent_max_um), pitch_um_(std::max(half_extent_max_um, 1.0)), slots_(kSlotsMin) {
  CHECK(half_extent_max_um > 0.0);
}

Grid::Column Grid::column_at(double x_um, double y_um) const {
  return {column_of(x_um, pitch_um_), column_of(y_um, pitch_um_)};
}

std::size_t Grid::slot_of(Column column) const {
  // Both indices in one word, mixed by a multiplication with an odd constant; its high bits depend on all of both.
  const std::uint64_t word = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(column.x)) << 32) |
                             static_cast<std::uint32_t>(column.y);
  const std::uint64_t mixed = (word ^ (word >> 29)) * 0x9E3779B97F4A7C15ULL;
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = static_cast<std::size_t>((mixed ^ (mixed >> 32)) >> 8) & mask;
  while (slots_[slot].first != kUnused && slots_[slot].column != column) slot = (slot + 1) & mask;
  return slot;  // ends: a quarter of the slots is unused
}

// Leaves out the columns whose cells have gone; then at most half of the slots are used, so a rebuild has a quarter of them of
// puts to be paid by.
void Grid::rebuild() {
  const auto holds_cells = [](const Slot& slot) { return slot.first != kUnused && slot.first != kEnd; };
  const auto count = static_cast<std::size_t>(std::count_if(slots_.begin(), slots_.end(), holds_cells));
  const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(std::bit_ceil(std::max(2 * count, kSlotsMin))));
  used_count_ = count;
  for (const Slot& slot : old) {
    if (holds_cells(slot)) slots_[slot_of(slot.column)] = slot;
  }
}

void Grid::put(CellId id, const Vec3& centre_um, const Box& box) {
  for (int axis = 0; axis < 2; ++axis) {
    CHECK(box.high[axis] - centre_um[axis] <= half_extent_max_um_ && centre_um[axis] - box.low[axis] <= half_extent_max_um_);
  }
  CHECK(id.value != kEnd && id.value != kUnused);
  const Column column = column_at(centre_um.x(), centre_um.y());
  while (next_.size() < id.value) next_.push_back(kUnused);
  CHECK(next_[id.value - 1] == kUnused);
  Slot* slot = &slots_[slot_of(column)];
  if (slot->first == kUnused) {
    if (4 * (used_count_ + 1) > 3 * slots_.size()) {
      rebuild();
      slot = &slots_[slot_of(column)];
    }
    *slot = {column, kEnd};
    ++used_count_;
  }
  next_[id.value - 1] = slot->first;
  slot->first = id.value;
}

void Grid::remove(CellId id, const Vec3& centre_um) {
  CHECK(id.value >= 1 && id.value <= next_.size());
  Slot& slot = slots_[slot_of(column_at(centre_um.x(), centre_um.y()))];
  CHECK(slot.first != kUnused);
  std::uint32_t* link = &slot.first;
  while (*link != id.value) {
    CHECK(*link != kEnd);
    link = &next_[*link - 1];
  }
  *link = std::exchange(next_[id.value - 1], kUnused);
}

void Grid::append_list(std::uint32_t first, std::vector<CellId>& out) const {
  for (std::uint32_t id = first; id != kEnd && id != kUnused; id = next_[id - 1]) out.push_back(CellId{id});
}

void Grid::candidates(const Box& box, std::vector<CellId>& out) const {
  out.clear();
  const Column low = column_at(box.low.x() - half_extent_max_um_, box.low.y() - half_extent_max_um_);
  const Column high = column_at(box.high.x() + half_extent_max_um_, box.high.y() + half_extent_max_um_);
  if (low.x > high.x || low.y > high.y) return;
  // |column| <= 1e9: the product fits.
  const std::int64_t wanted = (std::int64_t{high.x} - low.x + 1) * (std::int64_t{high.y} - low.y + 1);
  if (wanted >= static_cast<std::int64_t>(slots_.size())) {  // a wide box: the table is shorter than the plane
    for (const Slot& slot : slots_) {
      const Column& at = slot.column;
      if (at.x >= low.x && at.x <= high.x && at.y >= low.y && at.y <= high.y) append_list(slot.first, out);
    }
    return;
  }
  for (std::int32_t x = low.x; x <= high.x; ++x) {
    for (std::int32_t y = low.y; y <= high.y; ++y) append_list(slots_[slot_of({x, y})].first, out);
  }
}

}  // namespace colony
