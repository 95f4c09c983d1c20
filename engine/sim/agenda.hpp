// agenda: what is due, in the serial order (due time, kind, cell id). Derived from the cells alone: rebuilt from events, never stored.
// Threads: exclusive.
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "engine/base/types.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"

namespace colony {

/// Kinds in their order at equal times.
enum class DueKind : std::uint8_t { kSettle = 0, kMove = 1, kDivide = 2 };

struct AgendaItem {
  double due_h = 0.0;
  DueKind kind = DueKind::kDivide;
  CellId cell_id;
  friend auto operator<=>(const AgendaItem&, const AgendaItem&) = default;
};

class Agenda {
 public:
  /// Call after every Colony::apply, with the colony as it is then.
  void follow(const Event& event, const Colony& colony);
  bool empty() const { return items_.empty(); }
  const AgendaItem& first() const { return *items_.begin(); }
  /// All items due before `end_h`, in serial order.
  std::vector<AgendaItem> due_before(double end_h) const;
  const std::set<AgendaItem>& items() const { return items_; }

 private:
  void refresh(const Cell& cell);
  void drop(CellId id);

  std::set<AgendaItem> items_;
  std::vector<std::vector<AgendaItem>> of_cell_;   // by id.value - 1; at most one item of each kind
};

}  // namespace colony
