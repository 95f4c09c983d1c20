// crew: the threads that decide. The only place of the simulator that knows how they are made.
// Threads: run() is called by one thread at a time, which works too. oneTBB lends the others: never more than the machine has
//          processors (less one), whatever `size` says; more than that would only take turns.
// Errors:  CHECKs 1 <= size <= kThreadsMax.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace colony {

inline constexpr int kThreadsMax = 256;

class Crew {
 public:
  /// With size 1 no thread is ever asked for.
  explicit Crew(int size);
  ~Crew();
  Crew(Crew&&) noexcept;
  Crew& operator=(Crew&&) noexcept;

  int size() const { return size_; }

  /// Calls work(worker) `count` times, and once more for each that such a call returns; comes back when all calls have.
  /// `worker` is in [0, size): two calls at the same time have different ones. `work` must not throw, and what it starts in
  /// parallel itself must be isolated (tbb::this_task_arena::isolate): else a worker that waits for it could begin another
  /// call.
  void run(std::size_t count, const std::function<std::size_t(std::size_t worker)>& work);

 private:
  struct Threads;

  int size_;
  std::unique_ptr<Threads> threads_;           // none for size 1
};

}  // namespace colony
