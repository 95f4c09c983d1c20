#include "server/http/worker_pool.hpp"

#include <utility>

namespace colony::server::http {

WorkerPool::WorkerPool(std::size_t thread_count, std::size_t requests_waiting_max)
    : thread_count_(thread_count), requests_waiting_max_(requests_waiting_max) {}

WorkerPool::~WorkerPool() { stop(); }

void WorkerPool::start() {
  for (std::size_t i = 0; i < thread_count_; ++i) threads_.emplace_back([this] { work(); });
}

bool WorkerPool::submit_request(Task task) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_ || requests_.size() >= requests_waiting_max_) return false;
    requests_.push_back(std::move(task));
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
    changed_.wait(lock, [this] { return stopping_ || !requests_.empty() || !pulls_.empty(); });
    if (requests_.empty() && pulls_.empty()) return;
    const bool take_pull = !pulls_.empty() && (pull_is_next_ || requests_.empty());
    pull_is_next_ = !take_pull;
    auto& queue = take_pull ? pulls_ : requests_;
    Task task = std::move(queue.front());
    queue.pop_front();
    lock.unlock();
    task();
    task = nullptr;  // what it held is let go outside the lock
    lock.lock();
  }
}

}  // namespace colony::server::http
