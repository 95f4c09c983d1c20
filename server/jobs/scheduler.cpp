// The threads of LocalJobService: runners that take jobs, and one that brings back jobs stopped by the store.
#include <pthread.h>

#include <algorithm>
#include <utility>

#include "server/jobs/local_service.hpp"
#include "server/jobs/retention.hpp"
#include "server/jobs/verifier.hpp"

namespace colony::server {
namespace {
constexpr int kPauseDoublings = 64;  // the longest pause between two tries, in first pauses
}  // namespace

LocalJobService::LocalJobService(Store& store, JobsConfig config, SpecDecoder decode, VerifyCodec verify)
    : store_(store),
      config_(std::move(config)),
      decode_(std::move(decode)),
      verify_(std::move(verify)),
      past_(store_, decode_, config_.cached_colonies_max, config_.cached_cells_max),
      environment_{store_, config_, decode_, verify_, *hub_} {}

LocalJobService::~LocalJobService() { drain(); }

Status LocalJobService::start() {
  if (config_.concurrent_max < 1) return Error{ErrorCode::kInvalid, "jobs.concurrent_max must be 1 or more"};
  if (config_.threads_per_job < 1) return Error{ErrorCode::kInvalid, "jobs.threads_per_job must be 1 or more"};
  auto running = store_.running_jobs();
  if (!running) return running.error();
  JobFilter paused;
  paused.state = JobState::kPaused;
  std::vector<std::int64_t> storage_paused;
  std::string cursor;
  for (;;) {
    const auto page = store_.list_jobs(paused, 1000, cursor);
    if (!page) return page.error();
    for (const JobRow& job : page->items) {
      if (job.reason == "storage") storage_paused.push_back(job.job_key);
    }
    if (!page->next) break;
    cursor = *page->next;
  }
  const std::lock_guard lock(mutex_);
  if (draining_ || !threads_.empty()) return Error{ErrorCode::kConflict, "the service was started before"};
  for (JobRow& job : *running) running_before_.push_back(std::move(job));
  for (const std::int64_t job_key : storage_paused) {
    stalled_[job_key] = {++tickets_, std::chrono::milliseconds(0), Clock::now()};
  }
  for (std::size_t i = 0; i < config_.concurrent_max; ++i) {
    threads_.emplace_back([this] { run_loop(); });
  }
  threads_.emplace_back([this] { retry_loop(); });
  if (config_.retention.keep_days > 0 || config_.retention.keep_bytes > 0) {
    threads_.emplace_back([this] { retention_loop(); });
  }
  return Ok{};
}

void LocalJobService::drain() {
  past_.stop();
  stop_copying_ = true;
  std::vector<std::thread> threads;
  {
    const std::lock_guard take_lock(take_mutex_);  // so that no job is between store and live_
    const std::lock_guard lock(mutex_);
    draining_ = true;
    for (const auto& [job_key, live] : live_) live->ask(LiveJob::Wish::kDrain);
    threads = std::exchange(threads_, {});
  }
  changed_.notify_all();
  for (std::thread& thread : threads) thread.join();
  (void)store_.flush();  // a store that cannot commit has told the runners so
}

void LocalJobService::nudge_runners() {
  {
    const std::lock_guard lock(mutex_);
    ++nudges_;
  }
  changed_.notify_all();
}

Result<std::pair<JobRow, std::shared_ptr<LiveJob>>> LocalJobService::take() {
  const std::lock_guard take_lock(take_mutex_);
  std::optional<JobRow> job;
  {
    const std::lock_guard lock(mutex_);
    if (draining_) return std::pair<JobRow, std::shared_ptr<LiveJob>>{};
    if (!running_before_.empty()) {
      job = std::move(running_before_.front());
      running_before_.pop_front();
    }
  }
  if (!job) {
    auto taken = store_.take_queued_job();
    if (!taken) return taken.error();
    job = std::move(*taken);
  }
  if (!job) return std::pair<JobRow, std::shared_ptr<LiveJob>>{};
  auto live = std::make_shared<LiveJob>(*job);
  std::unique_lock lock(mutex_);
  // Between the moment a runner stores `paused` and the moment it leaves, a person may resume the job. That gap has no end to wait
  // for but the runner's own few lines.
  changed_.wait(lock, [&] { return !live_.contains(job->job_key); });
  stalled_.erase(job->job_key);  // resumed by a person before its retry came
  live_[job->job_key] = live;
  return std::pair{std::move(*job), std::move(live)};
}

void LocalJobService::run_loop() {
  pthread_setname_np(pthread_self(), "runner");  // as operators see it, per thread; the engine's threads inherit it
  for (;;) {
    std::uint64_t nudges = 0;
    {
      const std::lock_guard lock(mutex_);
      if (draining_) return;
      nudges = nudges_;
    }
    const auto taken = take();
    if (!taken || taken->second == nullptr) {
      std::unique_lock lock(mutex_);
      const auto work = [&] { return draining_ || nudges_ != nudges || !running_before_.empty(); };
      if (taken) {
        changed_.wait(lock, work);
      } else {  // the store could not say: ask again later
        changed_.wait_for(lock, std::chrono::milliseconds(config_.storage_retry_ms), work);
      }
      continue;
    }
    const auto& [job, live] = *taken;
    hub_->announce({job.job_key, JobNews::Kind::kChange});
    leave(job, live, job.kind == kVerifyKind ? verify_job(environment_, job, live) : run_job(environment_, job, live));
    changed_.notify_all();
    hub_->announce({job.job_key, JobNews::Kind::kChange});
  }
}

void LocalJobService::leave(const JobRow& job, const std::shared_ptr<LiveJob>& live, RunEnd end) {
  if (end == RunEnd::kStorage) {
    // May fail as everything else does now; then view_of() tells it, and the next try starts from `running`.
    (void)store_.set_state(job.job_key, {JobState::kRunning}, JobState::kPaused, "storage",
                           "the database refused events");
  }
  const std::lock_guard lock(mutex_);
  if (const auto found = live_.find(job.job_key); found != live_.end() && found->second == live) live_.erase(found);
  if (end != RunEnd::kStorage) {
    last_pause_.erase(job.job_key);
    return;
  }
  const std::chrono::milliseconds first(config_.storage_retry_ms);
  std::chrono::milliseconds& pause = last_pause_[job.job_key];
  pause = live->has_committed() || pause.count() == 0 ? first : std::min(2 * pause, kPauseDoublings * first);
  stalled_[job.job_key] = {++tickets_, pause, Clock::now() + pause};
}

bool LocalJobService::is_stalled(std::int64_t job_key, std::uint64_t ticket) const {
  const auto found = stalled_.find(job_key);
  return found != stalled_.end() && found->second.ticket == ticket;
}

void LocalJobService::retry_loop() {
  std::unique_lock lock(mutex_);
  while (!draining_) {
    const auto next = std::min_element(stalled_.begin(), stalled_.end(), [](const auto& a, const auto& b) {
      return a.second.retry_at < b.second.retry_at;
    });
    if (next == stalled_.end()) {
      changed_.wait(lock);
      continue;
    }
    if (const Clock::time_point retry_at = next->second.retry_at; Clock::now() < retry_at) {
      changed_.wait_until(lock, retry_at);  // a copy: the entry may go while this waits
      continue;
    }
    const std::int64_t job_key = next->first;
    const std::uint64_t ticket = next->second.ticket;
    lock.unlock();
    const bool back = retry(job_key, ticket);
    lock.lock();
    // Meanwhile a runner may have taken the job, and even have been stopped by the store again: that stop stays.
    if (is_stalled(job_key, ticket)) {
      if (back) {
        stalled_.erase(job_key);
      } else {
        const std::chrono::milliseconds first(config_.storage_retry_ms);
        Stalled& stalled = stalled_[job_key];
        stalled.pause = stalled.pause.count() == 0 ? first : std::min(2 * stalled.pause, kPauseDoublings * first);
        stalled.retry_at = Clock::now() + stalled.pause;
      }
    }
    if (back) ++nudges_;
    lock.unlock();
    changed_.notify_all();
    hub_->announce({job_key, JobNews::Kind::kChange});
    lock.lock();
  }
}

void LocalJobService::retention_loop() {
  std::unique_lock lock(mutex_);
  while (!draining_) {
    lock.unlock();
    expire_jobs(store_, config_, [this](const JobRow& job) { forget(job); });
    lock.lock();
    changed_.wait_for(lock, std::chrono::milliseconds(config_.retention_every_ms), [&] { return draining_; });
  }
}

bool LocalJobService::retry(std::int64_t job_key, std::uint64_t ticket) {
  auto job = store_.find_job(job_key);
  if (!job) return job.error().code == ErrorCode::kNotFound;
  if (is_terminal(job->state)) return true;
  if (!store_.check_writable(config_.free_bytes_min)) return false;
  if (job->state == JobState::kRunning) {
    // Stranded, or taken by a runner since: only without a taking under way do the row and the ticket tell which.
    const std::lock_guard take_lock(take_mutex_);
    job = store_.find_job(job_key);
    if (!job) return false;
    const std::lock_guard lock(mutex_);
    if (job->state != JobState::kRunning || !is_stalled(job_key, ticket)) return true;
    stalled_.erase(job_key);
    running_before_.push_back(std::move(*job));
    return true;
  }
  const auto resumed =
      store_.command_job(job_key, JobCommand::kResumeStorage);  // leaves it alone if a person paused it
  return resumed || resumed.error().code == ErrorCode::kConflict;
}

}  // namespace colony::server
