#include "engine/picture/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/base/check.hpp"

namespace colony {

void for_each_piece(std::size_t count, const Effort& effort, const std::function<void(std::size_t)>& piece) {
  CHECK(effort.threads >= 1 && effort.threads <= kWorkThreadsMax);
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr thrown;  // the first one; guarded by mutex
  const auto take = [&] {
    try {
      for (std::size_t index = next.fetch_add(1); index < count; index = next.fetch_add(1)) {
        throw_if_stopped(effort.stop);
        piece(index);
      }
    } catch (...) {
      next.store(count);
      const std::scoped_lock lock(mutex);
      if (!thrown) thrown = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t wanted = std::min(static_cast<std::size_t>(effort.threads), count);
    for (std::size_t i = 1; i < wanted; ++i) others.emplace_back(take);
    take();
  }
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace colony
