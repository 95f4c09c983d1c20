// agenda: what is due, in the serial order (due time, kind, cell id). Derived from the cells alone: rebuilt from events, never stored.
// Threads: exclusive.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
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
  /// All items due before `end_h`, in serial order, into `out` (cleared first).
  void due_before(double end_h, std::vector<AgendaItem>& out) const;
  const std::set<AgendaItem>& items() const { return items_; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  using DueTimes = std::array<double, 3>;     // by DueKind; kNever: nothing

  void refresh(const Cell& cell);

  std::set<AgendaItem> items_;
  std::vector<DueTimes> due_of_cell_;         // by id.value - 1; what items_ holds
};

}  // namespace colony
