// past: colonies and growth curves at past moments, folded from the stored events and kept for the next question.
// Promise: what is kept has at most colonies_max colonies of cells_max cells together; a colony that is larger alone is not kept.
//          Growth curves take kCurveBytesMax together; a job that is larger alone is folded at every question.
// Method:  a fold starts from the nearest kept earlier fold of the same job, else from the first event.
// Errors:  as the store's; kUnavailable after stop() for what is not kept; kInternal when a stored history does not fold (its digest chain is checked on the way).
// Threads: every function from any thread; two threads may fold the same moment, and either answer is kept.
#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "server/jobs/service.hpp"

namespace colony::server {

class Past {
 public:
  Past(Store& store, const SpecDecoder& decode, std::size_t colonies_max, std::uint64_t cells_max);

  /// Ends every fold under way and to come.
  void stop() { stop_.store(true); }

  /// The colony after event `seq` (0: before the first).
  Result<ColonyAt> colony_after(const JobRow& job, std::uint64_t seq);
  /// `points` rows from 0 to the time of event job.last_seq; one row if that time is 0.
  Result<std::vector<SeriesRow>> series(const JobRow& job, std::size_t points);
  /// The job is gone.
  void forget(std::int64_t job_key);

 private:
  struct Curve;
  std::shared_ptr<Curve> curve_of(const JobRow& job, const RunSpec& spec);
  Result<std::vector<SeriesRow>> series_along(const JobRow& job, Curve& curve, std::size_t points);
  void keep(const JobRow& job, const std::shared_ptr<const Colony>& colony, const std::shared_ptr<const RunSpec>& spec);

  struct KeptColony {
    std::int64_t job_key;
    std::uint64_t seq;
    std::shared_ptr<const Colony> colony;
    std::shared_ptr<const RunSpec> spec;
  };
  struct KeptSeries {
    std::int64_t job_key;
    std::uint64_t last_seq;
    std::size_t points;
    std::vector<SeriesRow> rows;
  };

  Store& store_;  // fixed after construction
  const SpecDecoder& decode_;
  const std::size_t colonies_max_;
  const std::uint64_t cells_max_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;                // guards everything below
  std::list<KeptColony> colonies_;  // used last: first; at most colonies_max_
  std::uint64_t kept_cells_ = 0;    // in colonies_; at most cells_max_
  std::list<KeptSeries> series_;    // used last: first; at most kSeriesMax
  std::list<std::shared_ptr<Curve>> curves_;  // used last: first
};

}  // namespace colony::server
