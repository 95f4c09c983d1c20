// writer: the one thread that writes and checkpoints, with group commit.
// Method:  two queues. Requests (short, somebody waits) go before bulk tasks (event batches); tasks of one queue keep their order.
//          A batch closes at rows_max rows, wait_ms after its first task came, or at once when somebody waits.
//          Each task runs in a savepoint: a refusal undoes that task alone. When the database itself fails, the batch is undone
//          and its tasks are tried one by one, so that only those fail that cannot be stored.
// Promise: a task's `done` runs on the writer thread after the commit that holds it, in queue order.
// Errors:  tasks report DbError by throwing; `done` gets the Error.
// Threads: every function from any thread but the writer's own (submit_* and destruction).
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "engine/base/result.hpp"
#include "server/store/connection.hpp"

namespace colony::server {

struct WriterLimits {
  std::size_t batch_rows_max = 1000;
  std::chrono::milliseconds batch_wait{50};
  std::size_t queued_rows_max = 20'000;  // of bulk tasks; more wait in submit_bulk
};

struct WriteTask {
  std::function<Status(Connection&)>
      run;  // may run again after a failed batch: it must not keep results of a failed try
  std::function<void(const Status&)> done;
  std::size_t rows = 1;
};

class Writer {
 public:
  /// `connection` must outlive the writer and is the writer's alone from now on. `sweep` is called in idle moments, in its own
  /// transaction, as long as it returns true.
  Writer(Connection& connection, WriterLimits limits, std::function<bool(Connection&)> sweep);
  /// Commits everything queued, then ends the thread.
  ~Writer();

  /// Runs `run` before waiting bulk tasks; returns after the commit.
  Status request(std::function<Status(Connection&)> run);
  /// Runs `run` after every bulk task queued so far; returns after the commit.
  Status request_in_order(std::function<Status(Connection&)> run);
  /// Queues; waits while the queue is full.
  void submit_bulk(WriteTask task);
  /// There is something to sweep.
  void wake_sweep();
  std::uint64_t commit_count() const { return commit_count_.load(); }

 private:
  using Clock = std::chrono::steady_clock;
  Status wait_for(std::function<Status(Connection&)> run, bool in_order);
  void loop();
  std::vector<WriteTask> next_batch(std::unique_lock<std::mutex>& lock);
  void commit_batch(std::vector<WriteTask>& tasks);
  bool try_batch(std::span<WriteTask> tasks, std::vector<Status>& results);
  void undo_batch();
  void checkpoint_if_long();
  bool sweep_once();

  Connection& connection_;     // the writer thread's alone
  const WriterLimits limits_;  // fixed after construction
  const std::function<bool(Connection&)> sweep_;

  std::atomic<std::uint64_t> commit_count_{0};
  std::mutex mutex_;  // guards everything below
  std::condition_variable work_;
  std::condition_variable room_;
  std::deque<WriteTask> requests_;
  std::deque<WriteTask> bulk_;  // at most limits_.queued_rows_max rows
  std::size_t bulk_rows_ = 0;
  std::size_t urgent_bulk_ = 0;           // tasks in bulk_ that somebody waits for
  std::deque<bool> bulk_urgent_;          // parallel to bulk_
  Clock::time_point bulk_since_{};        // when the first task of the coming batch was queued
  Clock::time_point sweep_not_before_{};  // after a failed sweep
  bool sweep_pending_ = true;             // a crash may have left one half done
  bool ending_ = false;
  std::thread thread_;  // last: started when everything above is there
};

}  // namespace colony::server
