// event: one complete fact. Colony and agenda are rebuilt from events without randomness or estimates.
// Source: model of the paper, section 4; the set of kinds is ours (engine/DESIGN.md).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/base/digest.hpp"
#include "engine/base/types.hpp"
#include "engine/model/cell.hpp"

namespace colony {

/// A sleeping cell whose surroundings gained room: it tries again at due_h.
struct Woken {
  CellId cell_id;
  double free_share = 0.0;
  double due_h = 0.0;
  friend bool operator==(const Woken&, const Woken&) = default;
};

struct Founded {
  Cell cell;
  friend bool operator==(const Founded&, const Founded&) = default;
};

/// cells[0] keeps the parent's id and the larger share, on the side -direction; cells[1] is new.
struct Divided {
  std::array<Cell, 2> cells;
  Vec3 plane_point_um = Vec3::Zero();   // the nucleus centre c
  Vec3 plane_normal = Vec3::Zero();     // unit; the principal splitting direction before the search turned it
  Vec3 direction = Vec3::Zero();        // unit; after the turn
  double fitness = 0.0;                 // of the pair, on the final points
  std::uint32_t evaluation_count = 0;   // candidate pairs scored
  bool corrected = false;               // the corrector ran
  std::vector<Woken> woken;             // ascending cell id
  friend bool operator==(const Divided&, const Divided&) = default;
};

/// A search found no space: contact inhibition. No due_h: the cell sleeps until woken.
struct Inhibited {
  double fitness = 0.0;
  double free_share = 0.0;
  std::int32_t try_count = 0;
  std::uint32_t evaluation_count = 0;
  bool corrected = false;
  std::optional<double> due_h;
  friend bool operator==(const Inhibited&, const Inhibited&) = default;
};

/// The nucleus has come to rest at the centre of mass of the deformed cell.
struct Settled {
  Vec3 nucleus_um = Vec3::Zero();
  Vec3 nearest_membrane_um = Vec3::Zero();
  double deformed_volume_um3 = 0.0;
  std::optional<double> due_h;          // the division time, unchanged: the event states all due times of the cell
  friend bool operator==(const Settled&, const Settled&) = default;
};

struct Moved {
  Cell cell;
  std::vector<Woken> woken;
  friend bool operator==(const Moved&, const Moved&) = default;
};

struct Senesced {
  friend bool operator==(const Senesced&, const Senesced&) = default;
};

/// Why a history ends. The first four are success; the rest are written by the job runner, never by the simulator.
enum class FinishReason : std::uint8_t {
  kCells = 0, kTime, kExhausted, kAllSenescent, kCancelled, kLimit, kInternal, kEngineChanged,
  kIdentical, kDifferent, kTargetDeleted     // of a job that verifies another one
};

struct Finished {
  FinishReason reason = FinishReason::kExhausted;
  std::uint64_t cell_count = 0;
  friend bool operator==(const Finished&, const Finished&) = default;
};

/// The order is the stored number of the kind; never reorder.
using EventBody = std::variant<Founded, Divided, Inhibited, Settled, Moved, Senesced, Finished>;
enum class EventKind : std::uint8_t { kFounded = 0, kDivided, kInhibited, kSettled, kMoved, kSenesced, kFinished };
inline constexpr int kEventKindCount = 7;

struct Event {
  std::uint64_t seq = 0;              // 1, 2, 3, ... dense
  double time_h = 0.0;
  std::optional<CellId> cell_id;      // the subject; none for finished
  EventBody body;
  Digest digest;                      // of the chain up to and with this event; finished repeats the one before
  EventKind kind() const { return static_cast<EventKind>(body.index()); }
  friend bool operator==(const Event&, const Event&) = default;
};

/// "founded", "divided", ... and back (nullopt if unknown).
std::string_view name_of(EventKind kind);
std::optional<EventKind> event_kind_from(std::string_view name);
/// "active", "passive", "senescent".
std::string_view name_of(Activity activity);
/// "cells", "time", "exhausted", "all_senescent", "cancelled", "limit", "internal", "engine_changed", "identical", "different",
/// "target_deleted"; and back.
std::string_view name_of(FinishReason reason);
std::optional<FinishReason> finish_reason_from(std::string_view name);

/// Turns every -0.0 into 0.0 and CHECKs that every double is finite. Applied to an event before digest, apply and storage.
void canonicalise(Event& event);

/// The next link of the chain; `finished` stays outside it and returns `previous`. Ignores event.digest and event.seq.
Digest digest_after(const Digest& previous, const Event& event);

}  // namespace colony
