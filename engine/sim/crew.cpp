#include "engine/sim/crew.hpp"

#include <algorithm>
#include <atomic>

#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include "engine/base/check.hpp"

namespace colony {

struct Crew::Threads {
  explicit Threads(int size) : arena(size, 1) {}
  tbb::task_arena arena;
  std::atomic<std::size_t> next = 0;           // the first index that nobody has taken
  std::atomic<std::size_t> done = 0;
};

Crew::Crew(int size) : size_(size) {
  CHECK(size >= 1 && size <= kThreadsMax);
  if (size > 1) threads_ = std::make_unique<Threads>(size);
}
Crew::~Crew() = default;
Crew::Crew(Crew&&) noexcept = default;
Crew& Crew::operator=(Crew&&) noexcept = default;

void Crew::run(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  if (!threads_ || count <= 1) {
    for (std::size_t index = 0; index < count; ++index) work(index, 0);
    return;
  }
  // One loop a thread, each taking the next index: the order of starting is the caller's (tbb's splitting of ranges would not
  // keep it), and no thread holds work that another could do. A loop that starts late finds nothing left.
  Threads& threads = *threads_;
  threads.done.store(0, std::memory_order_relaxed);
  threads.next.store(0, std::memory_order_release);
  const int loops = static_cast<int>(std::min(count, static_cast<std::size_t>(size_)));
  threads.arena.execute([&] {
    tbb::parallel_for(
        0, loops, 1,
        [&](int) {
          const auto worker = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
          for (;;) {
            const std::size_t index = threads.next.fetch_add(1, std::memory_order_acq_rel);
            if (index >= count) return;
            work(index, worker);
            threads.done.fetch_add(1, std::memory_order_release);
          }
        },
        tbb::simple_partitioner{});
  });
  CHECK(threads.done.load(std::memory_order_acquire) == count);
}

}  // namespace colony
