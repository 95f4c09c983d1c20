#include "engine/sim/crew.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "engine/base/check.hpp"

namespace colony {

struct Crew::Threads {
  // Made here, not at the first use: the arena gives its threads the floating-point mode it was made under. More threads
  // than oneTBB has would only make it complain on standard error.
  explicit Threads(int size) : arena(std::min(size, available()), 1) { arena.initialize(); }
  static int available() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  }
  tbb::task_arena arena;
  // What oneTBB promises, what was done before a task is handed over or ended is seen after, said once more in our own
  // code: a thread sanitizer cannot look into the library, and would either complain of everything or have to overlook
  // everything.
  std::atomic<std::uint64_t> handed_over = 0;
  void meet() { handed_over.fetch_add(1, std::memory_order_acq_rel); }
  void start(tbb::task_group& group, const std::function<void()>& chain) {
    meet();
    group.run([this, &chain] {
      meet();
      chain();
      meet();
    });
  }
};

Crew::Crew(int size) : size_(size) {
  CHECK(size >= 1 && size <= kThreadsMax);
  if (size > 1) threads_ = std::make_unique<Threads>(size);
}
Crew::~Crew() = default;
Crew::Crew(Crew&&) noexcept = default;
Crew& Crew::operator=(Crew&&) noexcept = default;

void Crew::run(std::size_t count, const std::function<std::size_t(std::size_t)>& work) {
  if (!threads_) {
    for (; count > 0; --count) count += work(0);
    return;
  }
  Threads& threads = *threads_;
  threads.arena.execute([&] {
    tbb::task_group group;
    // A chain of calls, and a new chain for every further call that becomes possible. Idle threads go back to the arena,
    // where they can also be lent to what a call starts in parallel.
    const std::function<void()> chain = [&] {
      const auto worker = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
      for (std::size_t left = 1; left > 0; --left) {
        left += work(worker);
        for (; left > 2; --left) threads.start(group, chain);
      }
    };
    for (; count > 1; --count) threads.start(group, chain);
    if (count == 1) chain();
    group.wait();
    threads.meet();
  });
}

}  // namespace colony
