// window: what is due next, in serial order, and which of it can be decided already.
// Method:  a sliding horizon: everything due before (first uncommitted due + window_h). Nothing that is committed makes
//          anything due inside it, because every delay is at least window_h (CHECKed); so the list is the serial order, and
//          only grows at its end. (A division takes nothing away: the cell that keeps the id keeps its move. refill() CHECKs it.) Decided items wait in their
//          place for their turn.
// Threads: exclusive: during a round the caller guards every call by one mutex.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
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
  std::uint64_t ready_count = 0;               // items ready when a round began
  std::uint64_t freed_count = 0;               // items that became ready during one
  std::uint64_t question_count = 0;            // to the index of conflicts
};

class Window {
 public:
  /// Items by their number: 0, 1, 2, ... in serial order since clear().
  using Number = std::uint64_t;

  explicit Window(const Params& params);

  /// Forgets everything, decisions too: the colony changed from outside, or something failed.
  void clear();
  /// All items of the horizon are committed.
  bool empty() const { return first_ == end(); }
  std::size_t size() const { return static_cast<std::size_t>(end() - first_); }

  /// Moves the horizon to the agenda's first item + window_h and appends what is due before. The agenda must not be empty.
  void refill(const Agenda& agenda);

  /// The next item in serial order, and its outcome: null while undecided.
  const AgendaItem& first() const { return slot(first_).item; }
  std::unique_ptr<Outcome>& first_outcome() { return slot(first_).outcome; }
  /// The first item is committed: `colony` is as it is then.
  void pop(const Colony& colony);

  /// A round: items are decided while the colony stands still. begin_round() looks further ahead and returns how many items
  /// are ready, that is undecided and in conflict with no uncommitted item before them: the first item if that is
  /// undecided, and at most `count_max`. It looks at no more than kLookAhead items, until kWaitingMax wait, and not past
  /// `end_h`.
  std::size_t begin_round(const Colony& colony, std::size_t count_max, std::optional<double> end_h);
  /// Hands out a ready item; one for each that begin_round() and finish() announced. In serial order, but settlings last:
  /// they are short, nobody waits for them, and they fill the gaps at the end.
  Number take();
  const AgendaItem& item(Number number) const { return slot(number).item; }
  /// Keeps the outcome until its turn, and returns how many more items are ready: what a decision writes is less than what
  /// it might have written, so some that waited for it need not wait for its commit.
  std::size_t finish(const Colony& colony, Number number, std::unique_ptr<Outcome> outcome);
  /// It was taken, but not decided.
  void give_back(Number number) { make_ready(number); }

  const ConflictBounds& bounds() const { return bounds_; }
  const WindowCounts& counts() const { return counts_; }
  /// Tests only: see ConflictBounds.
  void scale_bounds(const Params& params, double scale) { bounds_ = ConflictBounds(params, scale); }

  /// Bounds of the work of one call: a dish has tens of thousands of items an hour. They decide what is found ready when,
  /// so never a result.
  static constexpr std::size_t kLookAhead = 4096;
  static constexpr std::size_t kWaitingMax = 256;

 private:
  static constexpr Number kNone = std::numeric_limits<Number>::max();
  struct Slot {
    AgendaItem item;
    std::unique_ptr<Outcome> outcome;
    Number waiting = kNone;                    // head of the list of those that wait for this one to be decided or committed
    Number next = kNone;                       // of the list this one is in
  };
  Slot& slot(Number number) { return slots_[static_cast<std::size_t>(number - base_)]; }
  const Slot& slot(Number number) const { return slots_[static_cast<std::size_t>(number - base_)]; }
  Number end() const { return base_ + slots_.size(); }
  bool is_free(const Colony& colony, Number number);
  std::size_t free_those_waiting_for(const Colony& colony, Number number);
  void make_ready(Number number);

  const double window_h_;                      // fixed after construction
  ConflictBounds bounds_;
  ConflictIndex index_;                        // those in [first_, looked_end_)
  std::vector<Slot> slots_;                    // serial order, from number base_ on; those before first_ are committed
  Number base_ = 0;
  Number first_ = 0;
  Number looked_end_ = 0;                      // those before it are decided, ready or waiting
  std::size_t waiting_count_ = 0;
  double horizon_h_ = -std::numeric_limits<double>::infinity();    // everything due before it is listed
  std::vector<Number> ready_;                  // heap, least first; a settling's has kLast added
  std::vector<AgendaItem> due_;                // scratch
  WindowCounts counts_;
};

}  // namespace colony
