#include "engine/analysis/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/base/check.hpp"

namespace colony {

void for_each_index(std::size_t count, int threads, const std::function<void(std::size_t)>& work, StopFlag stop) {
  CHECK(threads >= 1 && threads <= kAnalysisThreadsMax);
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::mutex mutex;  // guards the two below
  std::exception_ptr failure;
  std::size_t failure_index = count;
  const auto run = [&] {
    while (!failed.load(std::memory_order_relaxed) && !(stop != nullptr && stop->load(std::memory_order_relaxed))) {
      const std::size_t i = next.fetch_add(1, std::memory_order_relaxed);
      if (i >= count) return;
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        failed = true;
        if (i < failure_index) {
          failure_index = i;
          failure = std::current_exception();
        }
      }
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t wanted = std::min(static_cast<std::size_t>(threads), count);
    try {
      for (std::size_t t = 1; t < wanted; ++t) others.emplace_back(run);
    } catch (const std::system_error&) {
      // The machine has no more threads to give: those that are there do the work.
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
  if (next.load() < count) throw Stopped();
}

}  // namespace colony
