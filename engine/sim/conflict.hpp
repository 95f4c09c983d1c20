// conflict: what an event can read and write, as squares in the plane, known before it is decided.
// Method:  two events conflict when what the earlier writes can meet what the later reads; the later one then waits until
//          the earlier is applied. Only x and y count: a bound in the plane holds for one layer as for several, where reach
//          and free share are balls inside the same squares.
// Units:   um.
// Threads: pure.
// Source:  the model of the paper, section 5; the proof is in conflict.cpp, beside the numbers it is about.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "engine/base/types.hpp"
#include "engine/model/colony.hpp"
#include "engine/model/event.hpp"
#include "engine/model/params.hpp"
#include "engine/sim/agenda.hpp"

namespace colony {

/// Axis-parallel, closed; empty unless set.
struct Rect {
  Vec2 low = Vec2::Constant(std::numeric_limits<double>::infinity());
  Vec2 high = Vec2::Constant(-std::numeric_limits<double>::infinity());
  bool empty() const { return !(low.x() <= high.x() && low.y() <= high.y()); }
};
bool meets(const Rect& a, const Rect& b);      // an empty one meets nothing
bool contains(const Rect& outer, const Rect& inner);
Rect hull(const Rect& a, const Rect& b);
Rect grown(const Rect& rect, double by_um);    // an empty one stays empty
Rect rect_of(const Box& box);
Rect rect_of(const Vec3& point_um);

/// Where an event changes something that a decision about another cell may read.
struct Writes {
  CellId cell_id;                              // the subject: all about it is written
  Rect bodies;                                 // holds the boxes of all bodies that appear or go
  Rect sleepers;                               // holds the centres of all cells that fall asleep or are woken
};
/// What a decision depends on, beside everything about its subject.
struct Reads {
  CellId cell_id;
  Rect bodies;                                 // bodies whose box does not meet it do not matter
  Rect sleepers;                               // whether a cell sleeps does not matter with its centre outside
};

/// Whether `later`, decided on the colony without `earlier`, could come out differently.
inline bool conflicts(const Writes& earlier, const Reads& later) {
  return earlier.cell_id == later.cell_id || meets(earlier.bodies, later.bodies) || meets(earlier.sleepers, later.sleepers);
}

class ConflictBounds {
 public:
  /// `scale` is for tests: below 1 the bounds are wrong on purpose (all squares shrink about the cell's centre).
  explicit ConflictBounds(const Params& params, double scale = 1.0);

  /// What handling `item` can write, whatever the decision, and whatever other items of the horizon, those of the same cell
  /// among them, do before it.
  Writes writes(const Colony& colony, const AgendaItem& item) const;
  /// What deciding it on this colony can read.
  Reads reads(const Colony& colony, const AgendaItem& item) const;
  /// What it writes now that it is decided: inside writes().
  Writes writes(const Colony& colony, const AgendaItem& item, const EventBody& decided) const;

  /// No rectangle above is wider or higher.
  double side_max_um() const { return side_max_um_; }

 private:
  Rect change_now(const Colony& colony, const AgendaItem& item) const;
  Rect change_later(const Colony& colony, const AgendaItem& item) const;
  Rect scaled(const Rect& rect, const Vec3& about_um) const;

  // Fixed after construction; um.
  NoiseParams noise_;
  double scale_;
  double reach_um_;                            // of a division, about the nucleus
  double step_um_;                             // of a move, about the box
  double free_radius_um_;
  double pad_um_;                              // bodies are read up to twice this beyond the change
  double side_max_um_;
};

/// The writes of items, which have ascending numbers in serial order, to be asked which of them an item conflicts with.
/// Rectangles are listed under the coarse squares they touch, so a question costs what is near, not what there is.
class ConflictIndex {
 public:
  /// `square_um`: at least the side of any rectangle, so that each touches at most four squares. `capacity`: a power of two;
  /// more consecutive numbers than this are never alive at once.
  ConflictIndex(double square_um, std::size_t capacity);
  void clear();
  /// `number`: above all before. `first`: items below it are committed and will not be found again. `centre_um`: of the
  /// subject; a later item of the same cell is found by it, also where nothing else is written.
  void add(std::uint64_t number, std::uint64_t first, const Writes& writes, const Vec3& centre_um);
  /// `inside`: within what was added with that number.
  void narrow(std::uint64_t number, const Writes& inside) { place(number).writes = inside; }
  /// Some number in [first, end) with which `reads` conflict; none if there is none.
  std::optional<std::uint64_t> find(const Reads& reads, std::uint64_t first, std::uint64_t end) const;

 private:
  struct Place {
    Writes writes;
    Rect listed;                               // it is listed under the squares of this
  };
  struct Entry {
    std::uint64_t number = 0;
    std::int32_t next = -1;                    // of the same bucket; numbers descend
  };
  Place& place(std::uint64_t number) { return places_[number & (capacity_ - 1)]; }
  const Place& place(std::uint64_t number) const { return places_[number & (capacity_ - 1)]; }
  void list(std::uint64_t number);
  template <class Visit>
  void visit_squares(const Rect& rect, Visit&& visit) const;

  double square_um_;
  std::size_t capacity_;
  std::vector<std::int32_t> buckets_;          // head entry or -1. Two squares may share one: rectangles are compared anyway
  std::vector<Entry> entries_;
  std::vector<Place> places_;                  // by number modulo capacity; made at the first add: one thread needs none
};

}  // namespace colony
