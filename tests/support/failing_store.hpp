// failing_store: a real store whose appends can be made to fail, as on a full disk, and healed again, and whose calls can be held
// up at chosen moments. Hooks run on the calling thread; set them before the service starts.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/store/store.hpp"

namespace colony::tests {

/// A place where one thread waits until another lets it pass.
class Gate {
 public:
  void pass() {
    std::unique_lock lock(mutex_);
    reached_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return open_; });
  }
  void wait_until_reached() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return reached_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;  // guards everything below
  std::condition_variable changed_;
  bool reached_ = false, open_ = false;
};

class FailingStore final : public server::Store {
 public:
  using JobRow = server::JobRow;
  explicit FailingStore(std::unique_ptr<server::Store> real) : real_(std::move(real)) {}

  std::atomic<int> appends_until_failure{-1};  // so many appends succeed, then every one fails; negative: none fails
  std::string engine_version_seen;             // not empty: in every row found by key; set before the service starts
  std::atomic<int> event_reads{0};             // calls of read_events
  std::function<void()> before_find;           // of a row by its key
  std::function<void()> before_read_events;
  std::function<void(server::JobState, const std::string& reason)> after_set_state;  // that succeeded
  std::function<void()> after_take;                                                  // of a queued job
  std::function<void(Event&)> tamper;                                                // with each event that is read
  void heal() { appends_until_failure = -1; }

  void append_events(server::EventBatch batch, std::function<void(const Status&)> committed) override {
    int left = appends_until_failure;
    while (left > 0 && !appends_until_failure.compare_exchange_weak(left, left - 1)) {
    }
    if (left == 0) {
      committed(full());
    } else {
      real_->append_events(std::move(batch), std::move(committed));
    }
  }
  Result<JobRow> finish_job(const server::EventBatch& last, server::JobState state, const std::string& reason,
                            const std::string& detail) override {
    if (appends_until_failure == 0) return full();
    return real_->finish_job(last, state, reason, detail);
  }
  Status check_writable(std::uint64_t free_bytes_min) override {
    if (appends_until_failure == 0) return full();
    return real_->check_writable(free_bytes_min);
  }
  Result<JobRow> find_job(std::int64_t job_key) override {
    if (before_find) before_find();
    auto job = real_->find_job(job_key);
    if (job && !engine_version_seen.empty()) job->engine_version = engine_version_seen;
    return job;
  }

  // The rest is the real store's.
  Result<Submitted> create_job(const server::NewJob& job, std::size_t queued_max) override {
    return real_->create_job(job, queued_max);
  }
  Result<std::optional<JobRow>> find_submitted(const server::NewJob& job) override { return real_->find_submitted(job); }
  Result<Submitted> fork_job(const server::NewJob& job, std::int64_t source_key, const server::ForkTail& tail,
                             std::size_t queued_max, const std::atomic<bool>* stop) override {
    return real_->fork_job(job, source_key, tail, queued_max, stop);
  }
  Result<std::vector<JobRow>> expire_jobs(const server::RetentionLimits& limits, std::int64_t now_ms) override {
    return real_->expire_jobs(limits, now_ms);
  }
  Result<JobRow> find_job(const std::string& id) override { return real_->find_job(id); }
  Result<server::JobPage> list_jobs(const server::JobFilter& filter, std::size_t limit,
                                    const std::string& cursor) override {
    return real_->list_jobs(filter, limit, cursor);
  }
  Result<std::vector<std::uint64_t>> count_jobs() override { return real_->count_jobs(); }
  Result<std::optional<JobRow>> take_queued_job() override {
    auto taken = real_->take_queued_job();
    if (taken && *taken && after_take) after_take();
    return taken;
  }
  Result<JobRow> set_state(std::int64_t job_key, const std::vector<server::JobState>& from, server::JobState to,
                           const std::string& reason, const std::string& detail) override {
    auto set = real_->set_state(job_key, from, to, reason, detail);
    if (set && after_set_state) after_set_state(to, reason);
    return set;
  }
  Result<Commanded> command_job(std::int64_t job_key, server::JobCommand command,
                                const std::string& actor = {}, const server::RevisionCondition& condition = {}) override {
    return real_->command_job(job_key, command, actor, condition);
  }
  Result<TextUpdated> update_job_text(std::int64_t job_key, const server::JobTextChange& change,
                                      const server::RevisionCondition& condition, const std::string& actor) override {
    return real_->update_job_text(job_key, change, condition, actor);
  }
  Result<Deleted> delete_job(std::int64_t job_key, const server::RevisionCondition& condition = {}) override {
    return real_->delete_job(job_key, condition);
  }
  Result<std::vector<JobRow>> running_jobs() override { return real_->running_jobs(); }
  std::uint64_t commit_count() const override { return real_->commit_count(); }
  Status flush() override { return real_->flush(); }
  server::AnalysisStore& analyses() override { return real_->analyses(); }
  server::TokenStore& tokens() override { return real_->tokens(); }
  Result<std::vector<Event>> read_events(std::int64_t job_key, const server::EventFilter& filter,
                                         std::size_t limit) override {
    ++event_reads;
    if (before_read_events) before_read_events();
    auto events = real_->read_events(job_key, filter, limit);
    if (events && tamper) {
      for (Event& event : *events) tamper(event);
    }
    return events;
  }
  Result<std::optional<std::uint64_t>> page_end(std::int64_t job_key, const server::EventFilter& filter,
                                                std::size_t limit) override {
    return real_->page_end(job_key, filter, limit);
  }
  Result<std::uint64_t> seq_at(std::int64_t job_key, double at_h) override { return real_->seq_at(job_key, at_h); }
  Result<std::vector<SeriesRow>> read_series(std::int64_t job_key) override { return real_->read_series(job_key); }
  Status add_log(std::int64_t job_key, const std::string& level, const std::string& message) override {
    return real_->add_log(job_key, level, message);
  }
  Result<std::vector<server::LogRow>> read_log(std::int64_t job_key, std::int64_t after_index,
                                               std::size_t limit) override {
    return real_->read_log(job_key, after_index, limit);
  }

 private:
  static Error full() { return {ErrorCode::kStorage, "the disk is full (a test says so)"}; }
  const std::unique_ptr<server::Store> real_;
};

}  // namespace colony::tests
