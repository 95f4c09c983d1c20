// simulator: decides what happens next, one event at a time, and applies it. The event history is the checkpoint:
// replay() the stored events into a new simulator and step() goes on with the same bytes.
// Method:  discrete events in the order (due time, kind, cell id); the window is how far the engine may look ahead.
// Random:  every draw is addressed by (seed, cell, ordinal, purpose, lane); no generator state.
// Threads: one thread at a time.
// Errors:  CheckFailure on a bug; founders that cannot be placed are an error of place_founders, found before a job starts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/base/stop.hpp"
#include "engine/growth/workspace.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"
#include "engine/model/params.hpp"
#include "engine/sim/agenda.hpp"

namespace colony {

/// Bounds of a run, tested after every event in serial order, from the last founding on (a spec with more founders than
/// until.cells is refused before it becomes a job).
struct Until {
  std::optional<std::uint64_t> cells;
  std::optional<double> time_h;
};

/// Everything that decides a history.
struct RunSpec {
  Seed seed = 1;
  Params params;
  Until until;
};

/// The founding cells, ids 1..n, ready for `founded` events. Errors (kInvalid) point into the model object:
/// "/founders/positions_um/3" for a founder that overlaps an earlier one beyond tolerance or lies outside the dish,
/// "/founders" when 1,000 tries for one of them, or kFounderTriesMax for all, found no place. Pure: the same spec gives the same
/// cells. Long for many thousands: throws Stopped when asked to.
Result<std::vector<Cell>> place_founders(const RunSpec& spec, StopFlag stop = nullptr);
inline constexpr std::uint64_t kFounderTriesMax = 400'000;

/// How many cells found the colony: of positions_um, else count.
std::uint64_t founder_count(const FounderParams& founders);

class Simulator {
 public:
  /// The spec must be valid (validate() empty, CHECKed). Founders are placed when the first of them is needed, so that replaying
  /// a stored history costs no placement. While `stop` is set, step() throws Stopped and changes nothing.
  /// `threads` >= 1: how many may decide at once; it cannot change the history.
  explicit Simulator(RunSpec spec, StopFlag stop = nullptr, int threads = 1);

  /// Folds one stored event; nothing is decided. Events must come in order, from seq 1.
  void replay(const Event& stored);

  /// Decides the next event, applies it and returns it, `finished` included; nullopt after `finished`.
  std::optional<Event> step();

  /// Ends the history from outside (cancel, limit, failure): the `finished` event at the current time, applied.
  Event finish(FinishReason reason);

  const Colony& colony() const { return colony_; }
  const Agenda& agenda() const { return agenda_; }
  const RunSpec& spec() const { return spec_; }
  /// What all decisions so far took.
  const Work& work() const { return work_; }

 private:
  std::optional<FinishReason> reason_to_finish() const;
  Event commit(Event event);

  const RunSpec spec_;                       // fixed after construction
  const StopFlag stop_;
  const std::uint64_t founder_count_;
  std::vector<Cell> founders_;               // placed at the first founding; empty before
  Colony colony_;
  Agenda agenda_;
  Workspace workspace_;
  Work work_;
  std::vector<AgendaItem> window_;           // due inside the current window, in serial order; next_ is the first unhandled
  std::size_t next_ = 0;
};

}  // namespace colony
