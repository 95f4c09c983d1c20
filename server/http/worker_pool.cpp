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

WorkerPool::Ticket WorkerPool::submit_request(Task task, bool is_heavy) {
  Ticket ticket = 0;
  {
    const std::lock_guard lock(mutex_);
    auto& queue = is_heavy ? heavy_ : requests_;
    if (stopping_ || queue.size() >= (is_heavy ? heavy_waiting_max_ : requests_waiting_max_)) return 0;
    ticket = ++ticket_count_;
    queue.push_back({ticket, std::move(task)});
  }
  changed_.notify_one();
  return ticket;
}

bool WorkerPool::withdraw(Ticket ticket) {
  Task task;  // what it holds is let go outside the lock
  {
    const std::lock_guard lock(mutex_);
    for (auto* const queue : {&requests_, &heavy_}) {
      const auto waiting = std::find_if(queue->begin(), queue->end(), [ticket](const Waiting& one) { return one.ticket == ticket; });
      if (waiting == queue->end()) continue;
      task = std::move(waiting->task);
      queue->erase(waiting);
      break;
    }
  }
  if (!task) return false;
  changed_.notify_all();  // stop() may have waited for the last of the heavy ones
  return true;
}

void WorkerPool::submit_pull(Task task) {
  {
    const std::lock_guard lock(mutex_);
    pulls_.push_back({0, std::move(task)});
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

// Light work first, in turns; a heavy request where a thread has nothing else to do, or has kept one waiting long enough.
WorkerPool::Kind WorkerPool::next_kind() {
  if (may_run_heavy() && ((requests_.empty() && pulls_.empty()) || light_turns_ >= kLightTurnsMax)) {
    light_turns_ = 0;
    return Kind::kHeavy;
  }
  light_turns_ = may_run_heavy() ? light_turns_ + 1 : 0;
  const bool take_pull = !pulls_.empty() && (pull_is_next_ || requests_.empty());
  pull_is_next_ = !take_pull;
  return take_pull ? Kind::kPull : Kind::kRequest;
}

void WorkerPool::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] {
      return !requests_.empty() || !pulls_.empty() || may_run_heavy() || (stopping_ && heavy_.empty());
    });
    if (requests_.empty() && pulls_.empty() && !may_run_heavy()) return;
    const Kind kind = next_kind();
    auto& queue = kind == Kind::kHeavy ? heavy_ : kind == Kind::kPull ? pulls_ : requests_;
    Task task = std::move(queue.front().task);
    queue.pop_front();
    if (kind == Kind::kHeavy) ++heavy_running_;
    lock.unlock();
    task();
    task = nullptr;  // what it held is let go outside the lock
    lock.lock();
    if (kind == Kind::kHeavy) {
      --heavy_running_;
      changed_.notify_all();  // a heavy request may have waited for this, and stop() for the last of them
    }
  }
}

}  // namespace colony::server::http
