// colony: all cells at one moment, as a fold of apply over events. Nothing else changes a colony.
// Threads: apply is exclusive; every const function may run on many threads between applies.
// Errors:  apply CHECKs that the event fits (dense seq, time not before the last, known subject, digest chain).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/base/digest.hpp"
#include "engine/base/paged.hpp"
#include "engine/model/cell.hpp"
#include "engine/model/event.hpp"
#include "engine/model/params.hpp"
#include "engine/shape/body.hpp"
#include "engine/space/grid.hpp"

namespace colony {

/// The geometry of a cell's body.
BodyGeometry geometry_of(const Cell& cell);

class Colony {
 public:
  /// Only what decides shapes and the grid's pitch is taken from `params`.
  explicit Colony(const Params& params);

  /// The only way a colony changes. `event.digest` must be the next link of the chain.
  void apply(const Event& event);

  /// All cells by ascending id: cells()[i].id.value == i + 1.
  const Paged<Cell>& cells() const { return cells_; }
  const Cell& cell(CellId id) const;
  /// The cell's noisy ellipsoid, prepared for evaluation. As with cell(): the same object until the next apply.
  const Body& body(CellId id) const;
  bool contains(CellId id) const { return id.value >= 1 && id.value <= cells_.size(); }

  /// Ids of all cells whose bounding box meets `box`, ascending, into `out` (cleared first).
  void cells_meeting(const Box& box, std::vector<CellId>& out) const;

  std::uint64_t last_seq() const { return last_seq_; }
  double time_h() const { return time_h_; }              // of the last event
  const Digest& digest() const { return digest_; }
  const std::optional<Finished>& finished() const { return finished_; }
  std::uint64_t count(Activity activity) const { return counts_[static_cast<int>(activity)]; }
  const NoiseParams& noise() const { return noise_; }
  /// All heap that it holds: about 470 bytes a cell (engine/DESIGN.md).
  std::size_t memory_bytes() const { return cells_.memory_bytes() + bodies_.memory_bytes() + grid_.memory_bytes(); }

 private:
  void put(const Cell& cell);                  // adds or replaces, keeping grid, bodies and counts in step
  void set_activity(Cell& cell, Activity activity);
  void wake(const std::vector<Woken>& woken);

  NoiseParams noise_;                          // fixed after construction
  Paged<Cell> cells_;
  Paged<Body> bodies_;
  Grid grid_;
  std::uint64_t counts_[3] = {0, 0, 0};
  std::uint64_t last_seq_ = 0;
  double time_h_ = 0.0;
  Digest digest_;
  std::optional<Finished> finished_;
};

}  // namespace colony
