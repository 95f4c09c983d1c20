// series: the growth curve, one row a moment; measured at once (measure_series) or kept along a history (SeriesTracker).
// Promise: a row is a function of the colony alone: whichever way it was reached, the bits are the same.
// Method:  area = union of the noise-free projections on a 1 um grid anchored at the origin; radius = sqrt(area / pi). Volumes are
//          rounded to 2^-24 um3 and summed as integers: no order of summation, no drift, no cancellation.
// Units:   h, um, um2, um3, cells per mm2.
// Memory:  a tracker takes 80 bytes a cell and its Coverage: about 215 bytes a cell in a confluent layer.
// Errors:  CHECKs that a volume lies in [0, 2^24) um3 and that a tracker is told every event.
// Threads: measure_series is pure; a tracker is exclusive.
#pragma once

#include <cstdint>
#include <deque>

#include "engine/analysis/coverage.hpp"
#include "engine/model/colony.hpp"

namespace colony {

struct SeriesRow {
  double time_h = 0.0;
  std::uint64_t cell_count = 0, active_count = 0, passive_count = 0, senescent_count = 0;
  double volume_mean_um3 = 0.0;
  double volume_sd_um3 = 0.0;      // of the population (divides by n)
  double radius_um = 0.0;
  double area_um2 = 0.0;
  double density_per_mm2 = 0.0;    // cells / area
  friend bool operator==(const SeriesRow&, const SeriesRow&) = default;
};

/// The row of `colony` at `time_h` (zeros for a colony without cells). Time in proportion to the cells.
SeriesRow measure_series(const Colony& colony, double time_h);

/// Sums of cell volumes and of their squares, exact.
class VolumeSums {
 public:
  void add(double volume_um3);
  void remove(double volume_um3);
  double mean_um3() const;  // 0 of none
  double sd_um3() const;    // of the population; 0 of none

 private:
  __extension__ using Wide = unsigned __int128;
  static std::uint64_t units_of(double volume_um3);

  // Units of 2^-24 um3: a volume has at most 48 bits, its square 96, and 2^32 cells are as many as there are ids.
  std::uint64_t count_ = 0;
  Wide sum_ = 0;
  Wide squares_ = 0;
};

/// Follows one colony and knows its row at any moment: an event costs some microseconds, a row nothing, however many the cells.
class SeriesTracker {
 public:
  /// From `colony` as it is.
  explicit SeriesTracker(const Colony& colony);
  SeriesTracker(const SeriesTracker&) = delete;  // large: a copy would be a mistake
  SeriesTracker& operator=(const SeriesTracker&) = delete;

  /// Call after every Colony::apply, with the colony as it is then.
  void follow(const Event& event, const Colony& colony);
  /// measure_series(colony, time_h) of the colony last followed.
  SeriesRow row(double time_h) const;

 private:
  // What has to be taken back when the cell gets another body. Floats would be half of it, and another footprint.
  struct Kept {
    Vec3 centre_um, semiaxes_um, rotation_rad;
    double volume_um3;
  };
  void put(const Colony& colony, CellId id);
  void count_activities(const Colony& colony);

  const NoiseParams noise_;  // fixed after construction
  std::deque<Kept> kept_;    // by id.value - 1; a deque, so that growing never doubles it
  Coverage coverage_;
  VolumeSums volumes_;
  std::uint64_t last_seq_;
  std::uint64_t active_count_ = 0, passive_count_ = 0, senescent_count_ = 0;
};

}  // namespace colony
