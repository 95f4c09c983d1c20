// worker_pool: the threads on which handlers run and streams are pulled, so that an I/O thread never waits for either.
// Promises that a request is refused at once when too many wait; that pulls are never refused (there is at most one a
//          connection, so connections_max bounds them); that neither kind starves the other: they take turns; and that
//          heavy requests (pictures, folds of long histories) hold at most half of the threads, so that a handful of them
//          never keeps a health check or a cancel waiting.
// Threads: synchronises itself.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace colony::server::http {

class WorkerPool {
 public:
  using Task = std::function<void()>;  // must not throw

  WorkerPool(std::size_t thread_count, std::size_t requests_waiting_max);
  ~WorkerPool();  // as stop()

  void start();
  /// False: the queue is full (or the pool has stopped), the task will not run.
  bool submit_request(Task task, bool is_heavy);
  void submit_pull(Task task);
  /// Runs what is queued, then ends the threads. Nothing may be submitted afterwards but by tasks that run.
  void stop();

 private:
  void work();
  bool may_run_heavy() const { return !heavy_.empty() && heavy_running_ < heavy_max_; }

  const std::size_t thread_count_;
  const std::size_t heavy_max_;
  const std::size_t requests_waiting_max_;
  const std::size_t heavy_waiting_max_;  // minutes of work must not fill the queue of those who only look
  std::vector<std::thread> threads_;  // touched by start and stop only
  std::mutex mutex_;                  // guards everything below
  std::condition_variable changed_;
  std::deque<Task> requests_;
  std::deque<Task> heavy_;
  std::size_t heavy_running_ = 0;
  std::deque<Task> pulls_;
  bool pull_is_next_ = false;
  bool stopping_ = false;
};

}  // namespace colony::server::http
