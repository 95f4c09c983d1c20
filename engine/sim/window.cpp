#include "engine/sim/window.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr std::uint64_t kLast = std::uint64_t{1} << 32;

}  // namespace

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

std::size_t Window::begin_round(const Colony& colony, std::size_t count_max, std::optional<double> end_h) {
  looked_.clear();
  ready_.clear();
  index_.clear();
  std::size_t conflict_count = 0;
  const std::size_t end = std::min(slots_.size() - first_, kLookAhead);
  for (std::size_t number = 0; number < end && ready_.size() < count_max && conflict_count < kConflictsMax; ++number) {
    const Slot& slot = slots_[first_ + number];
    if (end_h && slot.item.due_h > *end_h) break;
    looked_.push_back({bounds_.reads(colony, slot.item)});
    if (slot.outcome) {
      index_.add(slot.outcome->writes, colony.cell(slot.item.cell_id).centre_um);
      continue;
    }
    if (settle_conflicts(number)) {
      make_ready(number);
    } else {
      ++conflict_count;
    }
    index_.add(bounds_.writes(colony, slot.item), colony.cell(slot.item.cell_id).centre_um);
  }
  ++counts_.round_count;
  counts_.looked_at_count += looked_.size();
  counts_.ready_count += ready_.size();
  return ready_.size();
}

// True if nothing before the item stands in its way. Else it waits for one that does, or, where that is decided and so has to be
// committed first, for the next round.
bool Window::settle_conflicts(std::size_t number) {
  const std::optional<std::size_t> blocker = index_.find(looked_[number].reads, number);
  if (!blocker) return true;
  if (!slots_[first_ + *blocker].outcome) {
    looked_[number].next = looked_[*blocker].waiting;
    looked_[*blocker].waiting = static_cast<std::uint32_t>(number);
  }
  return false;
}

void Window::make_ready(std::size_t number) {
  const std::uint64_t last = item(number).kind == DueKind::kSettle ? kLast : 0;
  ready_.push_back(last + number);
  std::push_heap(ready_.begin(), ready_.end(), std::greater<>());
}

std::size_t Window::take() {
  CHECK(!ready_.empty());
  std::pop_heap(ready_.begin(), ready_.end(), std::greater<>());
  const auto number = static_cast<std::size_t>(ready_.back() % kLast);
  ready_.pop_back();
  return number;
}

std::size_t Window::finish(std::size_t number, std::unique_ptr<Outcome> outcome) {
  index_.narrow(number, outcome->writes);
  slots_[first_ + number].outcome = std::move(outcome);
  std::size_t count = 0;
  std::uint32_t next = kNone;
  for (std::uint32_t one = looked_[number].waiting; one != kNone; one = next) {
    next = std::exchange(looked_[one].next, kNone);
    if (!settle_conflicts(one)) continue;
    make_ready(one);
    ++count;
  }
  looked_[number].waiting = kNone;
  counts_.freed_count += count;
  return count;
}

}  // namespace colony
