// The bounds, and why they hold. Distances are Chebyshev's, in the plane; "within d of R" means inside R grown by d.
//
// Let B be the cell's box now, c its nucleus, r its centre (in B), f = wake.free_radius_um, H a body's largest half extent.
//
// The change W of an event decided now: a rectangle that holds every box that appears or goes.
//   division   W = hull(B, square of half side search_reach_um about c): candidates are placed about the pivot c, and the reach
//              is derived from the parameter ranges to hold each with its noise box; the parent's box B goes.
//   move       W = B grown by motility.step_um: the body keeps its shape.
//   settling   nothing: only the subject's own nucleus and membrane point, which nobody else reads.
// An undecided division may have other items of its own cell before it in the horizon, which change c and B. So what it may
// write later is bounded by W', the same with "a point of B" for c where a settling comes before (the nucleus comes to rest
// among points of B) or a move does, and then with B grown by step_um (one move at most: its delay is not shorter than the
// window). A move that is due after a division of its cell is left (the cell that keeps the id keeps it) and is one of a body that the
// division places: W' is B grown by search_reach_um (c is a point of B, or comes to be one) and step_um. Else, and for settlings, W' = W.
//
// What is written, of all that decisions about other cells read:
//   bodies     inside W'.
//   sleepers   (a cell is one if it is passive without due_h; its recorded share counts as part of that.) Only sleepers with
//              their centre within f of a changed box are woken: inside W' grown by f. The subject itself may fall asleep
//              (inhibited without due_h): r is inside W'; or, asleep, move: both its centres are. No other change is visible:
//              a cell with something due to divide is no sleeper before its attempt, and an active, senescent or retrying one
//              is none after it.
//
// What is read, beside the subject's own state (same cell: always a conflict):
//   division   bodies that meet the reach square (candidates' neighbours), B (isolation), the square of half side f about r
//              (free share of a failed search), all within f of W; with neighbour_retained_min > 0, also those that meet a box
//              that meets the reach square, hence within 2 H of W. For waking: sleepers with their centre within f of W, and
//              the bodies that meet a square of half side f about such a centre: within 2 f of W.
//   move       the same but for the reach: bodies that meet the new box, or the square about r (the freer half), and waking. A
//              sleeper that moves reads its own sleep: r is inside W.
//   settling   bodies that meet B.
// A settling carries the cell's due_h, which waking changes, but a cell that has not settled has never tried to divide
// (settle_due_h <= due_h), so it is no sleeper.
//
// Hence with p = max(f, H if neighbours are asked what they retain):
//   writes: bodies W', sleepers W' + f.     reads: bodies W + 2 p, sleepers W + f.
// What is not listed (ids, seq, digest, time) is given at the commit or fixed by the agenda.
#include "engine/sim/conflict.hpp"

#include <algorithm>

#include "engine/base/check.hpp"

namespace colony {
namespace {

// Rounding of sums of coordinates (|x| <= 1e9 um, ulp 1.2e-7) must never decide.
constexpr double kSlack_um = 1e-3;
constexpr std::size_t kBuckets = 4096;
constexpr double kFarthest_um = 2e9;           // the grid holds coordinates to 1e9

bool is_sleeper(const Cell& cell) { return cell.activity == Activity::kPassive && !cell.due_h; }

}  // namespace

bool meets(const Rect& a, const Rect& b) {
  return a.low.x() <= b.high.x() && b.low.x() <= a.high.x() && a.low.y() <= b.high.y() && b.low.y() <= a.high.y();
}

bool contains(const Rect& outer, const Rect& inner) {
  return inner.empty() || (outer.low.x() <= inner.low.x() && inner.high.x() <= outer.high.x() &&
                           outer.low.y() <= inner.low.y() && inner.high.y() <= outer.high.y());
}

Rect hull(const Rect& a, const Rect& b) { return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)}; }

Rect grown(const Rect& rect, double by_um) {
  return {rect.low - Vec2::Constant(by_um), rect.high + Vec2::Constant(by_um)};  // infinities stay
}

Rect rect_of(const Box& box) { return {box.low.head<2>(), box.high.head<2>()}; }
Rect rect_of(const Vec3& point_um) { return {point_um.head<2>(), point_um.head<2>()}; }

ConflictBounds::ConflictBounds(const Params& params, double scale)
    : noise_(params.noise),
      scale_(scale),
      reach_um_(search_reach_um(params)),
      step_um_(params.motility.step_um),
      free_radius_um_(params.wake.free_radius_um) {
  const double half_extent_um = body_half_extent_max_um(params);
  pad_um_ = params.contact.neighbour_retained_min > 0.0 ? std::max(free_radius_um_, half_extent_um) : free_radius_um_;
  // c and r lie in B, whose sides are at most 2 H.
  side_max_um_ = 2.0 * (reach_um_ + step_um_ + 2.0 * half_extent_um + 2.0 * pad_um_ + 4.0 * kSlack_um);
}

Rect ConflictBounds::scaled(const Rect& rect, const Vec3& about_um) const {
  if (scale_ == 1.0 || rect.empty()) return rect;
  const Vec2 about = about_um.head<2>();
  return {about + scale_ * (rect.low - about), about + scale_ * (rect.high - about)};
}

Rect ConflictBounds::change_now(const Colony& colony, const AgendaItem& item) const {
  if (item.kind == DueKind::kSettle) return {};
  const Rect body = rect_of(colony.body(item.cell_id).box());
  if (item.kind == DueKind::kMove) return grown(body, step_um_ + kSlack_um);
  return grown(hull(body, grown(rect_of(colony.cell(item.cell_id).nucleus_um), reach_um_)), kSlack_um);
}

