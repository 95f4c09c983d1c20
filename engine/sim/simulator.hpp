// simulator: decides what happens next, one event at a time, and applies it. The event history is the checkpoint:
// replay() the stored events into a new simulator and step() goes on with the same bytes.
// Method:  discrete events in the order (due time, kind, cell id); that serial order is the meaning. The window is how far
//          the engine may look ahead and decide, on several threads, what conflicts with nothing before it (conflict.hpp);
//          decided events wait for their turn.
// Random:  every draw is addressed by (seed, cell, ordinal, purpose, lane); no generator state.
// Threads: one caller at a time; it decides too. Between two calls no other thread is at work.
// Errors:  CheckFailure on a bug; founders that cannot be placed are an error of place_founders, found before a job starts.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/base/stop.hpp"
#include "engine/growth/workspace.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"
#include "engine/model/params.hpp"
#include "engine/sim/agenda.hpp"
#include "engine/sim/crew.hpp"
#include "engine/sim/window.hpp"

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
/// "/founders" when 1,000 tries for one of them, or kFounderTriesMax for all, found no place. Pure: the same spec gives the
/// same cells. Long for many thousands: throws Stopped when asked to.
Result<std::vector<Cell>> place_founders(const RunSpec& spec, StopFlag stop = nullptr);
inline constexpr std::uint64_t kFounderTriesMax = 400'000;

/// How many cells found the colony: of positions_um, else count.
std::uint64_t founder_count(const FounderParams& founders);

class Simulator {
 public:
  /// The spec must be valid (validate() empty, CHECKed). Founders are placed when the first of them is needed, so that
  /// replaying a stored history costs no placement. While `stop` is set, step() throws Stopped and changes nothing.
  /// `threads`, 1..kThreadsMax (CHECKed): how many may decide at once; it cannot change the history. With 1 nothing is
  /// decided before its turn.
  explicit Simulator(RunSpec spec, StopFlag stop = nullptr, int threads = 1);

  /// Folds one stored event; nothing is decided. Events must come in order, from seq 1.
  void replay(const Event& stored);

  /// Decides the next event, applies it and returns it, `finished` included; nullopt after `finished`. The colony is then
  /// as it is after that event, however many later ones are decided already. A failed check comes out of the step whose
  /// event it concerns, on any number of threads, and leaves the colony as it was.
  std::optional<Event> step();

  /// Ends the history from outside (cancel, limit, failure): the `finished` event at the current time, applied.
  Event finish(FinishReason reason);

  const Colony& colony() const { return colony_; }
  const Agenda& agenda() const { return agenda_; }
  const RunSpec& spec() const { return spec_; }
  /// What all decisions of the events so far took.
  const Work& work() const { return work_; }
  /// How much looking ahead there was.
  const WindowCounts& window_counts() const { return window_.counts(); }

 private:
  friend struct SimulatorProbe;              // tests: shows that a conflict bound that is too small would be seen

  std::optional<FinishReason> reason_to_finish() const;
  Event commit(Event event);
  Workspace& workspace_of(std::size_t worker);
  Decision decide(const AgendaItem& item, Workspace& workspace) const;
  std::unique_ptr<Outcome> try_to_decide(const AgendaItem& item, Workspace& workspace) const;
  void decide_ready();

  const RunSpec spec_;                       // fixed after construction
  const StopFlag stop_;
  const std::uint64_t founder_count_;
  std::vector<Cell> founders_;               // placed at the first founding; empty before
  Colony colony_;
  Agenda agenda_;
  Work work_;
  Window window_;
  Crew crew_;
  std::vector<std::unique_ptr<Workspace>> workspaces_;    // by worker; each made by the worker that needs it first
};

}  // namespace colony
