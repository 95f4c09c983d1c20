// stop: how a long computation is asked to give up. Nothing is decided by a computation that was stopped: it is done again later,
// from the same inputs, with the same outcome, so stopping cannot change a history.
// Threads: the flag is set by any thread and polled by the computing one.
#pragma once

#include <atomic>
#include <exception>

namespace colony {

/// Thrown by a computation that was asked to stop; whatever it worked on is as before.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped before the end"; }
};

/// What long functions take, by default nullptr: nobody will ask.
using StopFlag = const std::atomic<bool>*;

inline void throw_if_stopped(StopFlag stop) {
  if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Stopped();
}

}  // namespace colony
