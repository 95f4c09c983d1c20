#include "engine/sim/window.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr std::uint64_t kLast = std::uint64_t{1} << 62;

}  // namespace

Window::Window(const Params& params)
    : window_h_(params.window_h), bounds_(params), index_(bounds_.side_max_um(), kLookAhead) {}

void Window::clear() {
  index_.clear();
  slots_.clear();
  ready_.clear();
  base_ = first_ = looked_end_ = 0;
  waiting_count_ = 0;
  horizon_h_ = -std::numeric_limits<double>::infinity();
}

void Window::refill(const Agenda& agenda) {
  const double horizon_h = agenda.first().due_h + window_h_;
  if (!(horizon_h > horizon_h_)) return;
  agenda.due_before(horizon_h, due_);
  slots_.erase(slots_.begin(), slots_.begin() + static_cast<std::ptrdiff_t>(first_ - base_));
  base_ = first_;
  // What is listed is still due, and nothing came between.
  auto listed = slots_.begin();
  auto due = due_.begin();
  for (; due != due_.end() && due->due_h < horizon_h_; ++due, ++listed) CHECK(listed != slots_.end() && listed->item == *due);
  CHECK(listed == slots_.end());
  for (; due != due_.end(); ++due) slots_.push_back({*due, nullptr, kNone, kNone});
  horizon_h_ = horizon_h;
}

void Window::pop(const Colony& colony) {
  const Number number = first_++;
  if (looked_end_ <= number) {
    looked_end_ = first_;
  } else {
    free_those_waiting_for(colony, number);
  }
}

std::size_t Window::begin_round(const Colony& colony, std::size_t count_max, std::optional<double> end_h) {
  const Number last = std::min<Number>(end(), first_ + kLookAhead);
  while (looked_end_ < last && ready_.size() < count_max && waiting_count_ < kWaitingMax) {
    const AgendaItem& next = item(looked_end_);
    if (end_h && next.due_h > *end_h) break;
    if (is_free(colony, looked_end_)) make_ready(looked_end_);
    index_.add(looked_end_, first_, bounds_.writes(colony, next), colony.cell(next.cell_id).centre_um);
    ++looked_end_;
  }
  const std::size_t count = std::min(ready_.size(), count_max);
  ++counts_.round_count;
  counts_.ready_count += count;
  return count;
}

// True if no uncommitted item before it stands in its way. Else it is listed with one that does. The reads are worked out
// at every question, because an event of its own cell may have changed them since the last.
bool Window::is_free(const Colony& colony, Number number) {
  ++counts_.question_count;
  const std::optional<Number> blocker = index_.find(bounds_.reads(colony, item(number)), first_, number);
  if (!blocker) return true;
  slot(number).next = std::exchange(slot(*blocker).waiting, number);
  ++waiting_count_;
  return false;
}

std::size_t Window::free_those_waiting_for(const Colony& colony, Number number) {
  std::size_t count = 0;
  Number next = kNone;
  for (Number one = std::exchange(slot(number).waiting, kNone); one != kNone; one = next) {
    next = std::exchange(slot(one).next, kNone);
    --waiting_count_;
    if (!is_free(colony, one)) continue;
    make_ready(one);
    ++count;
  }
  return count;
}

void Window::make_ready(Number number) {
  ready_.push_back(item(number).kind == DueKind::kSettle ? number + kLast : number);
  std::push_heap(ready_.begin(), ready_.end(), std::greater<>());
}

Window::Number Window::take() {
  CHECK(!ready_.empty());
  std::pop_heap(ready_.begin(), ready_.end(), std::greater<>());
  const Number number = ready_.back() % kLast;
  ready_.pop_back();
  return number;
}

std::size_t Window::finish(const Colony& colony, Number number, std::unique_ptr<Outcome> outcome) {
  index_.narrow(number, outcome->writes);
  slot(number).outcome = std::move(outcome);
  const std::size_t count = free_those_waiting_for(colony, number);
  counts_.freed_count += count;
  return count;
}

}  // namespace colony
