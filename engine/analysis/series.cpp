#include "engine/analysis/series.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr double kUm2PerMm2 = 1e6;
constexpr double kUnitsPerUm3 = 16'777'216.0;  // 2^24
constexpr double kVolumeMax_um3 = 16'777'216.0;

/// Grid cells in the union. Spans, not a bitmap: the memory follows the cells, however far apart they lie.
std::uint64_t union_area_um2(const Colony& colony) {
  std::vector<RowSpan> spans;
  for (const Cell& cell : colony.cells()) add_spans(colony.body(cell.id), spans);
  std::sort(spans.begin(), spans.end());
  std::uint64_t area_um2 = 0;
  for (std::size_t i = 0; i < spans.size();) {
    std::int32_t last = spans[i].last;
    std::size_t next = i + 1;
    for (; next < spans.size() && spans[next].row == spans[i].row && spans[next].first <= last + 1; ++next) {
      last = std::max(last, spans[next].last);
    }
    area_um2 += static_cast<std::uint64_t>(last - spans[i].first) + 1;
    i = next;
  }
  return area_um2;
}

/// What follows from the counts of `row`, the volumes and the area.
void complete(SeriesRow& row, const VolumeSums& volumes, std::uint64_t area_um2) {
  row.volume_mean_um3 = volumes.mean_um3();
  row.volume_sd_um3 = volumes.sd_um3();
  row.area_um2 = static_cast<double>(area_um2);
  row.radius_um = std::sqrt(row.area_um2 / maths::kPi);
  // Bodies too small to hold the centre of any grid cell have no area here, and then no density.
  if (row.area_um2 > 0.0) row.density_per_mm2 = static_cast<double>(row.cell_count) / row.area_um2 * kUm2PerMm2;
}

}  // namespace

std::uint64_t VolumeSums::units_of(double volume_um3) {
  CHECK(volume_um3 >= 0.0 && volume_um3 < kVolumeMax_um3);
  return static_cast<std::uint64_t>(volume_um3 * kUnitsPerUm3 + 0.5);
}

void VolumeSums::add(double volume_um3) {
  const Wide units = units_of(volume_um3);
  ++count_;
  sum_ += units;
  squares_ += units * units;
}

void VolumeSums::remove(double volume_um3) {
  const Wide units = units_of(volume_um3);
  CHECK(count_ > 0 && sum_ >= units && squares_ >= units * units);
  --count_;
  sum_ -= units;
  squares_ -= units * units;
}

double VolumeSums::mean_um3() const {
  if (count_ == 0) return 0.0;
  return static_cast<double>(sum_) / static_cast<double>(count_) / kUnitsPerUm3;
}

double VolumeSums::sd_um3() const {
  if (count_ == 0) return 0.0;
  // About the whole number m below the mean, sum = n m + r: the sum of (v - m)^2 = squares - m (sum + r) is an exact integer, and
  // the sum about the mean is that less r^2 / n, with r < n. The subtraction is harmless: each unit of r comes from a cell
  // that lies at least one unit above m, so r^2 / n is at most r / n of the first term.
  const Wide m = sum_ / count_;
  const Wide r = sum_ % count_;
  const auto about_m = static_cast<double>(squares_ - m * (sum_ + r));
  const auto rest = static_cast<double>(r);
  const auto count = static_cast<double>(count_);
  return std::sqrt((about_m - rest * rest / count) / count) / kUnitsPerUm3;
}

SeriesRow measure_series(const Colony& colony, double time_h) {
  SeriesRow row;
  row.time_h = time_h;
  row.cell_count = colony.cells().size();
  row.active_count = colony.count(Activity::kActive);
  row.passive_count = colony.count(Activity::kPassive);
  row.senescent_count = colony.count(Activity::kSenescent);
  VolumeSums volumes;
  for (const Cell& cell : colony.cells()) volumes.add(cell.volume_um3);
  complete(row, volumes, union_area_um2(colony));
  return row;
}

SeriesTracker::SeriesTracker(const Colony& colony) : noise_(colony.noise()), last_seq_(colony.last_seq()) {
  for (const Cell& cell : colony.cells()) put(colony, cell.id);
  count_activities(colony);
}

void SeriesTracker::put(const Colony& colony, CellId id) {
  const Cell& cell = colony.cell(id);
  const std::size_t index = id.value - std::size_t{1};
  CHECK(index <= kept_.size());
  if (index == kept_.size()) {
    kept_.emplace_back();
  } else {
    const Kept& before = kept_[index];
    // The footprint is that of the smooth ellipsoid: the noise offset does not matter.
    coverage_.remove(Body({before.centre_um, before.semiaxes_um, before.rotation_rad, Vec3::Zero()}, noise_));
    volumes_.remove(before.volume_um3);
  }
  kept_[index] = {cell.centre_um, cell.semiaxes_um, cell.rotation_rad, cell.volume_um3};
  coverage_.add(colony.body(id));
  volumes_.add(cell.volume_um3);
}

void SeriesTracker::count_activities(const Colony& colony) {
  active_count_ = colony.count(Activity::kActive);
  passive_count_ = colony.count(Activity::kPassive);
  senescent_count_ = colony.count(Activity::kSenescent);
}

void SeriesTracker::follow(const Event& event, const Colony& colony) {
  CHECK(event.seq == last_seq_ + 1 && colony.last_seq() == event.seq);
  last_seq_ = event.seq;
  if (const auto* founded = std::get_if<Founded>(&event.body)) {
    put(colony, founded->cell.id);
  } else if (const auto* divided = std::get_if<Divided>(&event.body)) {
    for (const Cell& cell : divided->cells) put(colony, cell.id);
  } else if (const auto* moved = std::get_if<Moved>(&event.body)) {
    put(colony, moved->cell.id);
  }
  count_activities(colony);
}

SeriesRow SeriesTracker::row(double time_h) const {
  SeriesRow row;
  row.time_h = time_h;
  row.cell_count = kept_.size();
  row.active_count = active_count_;
  row.passive_count = passive_count_;
  row.senescent_count = senescent_count_;
  complete(row, volumes_, coverage_.area_um2());
  return row;
}

}  // namespace colony
