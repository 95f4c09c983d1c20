#include "engine/sim/window.hpp"

#include <algorithm>

#include "engine/base/check.hpp"

namespace colony {

Window::Window(const Params& params) : window_h_(params.window_h), bounds_(params), index_(bounds_.side_max_um()) {}

void Window::clear() {
  slots_.clear();
  first_ = 0;
}

void Window::refill(const Agenda& agenda) {
  due_.clear();
  agenda.due_before(agenda.first().due_h + window_h_, due_);
  slots_.erase(slots_.begin(), slots_.begin() + static_cast<std::ptrdiff_t>(first_));
  first_ = 0;
  // What was ahead still is, and in front: nothing came between.
  CHECK(due_.size() >= slots_.size());
  for (std::size_t i = 0; i < slots_.size(); ++i) CHECK(due_[i] == slots_[i].item);
  for (std::size_t i = slots_.size(); i < due_.size(); ++i) slots_.push_back({due_[i], nullptr});
}

const std::vector<Window::Ready>& Window::find_ready(const Colony& colony, std::size_t count_max, std::optional<double> end_h) {
  ready_.clear();
  index_.clear();
  std::size_t conflict_count = 0;
  const std::size_t end = std::min(slots_.size(), first_ + kLookAhead);
  for (std::size_t i = first_; i < end && ready_.size() < count_max && conflict_count < kConflictsMax; ++i) {
    Slot& slot = slots_[i];
    if (end_h && slot.item.due_h > *end_h) break;
    ++counts_.looked_at_count;
    const Vec3& centre_um = colony.cell(slot.item.cell_id).centre_um;
    if (slot.outcome) {
      index_.add(slot.outcome->writes, centre_um);
      continue;
    }
    if (index_.conflicts(bounds_.reads(colony, slot.item))) {
      ++conflict_count;
    } else {
      ready_.push_back({&slot.item, &slot.outcome});
    }
    index_.add(bounds_.writes(colony, slot.item), centre_um);
  }
  ++counts_.round_count;
  counts_.ready_count += ready_.size();
  return ready_;
}

}  // namespace colony
