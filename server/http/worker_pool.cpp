#include "server/http/worker_pool.hpp"

#include <algorithm>
#include <utility>

namespace colony::server::http {

WorkerPool::WorkerPool(std::size_t thread_count, std::size_t requests_waiting_max)
    : thread_count_(thread_count),
      heavy_max_(std::max<std::size_t>(1, thread_count / 2)),
      requests_waiting_max_(requests_waiting_max),
      heavy_waiting_max_(std::max<std::size_t>(1, requests_waiting_max / 8)) {}

WorkerPool::~WorkerPool() { stop(); }

void WorkerPool::start() {
  for (std::size_t i = 0; i < thread_count_; ++i) threads_.emplace_back([this] { work(); });
}

bool WorkerPool::submit_request(Task task, bool is_heavy) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_ || (is_heavy ? heavy_.size() >= heavy_waiting_max_ : requests_.size() >= requests_waiting_max_)) return false;
    (is_heavy ? heavy_ : requests_).push_back(std::move(task));
  }
  changed_.notify_one();
  return true;
}

void WorkerPool::submit_pull(Task task) {
  {
    const std::lock_guard lock(mutex_);
    pulls_.push_back(std::move(task));
  }
  changed_.notify_one();
}

void WorkerPool::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (auto& thread : threads_) thread.join();
  threads_.clear();
}

void WorkerPool::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] {
      return !requests_.empty() || !pulls_.empty() || may_run_heavy() || (stopping_ && heavy_.empty());
    });
    if (requests_.empty() && pulls_.empty() && !may_run_heavy()) return;
    // Light work first, in turns; a heavy request only where a thread has nothing else to do.
    const bool take_heavy = requests_.empty() && pulls_.empty();
    const bool take_pull = !take_heavy && !pulls_.empty() && (pull_is_next_ || requests_.empty());
    if (!take_heavy) pull_is_next_ = !take_pull;
    auto& queue = take_heavy ? heavy_ : take_pull ? pulls_ : requests_;
    Task task = std::move(queue.front());
    queue.pop_front();
    if (take_heavy) ++heavy_running_;
    lock.unlock();
    task();
    task = nullptr;  // what it held is let go outside the lock
    lock.lock();
    if (take_heavy) {
      --heavy_running_;
      changed_.notify_all();  // a heavy request may have waited for this, and stop() for the last of them
    }
  }
}

}  // namespace colony::server::http
