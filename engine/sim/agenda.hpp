// agenda: what is due, in the serial order (due time, kind, cell id). Derived from the cells alone: rebuilt from events, never
// stored.
// Method:  a heap of four children a node, and for each due time of a cell its place in the heap. So an item is changed or
//          taken out where it stands: exactly as many items as due times, however long the history, and nothing to clean up.
// Memory:  16 bytes an item, and 4 for each id up to the highest that ever had an item of the kind.
// Threads: const functions on many threads; follow is exclusive.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/paged.hpp"
#include "engine/base/types.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"

namespace colony {

/// Kinds in their order at equal times.
enum class DueKind : std::uint8_t { kSettle = 0, kMove = 1, kDivide = 2 };
inline constexpr std::size_t kDueKindCount = 3;

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

  bool empty() const { return heap_.empty(); }
  std::size_t size() const { return heap_.size(); }
  /// The first in serial order; CHECKs that there is one.
  AgendaItem first() const {
    CHECK(!heap_.empty());
    return heap_[0];
  }
  /// All items due before `end_h`, in serial order, into `out` (cleared first). Cost: k log k for k items, however many wait.
  void due_before(double end_h, std::vector<AgendaItem>& out) const;
  /// All, in serial order: for tests and replay checks.
  std::vector<AgendaItem> items() const;

  /// All heap that it holds.
  std::size_t memory_bytes() const;

 private:
  void refresh(const Cell& cell);
  void set(DueKind kind, CellId id, const std::optional<double>& due_h);
  void place(std::size_t index, const AgendaItem& item);
  void rise(std::size_t index, const AgendaItem& item);   // from a free place at `index` towards the root
  void sink(std::size_t index, const AgendaItem& item);   // ... towards the leaves
  void take_out(std::size_t index);
  void collect(std::size_t index, double end_h, std::vector<AgendaItem>& out) const;

  static constexpr std::size_t kChildren = 4;

  Paged<AgendaItem> heap_;                    // no item before its parent, (index - 1) / kChildren
  // By kind, then id.value - 1: 1 + index in heap_; 0, or beyond the end: no item.
  std::array<Paged<std::uint32_t>, kDueKindCount> places_;
};

}  // namespace colony
