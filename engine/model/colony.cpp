#include "engine/model/colony.hpp"

#include <algorithm>
#include <cstddef>

#include "engine/base/check.hpp"

namespace colony {

BodyGeometry geometry_of(const Cell& cell) { return {cell.centre_um, cell.semiaxes_um, cell.rotation_rad, cell.noise_offset}; }

Colony::Colony(const Params& params) : noise_(params.noise), grid_(body_half_extent_max_um(params)) {}

const Cell& Colony::cell(CellId id) const {
  CHECK(contains(id));
  return cells_[id.value - 1];
}

const Body& Colony::body(CellId id) const {
  CHECK(contains(id));
  return bodies_[id.value - 1];
}

void Colony::cells_meeting(const Box& box, std::vector<CellId>& out) const {
  grid_.candidates(box, out);
  // Far apart in memory, all of them: fetched ahead, they come at once instead of one after the other.
  constexpr std::size_t kAhead = 8;
  std::size_t count = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (i + kAhead < out.size()) bodies_.prefetch(out[i + kAhead].value - 1);
    if (meets(bodies_[out[i].value - 1].box(), box)) out[count++] = out[i];
  }
  out.resize(count);
  std::sort(out.begin(), out.end());  // ids differ: one order only
}

void Colony::set_activity(Cell& cell, Activity activity) {
  --counts_[static_cast<int>(cell.activity)];
  cell.activity = activity;
  ++counts_[static_cast<int>(activity)];
}

void Colony::put(const Cell& cell) {
  const std::size_t index = cell.id.value - std::size_t{1};
  CHECK(cell.id.value >= 1 && index <= cells_.size());
  Body body(geometry_of(cell), noise_);
  if (index == cells_.size()) {
    cells_.push_back(cell);
    bodies_.push_back(body);
  } else {
    grid_.remove(cell.id, cells_[index].centre_um);
    --counts_[static_cast<int>(cells_[index].activity)];
    cells_[index] = cell;
    bodies_[index] = body;
  }
  ++counts_[static_cast<int>(cell.activity)];
  grid_.put(cell.id, cell.centre_um, body.box());
}

void Colony::wake(const std::vector<Woken>& woken) {
  CellId last{0};
  for (const Woken& one : woken) {
    CHECK(contains(one.cell_id) && last < one.cell_id);
    last = one.cell_id;
    Cell& cell = cells_[one.cell_id.value - 1];
    CHECK(cell.activity == Activity::kPassive);
    cell.free_share = one.free_share;
    cell.due_h = one.due_h;
    cell.try_count = 0;  // a change nearby: the tries count afresh
  }
}

void Colony::apply(const Event& event) {
  CHECK(!finished_);
  CHECK(event.seq == last_seq_ + 1);
  CHECK(event.time_h >= time_h_);
  CHECK(event.digest == digest_after(digest_, event));
  CHECK(event.cell_id.has_value() == (event.kind() != EventKind::kFinished));

  struct Apply {
    Colony& colony;
    const Event& event;
    Cell& subject() const {
      CHECK(colony.contains(*event.cell_id));
      Cell& cell = colony.cells_[event.cell_id->value - 1];
      ++cell.ordinal;
      return cell;
    }
    void operator()(const Founded& body) const {
      CHECK(body.cell.id == *event.cell_id && body.cell.id.value == colony.cells_.size() + 1);
      colony.put(body.cell);
    }
    void operator()(const Divided& body) const {
      const Cell& parent = colony.cell(*event.cell_id);
      CHECK(body.cells[0].id == parent.id && body.cells[0].ordinal == parent.ordinal + 1);
      CHECK(body.cells[1].id.value == colony.cells_.size() + 1 && body.cells[1].parent_id == parent.id);
      colony.put(body.cells[0]);
      colony.put(body.cells[1]);
      colony.wake(body.woken);
    }
    void operator()(const Inhibited& body) const {
      Cell& cell = subject();
      colony.set_activity(cell, Activity::kPassive);
      cell.free_share = body.free_share;
      cell.try_count = body.try_count;
      cell.due_h = body.due_h;
    }
    void operator()(const Settled& body) const {
      CHECK(colony.cell(*event.cell_id).settle_due_h.has_value());
      Cell& cell = subject();
      cell.nucleus_um = body.nucleus_um;
      cell.nearest_membrane_um = body.nearest_membrane_um;
      cell.deformed_volume_um3 = body.deformed_volume_um3;
      cell.settle_due_h.reset();
      cell.due_h = body.due_h;
    }
    void operator()(const Moved& body) const {
      const Cell& before = colony.cell(*event.cell_id);
      CHECK(body.cell.id == before.id && body.cell.ordinal == before.ordinal + 1);
      colony.put(body.cell);
      colony.wake(body.woken);
    }
    void operator()(const Senesced&) const {
      Cell& cell = subject();
      colony.set_activity(cell, Activity::kSenescent);
      cell.due_h.reset();
    }
    void operator()(const Finished& body) const {
      CHECK(body.cell_count == colony.cells_.size());
      colony.finished_ = body;
    }
  };
  std::visit(Apply{*this, event}, event.body);

  last_seq_ = event.seq;
  time_h_ = event.time_h;
  digest_ = event.digest;
}

}  // namespace colony
