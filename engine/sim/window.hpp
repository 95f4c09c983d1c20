// window: what is due next, in serial order, and which of it can be decided already.
// Method:  a sliding horizon: everything due before (first uncommitted due + window_h). Nothing that is committed makes anything due
//          inside it, because every delay is at least window_h; so the list is the serial order, and only grows at its end.
//          Decided items wait in their place until their turn.
// Threads: exclusive: during a round the caller guards every call by one mutex.
#pragma once

#include <cstddef>
#include <cstdint>
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
  std::uint64_t looked_at_count = 0;           // items, each as often as a round looked at it
  std::uint64_t ready_count = 0;               // items ready when a round began
  std::uint64_t freed_count = 0;               // items that became ready during one
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

  /// A round: items are decided while the colony stands still. begin_round() looks through the horizon and returns how many items
  /// are ready, that is undecided and in conflict with no uncommitted item before them; at most `count_max`, and the first item
  /// if that is undecided. It looks no further than kLookAhead items, kConflictsMax conflicts or `end_h`.
  std::size_t begin_round(const Colony& colony, std::size_t count_max, std::optional<double> end_h);
  /// Hands out a ready item (its number in this round); one for each that begin_round() and finish() announced. In serial order,
  /// but settlings last: they are short, nobody waits for them, and they fill the gaps at the end.
  std::size_t take();
  const AgendaItem& item(std::size_t number) const { return slots_[first_ + number].item; }
  /// Keeps the outcome until its turn, and returns how many more items are ready: what a decision writes is less than what it might
  /// have written, so some that waited for it need not wait for its commit.
  std::size_t finish(std::size_t number, std::unique_ptr<Outcome> outcome);

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
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  // An item looked at in this round; its number counts from first_, and is its position in index_.
  struct Looked {
    Reads reads;
    std::uint32_t waiting = kNone;             // head of the list of those that wait for this one to be decided
    std::uint32_t next = kNone;                // of the list this one is in
  };
  bool settle_conflicts(std::size_t number);
  void make_ready(std::size_t number);

  const double window_h_;                      // fixed after construction
  ConflictBounds bounds_;
  ConflictIndex index_;
  std::vector<Slot> slots_;                    // serial order; those before first_ are committed
  std::size_t first_ = 0;
  std::vector<Looked> looked_;                 // by number
  std::vector<std::uint64_t> ready_;           // heap, least first: number, plus kLast for a settling
  std::vector<AgendaItem> due_;                // scratch
  WindowCounts counts_;
};

}  // namespace colony