Rect ConflictBounds::change_later(const Colony& colony, const AgendaItem& item) const {
  const Cell& cell = colony.cell(item.cell_id);
  const bool moves = cell.move_due_h && *cell.move_due_h <= item.due_h;
  if (item.kind == DueKind::kMove && cell.due_h && *cell.due_h <= item.due_h) {
    return grown(rect_of(colony.body(item.cell_id).box()), reach_um_ + step_um_ + kSlack_um);  // of a body that the division places
  }
  if (item.kind != DueKind::kDivide || (!cell.settle_due_h && !moves)) return change_now(colony, item);
  return grown(rect_of(colony.body(item.cell_id).box()), reach_um_ + (moves ? step_um_ : 0.0) + kSlack_um);
}

Writes ConflictBounds::writes(const Colony& colony, const AgendaItem& item) const {
  const Rect change_um = change_later(colony, item);
  const Vec3& centre_um = colony.cell(item.cell_id).centre_um;
  return {item.cell_id, scaled(change_um, centre_um), scaled(grown(change_um, free_radius_um_ + kSlack_um), centre_um)};
}

Reads ConflictBounds::reads(const Colony& colony, const AgendaItem& item) const {
  const Vec3& centre_um = colony.cell(item.cell_id).centre_um;
  if (item.kind == DueKind::kSettle) {
    return {item.cell_id, scaled(grown(rect_of(colony.body(item.cell_id).box()), kSlack_um), centre_um), {}};
  }
  const Rect change_um = change_now(colony, item);
  return {item.cell_id, scaled(grown(change_um, 2.0 * (pad_um_ + kSlack_um)), centre_um),
          scaled(grown(change_um, free_radius_um_ + kSlack_um), centre_um)};
}

Writes ConflictBounds::writes(const Colony& colony, const AgendaItem& item, const EventBody& decided) const {
  Writes out;
  out.cell_id = item.cell_id;
  const Vec3& centre_um = colony.cell(item.cell_id).centre_um;
  const auto replace = [&](const Cell& cell) { out.bodies = hull(out.bodies, rect_of(Body(geometry_of(cell), noise_).box())); };
  const auto wake = [&](const std::vector<Woken>& woken) {
    for (const Woken& one : woken) out.sleepers = hull(out.sleepers, rect_of(colony.cell(one.cell_id).centre_um));
  };
  if (const auto* divided = std::get_if<Divided>(&decided)) {
    out.bodies = rect_of(colony.body(item.cell_id).box());
    for (const Cell& cell : divided->cells) replace(cell);
    wake(divided->woken);
  } else if (const auto* moved = std::get_if<Moved>(&decided)) {
    out.bodies = rect_of(colony.body(item.cell_id).box());
    replace(moved->cell);
    wake(moved->woken);
    if (is_sleeper(colony.cell(item.cell_id))) {
      out.sleepers = hull(out.sleepers, hull(rect_of(centre_um), rect_of(moved->cell.centre_um)));
    }
  } else if (const auto* inhibited = std::get_if<Inhibited>(&decided)) {
    if (!inhibited->due_h) out.sleepers = rect_of(centre_um);
  }
  out.bodies = scaled(grown(out.bodies, kSlack_um), centre_um);
  out.sleepers = scaled(out.sleepers, centre_um);
  return out;
}

ConflictIndex::ConflictIndex(double square_um, std::size_t capacity)
    : square_um_(square_um), capacity_(capacity), buckets_(kBuckets, -1) {
  CHECK(square_um > 0.0 && capacity > 0 && (capacity & (capacity - 1)) == 0);
}

void ConflictIndex::clear() {
  std::fill(buckets_.begin(), buckets_.end(), -1);
  entries_.clear();
}

template <class Visit>
void ConflictIndex::visit_squares(const Rect& rect, Visit&& visit) const {
  const auto column = [&](double at_um) { return static_cast<std::int64_t>((at_um + kFarthest_um) / square_um_); };
  for (std::int64_t x = column(rect.low.x()); x <= column(rect.high.x()); ++x) {
    for (std::int64_t y = column(rect.low.y()); y <= column(rect.high.y()); ++y) {
      const auto mixed = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U +
                         static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FU;
      visit(static_cast<std::size_t>((mixed >> 40) % kBuckets));
    }
  }
}

void ConflictIndex::list(std::uint64_t number) {
  visit_squares(place(number).listed, [&](std::size_t bucket) {
    entries_.push_back({number, buckets_[bucket]});
    buckets_[bucket] = static_cast<std::int32_t>(entries_.size() - 1);
  });
}

void ConflictIndex::add(std::uint64_t number, std::uint64_t first, const Writes& writes, const Vec3& centre_um) {
  CHECK(number >= first && number - first < capacity_);
  places_.resize(capacity_);
  if (entries_.size() > 4 * capacity_) {  // mostly committed ones
    clear();
    for (std::uint64_t one = first; one < number; ++one) list(one);
  }
  place(number) = {writes, hull(hull(writes.bodies, writes.sleepers), rect_of(centre_um))};
  list(number);
}

std::optional<std::uint64_t> ConflictIndex::find(const Reads& reads, std::uint64_t first, std::uint64_t end) const {
  std::optional<std::uint64_t> found;
  visit_squares(hull(reads.bodies, reads.sleepers), [&](std::size_t bucket) {
    for (std::int32_t at = buckets_[bucket]; at >= 0 && !found; at = entries_[static_cast<std::size_t>(at)].next) {
      const std::uint64_t number = entries_[static_cast<std::size_t>(at)].number;
      if (number < first) return;
      if (number < end && conflicts(place(number).writes, reads)) found = number;
    }
  });
  return found;
}

}  // namespace colony
