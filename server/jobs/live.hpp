// live: what is known of jobs at this moment: who watches them, what is asked of their runners, how fast they grow.
// Promise: progress is that of the last commit; a watcher is woken after the commit, never before.
// Threads: every function from any thread.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>

#include "engine/base/stop.hpp"
#include "server/jobs/service.hpp"

namespace colony::server {

/// Tells those who follow a job, or all jobs, what is new.
class Hub : public std::enable_shared_from_this<Hub> {
 public:
  std::unique_ptr<JobService::Subscription> follow(std::optional<std::int64_t> job_key,
                                                   std::function<void(const JobNews&)> hear);
  /// Runs the functions of those who follow this job, and of those who follow all, on the calling thread.
  void announce(const JobNews& news);

 private:
  class Entry;
  // Held while these functions run: a subscription that is gone is never called. So they must not come back here.
  std::mutex mutex_;  // guards everything below
  std::map<std::optional<std::int64_t>, std::set<Entry*>> followers_;  // nullopt: of all jobs
};

/// One job between the moment a runner takes it and the moment the runner leaves it.
class LiveJob {
 public:
  enum class Wish : std::uint8_t { kNone, kDrain, kPause, kCancel };
  explicit LiveJob(const JobRow& job);

  /// Asks the runner to stop, also in the middle of a step. A stronger wish (later in the list) replaces a weaker one; none is
  /// ever withdrawn.
  void ask(Wish wish);
  Wish wish() const {
    (void)stop_.load();  // so that who has seen the flag (polled without ordering) sees the wish too
    return wish_.load();
  }
  /// Set from the first wish on; who has seen it set finds a wish.
  StopFlag stop_flag() const { return &stop_; }

  /// After a commit: `job` as stored.
  void committed(const JobRow& job);
  /// Of work that commits nothing on its way (verifying). Not the row's last_seq: the job's own, which stays.
  void progressed(const Progress& progress);
  bool has_committed() const { return has_committed_.load(std::memory_order_acquire); }
  Progress progress() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Sample {
    Clock::time_point at;
    std::uint64_t cells;
    double fraction;
  };

  std::atomic<Wish> wish_{Wish::kNone};
  std::atomic<bool> stop_{false};  // set after wish_
  std::atomic<bool> has_committed_{false};
  const std::optional<double> until_time_h_;  // fixed after construction
  const std::optional<std::uint64_t> until_cells_;
  mutable std::mutex mutex_;    // guards everything below
  Progress last_;               // without rates
  std::deque<Sample> samples_;  // of the last seconds, at most kSamplesMax
};

/// Progress as the row alone tells it (no rates).
Progress progress_of(const JobRow& job);

}  // namespace colony::server
