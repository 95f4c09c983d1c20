// local_service: the JobService that grows colonies on threads of this process. Not for use outside this folder.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/live.hpp"
#include "server/jobs/past.hpp"
#include "server/jobs/runner.hpp"
#include "server/jobs/service.hpp"

namespace colony::server {

class LocalJobService final : public JobService {
 public:
  LocalJobService(Store& store, JobsConfig config, SpecDecoder decode, VerifyCodec verify);
  ~LocalJobService() override;

  Status start() override;
  void drain() override;

  Result<Submitted> submit(const NewJob& job) override;
  Result<std::optional<JobView>> submitted_before(const NewJob& job) override;
  Result<ForkPoint> fork_point(const std::string& id, std::optional<double> at_h,
                               std::optional<std::uint64_t> at_seq) override;
  Result<Submitted> fork(const NewJob& job, const ForkPoint& point) override;
  Result<JobView> show(const std::string& id) override;
  std::uint64_t commit_count() const override { return store_.commit_count(); }
  Result<JobView> show(std::int64_t job_key) override;
  std::optional<Progress> live_progress(std::int64_t job_key) override;
  Result<Page> list(const JobFilter& filter, std::size_t limit, const std::string& cursor) override;
  Result<std::vector<std::uint64_t>> counts() override;

  Result<Commanded> cancel(const std::string& id, const std::string& actor, const RevisionCondition& condition) override;
  Result<Commanded> pause(const std::string& id, const std::string& actor, const RevisionCondition& condition) override;
  Result<Commanded> resume(const std::string& id, const std::string& actor, const RevisionCondition& condition) override;
  Result<Removed> remove(const std::string& id, const RevisionCondition& condition) override;
  Result<Edited> edit(const std::string& id, const JobTextChange& change,
                      const RevisionCondition& condition, const std::string& actor) override;

  Result<std::vector<Event>> events(const std::string& id, const EventFilter& filter, std::size_t limit) override;
  Result<std::optional<std::uint64_t>> page_end(const std::string& id, const EventFilter& filter,
                                                std::size_t limit) override;
  Result<std::vector<LogRow>> log(const std::string& id, std::int64_t after_index, std::size_t limit) override;
  Result<ColonyAt> colony_at(const std::string& id, std::optional<double> at_h) override;
  Result<Moment> moment(const std::string& id, std::optional<double> at_h) override;
  Result<std::vector<SeriesRow>> series(const std::string& id, std::size_t points) override;

  std::unique_ptr<Subscription> subscribe(std::int64_t job_key, std::function<void()> wake) override;
  std::unique_ptr<Subscription> follow(std::optional<std::int64_t> job_key,
                                       std::function<void(const JobNews&)> hear) override;
  Store& store() override { return store_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Stalled {
    std::uint64_t ticket = 0;  // never used twice: tells this stop from a later one of the same job
    std::chrono::milliseconds pause{0};
    Clock::time_point retry_at;
  };

  void run_loop();
  /// The next job with its live half, registered; nullptr in `second` if there is none.
  Result<std::pair<JobRow, std::shared_ptr<LiveJob>>> take();
  /// The runner of `live` has written its last and gives the job back.
  void leave(const JobRow& job, const std::shared_ptr<LiveJob>& live, RunEnd end);
  void retry_loop();
  void retention_loop();
  /// Puts a stalled job back to work if the store allows it; false: not yet.
  bool retry(std::int64_t job_key, std::uint64_t ticket);
  bool is_stalled(std::int64_t job_key, std::uint64_t ticket) const;  // mutex_ is held
  void nudge_runners();
  void forget(const JobRow& job);  // it was deleted
  JobView view_of(JobRow job);
  /// The seq of the last event up to `at_h`.
  Result<std::uint64_t> seq_of(const JobRow& job, std::optional<double> at_h);
  Result<Commanded> command(const std::string& id, JobCommand command, LiveJob::Wish wish,
                            const std::string& actor, const RevisionCondition& condition);
  /// Waits until no runner holds the job; false after command_wait_ms or when draining.
  bool wait_until_left(std::int64_t job_key);

  Store& store_;  // fixed after construction
  const JobsConfig config_;
  const SpecDecoder decode_;
  const VerifyCodec verify_;
  std::atomic<bool> stop_copying_{false};  // with draining_, for forks under way
  const std::shared_ptr<Hub> hub_ = std::make_shared<Hub>();  // synchronises itself
  Past past_;                                                 // synchronises itself
  const RunnerEnvironment environment_;

  // Held from taking a job to registering it: a command that finds a job running then finds its live half too, and a retry that
  // finds it running without one knows that nobody has it. A runner that leaves a job never takes it: take() waits for that.
  std::mutex take_mutex_;            // before mutex_ where both are held
  std::mutex mutex_;                 // guards everything below
  std::condition_variable changed_;  // work came, a runner left a job, or draining began
  bool draining_ = false;
  std::uint64_t nudges_ = 0;  // grows whenever a queued job may have come
  std::uint64_t tickets_ = 0;
  // A job is in at most one of these three.
  std::deque<JobRow> running_before_;                      // `running` in the store, without a runner
  std::map<std::int64_t, std::shared_ptr<LiveJob>> live_;  // has a runner; at most concurrent_max
  std::map<std::int64_t, Stalled> stalled_;                // stopped by the store, to be tried again
  std::map<std::int64_t, std::chrono::milliseconds>
      last_pause_;  // of jobs stopped by the store before, until they progress
  std::vector<std::thread> threads_;
};

}  // namespace colony::server
