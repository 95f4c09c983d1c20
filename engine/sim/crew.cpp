#include "engine/sim/crew.hpp"

#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "engine/base/check.hpp"

namespace colony {

struct Crew::Threads {
  explicit Threads(int size) : arena(size, 1) {}
  tbb::task_arena arena;
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
  threads_->arena.execute([&] {
    tbb::task_group group;
    // A chain of calls, and a new chain for every further call that becomes possible. Idle threads go back to the arena, where
    // they can also be lent to what a call starts in parallel.
    const std::function<void()> chain = [&] {
      const auto worker = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
      for (std::size_t left = 1; left > 0; --left) {
        left += work(worker);
        for (; left > 2; --left) group.run([&chain] { chain(); });
      }
    };
    for (; count > 1; --count) group.run([&chain] { chain(); });
    if (count == 1) chain();
    group.wait();
  });
}

}  // namespace colony
