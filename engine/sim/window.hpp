// window: what is due next, in serial order, and which of it can be decided already.
// Method:  a sliding horizon: everything due before (first uncommitted due + window_h). Nothing that is committed makes anything due
//          inside it, because every delay is at least window_h; so the list is the serial order, and only grows at its end.
//          Decided items wait in their place until their turn.
// Threads: exclusive; an Outcome is written by one worker while nobody else looks.
#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "engine/model/colony.hpp"
#include "engine/sim/agenda.hpp"
#include "engine/sim/conflict.hpp"
#include "engine/sim/decide.hpp"

namespace colony {

/// What came of deciding an item.
struct Outcome {
  Decision decision;
  std::exception_ptr failure;                  // instead of a decision
  Writes writes;                               // what the decision will change
};

/// How much looking ahead there was; no part of any result.
struct WindowCounts {
  std::uint64_t round_count = 0;
  std::uint64_t looked_at_count = 0;           // items, each as often as it was looked at
  std::uint64_t ready_count = 0;               // items found ready
};

class Window {
 public:
  explicit Window(const Params& params);

  /// Forgets everything, decisions too: the colony changed from outside, or is finished.
  void clear();
  /// All items of the horizon are committed.
  bool empty() const { return first_ == slots_.size(); }
  std::size_t size() const { return slots_.size() - first_; }

  /// Moves the horizon to the agenda's first item + window_h and appends what is due before. The agenda must not be empty.
  void refill(const Agenda& agenda);

  /// The next item in serial order, and its outcome: null while undecided.
  const AgendaItem& first() const { return slots_[first_].item; }
  std::unique_ptr<Outcome>& first_outcome() { return slots_[first_].outcome; }
  void pop() { ++first_; }

  /// One that may be decided now.
  struct Ready {
    const AgendaItem* item;
    std::unique_ptr<Outcome>* outcome;         // null yet
  };
  /// Undecided items that conflict with no uncommitted item before them, at most `count_max`, in serial order and so with the
  /// first item if that is undecided. Looks no further than kLookAhead items, kConflictsMax conflicts or `end_h`. Valid until
  /// the next call of anything else.
  const std::vector<Ready>& find_ready(const Colony& colony, std::size_t count_max, std::optional<double> end_h);

  const ConflictBounds& bounds() const { return bounds_; }
  const WindowCounts& counts() const { return counts_; }
  /// Tests only: see ConflictBounds.
  void scale_bounds(const Params& params, double scale) { bounds_ = ConflictBounds(params, scale); }

  /// Bounds of the work of one call: a dish has tens of thousands of items an hour. They decide what is found ready when, so never
  /// a result.
  static constexpr std::size_t kLookAhead = 4096;
  static constexpr std::size_t kConflictsMax = 256;

 private:
  struct Slot {
    AgendaItem item;
    std::unique_ptr<Outcome> outcome;
  };

  const double window_h_;                      // fixed after construction
  ConflictBounds bounds_;
  ConflictIndex index_;
  std::vector<Slot> slots_;                    // serial order; those before first_ are committed
  std::size_t first_ = 0;
  std::vector<AgendaItem> due_;                // scratch
  std::vector<Ready> ready_;                   // scratch
  WindowCounts counts_;
};

}  // namespace colony
