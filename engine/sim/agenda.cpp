#include "engine/sim/agenda.hpp"

#include "engine/base/check.hpp"

namespace colony {

void Agenda::refresh(const Cell& cell) {
  const std::size_t index = cell.id.value - std::size_t{1};
  if (index >= due_of_cell_.size()) due_of_cell_.resize(index + 1, {kNever, kNever, kNever});
  const DueTimes now = {cell.settle_due_h.value_or(kNever), cell.move_due_h.value_or(kNever), cell.due_h.value_or(kNever)};
  DueTimes& before = due_of_cell_[index];
  for (std::size_t kind = 0; kind < now.size(); ++kind) {
    if (now[kind] == before[kind]) continue;
    if (before[kind] != kNever) CHECK(items_.erase({before[kind], static_cast<DueKind>(kind), cell.id}) == 1);
    if (now[kind] != kNever) items_.insert({now[kind], static_cast<DueKind>(kind), cell.id});
  }
  before = now;
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

void Agenda::due_before(double end_h, std::vector<AgendaItem>& out) const {
  out.clear();
  for (const AgendaItem& item : items_) {
    if (!(item.due_h < end_h)) break;
    out.push_back(item);
  }
}

}  // namespace colony
