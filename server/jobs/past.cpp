#include "server/jobs/past.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <string>
#include <utility>

#include "engine/base/stop.hpp"

namespace colony::server {
namespace {

constexpr std::size_t kPage = 2000;
constexpr std::size_t kSeriesMax = 32;
constexpr std::size_t kCurveBytesMax = 256 << 20;
constexpr std::size_t kCurveBytesACell = 700;  // the colony and its tracker (engine/DESIGN.md)

Error stopped() { return {ErrorCode::kUnavailable, "the server is shutting down"}; }

Error does_not_fold(const JobRow& job, std::uint64_t seq, const std::string& why) {
  return {ErrorCode::kInternal,
          "the stored history of job " + job.id + " does not fold at event " + std::to_string(seq) + ": " + why};
}

Error spec_is_unusable(const JobRow& job, const Error& error) {
  return {ErrorCode::kInternal, "the stored spec of job " + job.id + " cannot be used: " + error.message};
}

/// Calls `use(event)` for every event with after < seq <= last, page by page. What it throws becomes an error that names the event.
template <class Use>
Status for_each_event(Store& store, StopFlag stop, const JobRow& job, std::uint64_t after, std::uint64_t last, Use use) {
  EventFilter filter;
  filter.after = after;
  while (filter.after < last) {
    throw_if_stopped(stop);
    const auto page = store.read_events(job.job_key, filter, std::min<std::uint64_t>(kPage, last - filter.after));
    if (!page) return page.error();
    if (page->empty()) return does_not_fold(job, filter.after + 1, "it is not there");
    for (const Event& event : *page) {
      throw_if_stopped(stop);
      try {
        use(event);
      } catch (const std::exception& error) {
        return does_not_fold(job, event.seq, error.what());
      }
    }
    filter.after = page->back().seq;
  }
  return Ok{};
}

}  // namespace

/// The growth curve of a job that may go on: its row after every event that changes it, and the colony from which the next ones follow. A dashboard asks every
/// few seconds for a curve that has grown by a few events, and its points then lie at other times: without all rows the whole history would
/// be folded again.
struct Past::Curve {
  Curve(const JobRow& job, const RunSpec& spec) : job_key(job.job_key), colony(spec.params), tracker(colony) {}
  const std::int64_t job_key;
  std::atomic<std::size_t> bytes{0};  // for who does not hold the lock
  std::mutex mutex;                   // guards everything below
  Colony colony;
  SeriesTracker tracker;
  struct Step {
    std::uint64_t seq;
    SeriesRow row;  // at the time of that event; the ones after it, up to the next step, leave all but the time as it is
  };
  std::vector<Step> steps;

