#include "engine/sim/agenda.hpp"

#include <algorithm>
#include <limits>

#include "engine/base/check.hpp"

namespace colony {

void Agenda::place(std::size_t index, const AgendaItem& item) {
  heap_[index] = item;
  places_[static_cast<std::size_t>(item.kind)][item.cell_id.value - 1] = static_cast<std::uint32_t>(index + 1);
}

void Agenda::rise(std::size_t index, const AgendaItem& item) {
  while (index > 0) {
    const std::size_t parent = (index - 1) / kChildren;
    if (!(item < heap_[parent])) break;
    place(index, heap_[parent]);
    index = parent;
  }
  place(index, item);
}

void Agenda::sink(std::size_t index, const AgendaItem& item) {
  for (std::size_t child = kChildren * index + 1; child < heap_.size(); child = kChildren * index + 1) {
    const std::size_t end = std::min(child + kChildren, heap_.size());
    std::size_t least = child;
    for (++child; child < end; ++child) {
      if (heap_[child] < heap_[least]) least = child;
    }
    if (!(heap_[least] < item)) break;
    place(index, heap_[least]);
    index = least;
  }
  place(index, item);
}

void Agenda::take_out(std::size_t index) {
  const AgendaItem gone = heap_[index];
  places_[static_cast<std::size_t>(gone.kind)][gone.cell_id.value - 1] = 0;
  const AgendaItem last = heap_.back();
  heap_.pop_back();
  if (index == heap_.size()) return;
  if (last < gone) {
    rise(index, last);
  } else {
    sink(index, last);
  }
}

void Agenda::set(DueKind kind, CellId id, const std::optional<double>& due_h) {
  Paged<std::uint32_t>& places = places_[static_cast<std::size_t>(kind)];
  const std::size_t at = id.value - std::size_t{1};
  const std::uint32_t place = at < places.size() ? places[at] : 0;
  if (!due_h) {
    if (place != 0) take_out(place - std::size_t{1});
    return;
  }
  const AgendaItem item{*due_h, kind, id};
  if (place == 0) {
    CHECK(heap_.size() < std::numeric_limits<std::uint32_t>::max());
    while (places.size() <= at) places.push_back(0);
    heap_.push_back(item);
    rise(heap_.size() - 1, item);
    return;
  }
  const std::size_t index = place - std::size_t{1};
  if (item < heap_[index]) {
    rise(index, item);
  } else if (heap_[index] < item) {
    sink(index, item);
  }
}

void Agenda::refresh(const Cell& cell) {
  set(DueKind::kSettle, cell.id, cell.settle_due_h);
  set(DueKind::kMove, cell.id, cell.move_due_h);
  set(DueKind::kDivide, cell.id, cell.due_h);
}

void Agenda::follow(const Event& event, const Colony& colony) {
  if (event.cell_id) refresh(colony.cell(*event.cell_id));
  const std::vector<Woken>* woken = nullptr;
  if (const auto* divided = std::get_if<Divided>(&event.body)) {
    refresh(colony.cell(divided->cells[1].id));
    woken = &divided->woken;
  } else if (const auto* moved = std::get_if<Moved>(&event.body)) {
    woken = &moved->woken;
  }
  if (woken == nullptr) return;
  for (const Woken& one : *woken) refresh(colony.cell(one.cell_id));
}

// Below an item that is not due nothing is: at most kChildren nodes are looked at in vain for each one found. The depth of the
// recursion is the heap's, 16 at most.
void Agenda::collect(std::size_t index, double end_h, std::vector<AgendaItem>& out) const {
  if (index >= heap_.size() || !(heap_[index].due_h < end_h)) return;
  out.push_back(heap_[index]);
  for (std::size_t child = kChildren * index + 1; child <= kChildren * index + kChildren; ++child) collect(child, end_h, out);
}

void Agenda::due_before(double end_h, std::vector<AgendaItem>& out) const {
  out.clear();
  collect(0, end_h, out);
  std::sort(out.begin(), out.end());  // items differ: one order only
}

std::vector<AgendaItem> Agenda::items() const {
  std::vector<AgendaItem> all(heap_.begin(), heap_.end());
  std::sort(all.begin(), all.end());
  return all;
}

std::size_t Agenda::memory_bytes() const {
  std::size_t bytes = heap_.memory_bytes();
  for (const Paged<std::uint32_t>& places : places_) bytes += places.memory_bytes();
  return bytes;
}

}  // namespace colony
