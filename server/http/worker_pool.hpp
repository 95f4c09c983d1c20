// worker_pool: the threads on which handlers run and streams are pulled, so that an I/O thread never waits for either.
// Promises that a request is refused at once when too many wait; that pulls are never refused (there is at most one a
//          connection, so connections_max bounds them); that no kind starves another: requests and pulls take turns, and
//          while a heavy request may run at most kLightTurnsMax of both go before it; and that heavy requests (pictures,
//          folds of long histories) hold at most half of the threads, so that a handful of them never keeps a health
//          check or a cancel waiting.
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
  using Ticket = std::uint64_t;        // of a request that waits; never 0

  static constexpr std::size_t kLightTurnsMax = 16;

  WorkerPool(std::size_t thread_count, std::size_t requests_waiting_max);
  ~WorkerPool();  // as stop()

  void start();
  /// 0: the queue is full (or the pool has stopped), the task will not run.
  Ticket submit_request(Task task, bool is_heavy);
  /// True: it waited still, has given back its place and will not run. False: it has begun.
  bool withdraw(Ticket ticket);
  void submit_pull(Task task);
  /// Runs what is queued, then ends the threads. Nothing may be submitted afterwards but by tasks that run.
  void stop();

 private:
  enum class Kind { kRequest, kHeavy, kPull };
  struct Waiting {
    Ticket ticket = 0;
    Task task;
  };

  void work();
  Kind next_kind();
  bool may_run_heavy() const { return !heavy_.empty() && heavy_running_ < heavy_max_; }

  const std::size_t thread_count_;
  const std::size_t heavy_max_;
  const std::size_t requests_waiting_max_;
  const std::size_t heavy_waiting_max_;  // minutes of work must not fill the queue of those who only look
  std::vector<std::thread> threads_;  // touched by start and stop only
  std::mutex mutex_;                  // guards everything below
  std::condition_variable changed_;
  Ticket ticket_count_ = 0;
  std::deque<Waiting> requests_;  // at most requests_waiting_max_
  std::deque<Waiting> heavy_;     // at most heavy_waiting_max_
  std::size_t heavy_running_ = 0;
  std::size_t light_turns_ = 0;  // taken since a heavy request could have been
  std::deque<Waiting> pulls_;
  bool pull_is_next_ = false;
  bool stopping_ = false;
};

}  // namespace colony::server::http