  void follow(const Event& event) {
    colony.apply(event);
    tracker.follow(event, colony);
    const SeriesRow row = tracker.row(event.time_h);
    SeriesRow last = steps.empty() ? SeriesRow{} : steps.back().row;
    last.time_h = row.time_h;
    if (!(row == last)) steps.push_back({event.seq, row});
  }
};

Past::Past(Store& store, const SpecDecoder& decode, std::size_t colonies_max, std::uint64_t cells_max)
    : store_(store), decode_(decode), colonies_max_(colonies_max), cells_max_(cells_max) {}

Result<ColonyAt> Past::colony_after(const JobRow& job, std::uint64_t seq) {
  std::shared_ptr<const Colony> start;
  std::shared_ptr<const RunSpec> spec;
  {
    const std::lock_guard lock(mutex_);
    auto best = colonies_.end();
    for (auto kept = colonies_.begin(); kept != colonies_.end(); ++kept) {
      if (kept->job_key != job.job_key || kept->seq > seq) continue;
      if (best == colonies_.end() || kept->seq > best->seq) best = kept;
    }
    if (best != colonies_.end()) {
      colonies_.splice(colonies_.begin(), colonies_, best);
      start = best->colony;
      spec = best->spec;
      if (best->seq == seq) return ColonyAt{start, spec, start->time_h(), start->digest()};
    }
  }
  if (spec == nullptr) {
    auto decoded = decode_(job.spec_json);
    if (!decoded) return spec_is_unusable(job, decoded.error());
    spec = std::make_shared<const RunSpec>(std::move(*decoded));
  }
  try {
    auto colony = start != nullptr ? std::make_shared<Colony>(*start) : std::make_shared<Colony>(spec->params);
    const Status folded = for_each_event(store_, &stop_, job, colony->last_seq(), seq,
                                         [&](const Event& event) { colony->apply(event); });
    if (!folded) return folded.error();
    keep(job, colony, spec);
    return ColonyAt{colony, spec, colony->time_h(), colony->digest()};
  } catch (const Stopped&) {
    return stopped();
  } catch (const std::exception& error) {
    return does_not_fold(job, start != nullptr ? start->last_seq() + 1 : 1, error.what());
  }
}

void Past::keep(const JobRow& job, const std::shared_ptr<const Colony>& colony,
                const std::shared_ptr<const RunSpec>& spec) {
  const std::uint64_t seq = colony->last_seq();
  const std::uint64_t cells = colony->cells().size();
  const std::lock_guard lock(mutex_);
  const auto same = [&](const KeptColony& kept) { return kept.job_key == job.job_key && kept.seq == seq; };
  if (cells > cells_max_ || colonies_max_ == 0 || std::any_of(colonies_.begin(), colonies_.end(), same)) return;
  colonies_.push_front({job.job_key, seq, colony, spec});
  kept_cells_ += cells;
  while (colonies_.size() > colonies_max_ || kept_cells_ > cells_max_) {
    kept_cells_ -= colonies_.back().colony->cells().size();
    colonies_.pop_back();
  }
}

Result<std::vector<SeriesRow>> Past::series(const JobRow& job, std::size_t points) {
  {
    const std::lock_guard lock(mutex_);
    for (auto kept = series_.begin(); kept != series_.end(); ++kept) {
      if (kept->job_key != job.job_key || kept->last_seq != job.last_seq || kept->points != points) continue;
      series_.splice(series_.begin(), series_, kept);
      return kept->rows;
    }
  }
  const auto spec = decode_(job.spec_json);
  if (!spec) return spec_is_unusable(job, spec.error());
  const std::shared_ptr<Curve> curve = curve_of(job, *spec);
  auto rows = series_along(job, *curve, points);
  const std::lock_guard lock(mutex_);
  std::size_t kept_bytes = 0;
  curves_.remove_if([&](const std::shared_ptr<Curve>& one) {
    const std::size_t bytes = one->bytes.load();
    const bool is_too_much = (one == curve && !rows) || kept_bytes + bytes > kCurveBytesMax;
    if (!is_too_much) kept_bytes += bytes;
    return is_too_much;
  });
  if (!rows) return rows;
  series_.push_front({job.job_key, job.last_seq, points, *rows});
  if (series_.size() > kSeriesMax) series_.pop_back();
  return rows;
}

std::shared_ptr<Past::Curve> Past::curve_of(const JobRow& job, const RunSpec& spec) {
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(curves_.begin(), curves_.end(), [&](const auto& one) { return one->job_key == job.job_key; });
  if (known == curves_.end()) {
    curves_.push_front(std::make_shared<Curve>(job, spec));
  } else {
    curves_.splice(curves_.begin(), curves_, known);
  }
  return curves_.front();
}

Result<std::vector<SeriesRow>> Past::series_along(const JobRow& job, Curve& curve, std::size_t points) {
  const std::lock_guard lock(curve.mutex);
  try {
    const Status folded = for_each_event(store_, &stop_, job, curve.colony.last_seq(), job.last_seq,
                                         [&](const Event& event) { curve.follow(event); });
    curve.bytes = curve.colony.cells().size() * kCurveBytesACell + curve.steps.capacity() * sizeof(Curve::Step);
    if (!folded) return folded.error();
  } catch (const Stopped&) {
    return stopped();
  } catch (const std::exception& error) {
    return does_not_fold(job, curve.colony.last_seq() + 1, error.what());
  }
  const double end_h = job.time_h;
  const std::size_t count = end_h > 0.0 ? points : 1;
  // Another question may have led the curve beyond the moment of this one.
  const auto end = std::upper_bound(curve.steps.begin(), curve.steps.end(), job.last_seq,
                                    [](std::uint64_t seq, const Curve::Step& step) { return seq < step.seq; });
  std::vector<SeriesRow> rows;
  for (std::size_t k = 0; k < count; ++k) {
    const double time_h = k + 1 == count ? end_h : end_h * static_cast<double>(k) / static_cast<double>(count - 1);
    const auto next = std::upper_bound(curve.steps.begin(), end, time_h,
                                       [](double at_h, const Curve::Step& step) { return at_h < step.row.time_h; });
    rows.push_back(next == curve.steps.begin() ? SeriesRow{} : std::prev(next)->row);
    rows.back().time_h = time_h;
  }
  return rows;
}

void Past::forget(std::int64_t job_key) {
  const std::lock_guard lock(mutex_);
  colonies_.remove_if([&](const KeptColony& kept) {
    if (kept.job_key == job_key) kept_cells_ -= kept.colony->cells().size();
    return kept.job_key == job_key;
  });
  series_.remove_if([&](const KeptSeries& kept) { return kept.job_key == job_key; });
  curves_.remove_if([&](const auto& one) { return one->job_key == job_key; });
}

}  // namespace colony::server
