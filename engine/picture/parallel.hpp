// parallel: independent pieces of one picture on several threads.
// Method:  threads of its own for one call; each takes the next piece. A picture takes long enough that starting them
//          does not count, and the number asked for is the number that run, so tests of 7 threads are what they say on
//          any machine.
// Why the threads cannot change a byte: a piece is a function of its index and writes only where no other piece writes.
// Errors:  CHECKs 1 <= threads <= kWorkThreadsMax. What a piece throws (Stopped) is thrown again when all threads have
//          ended.
#pragma once

#include <cstddef>
#include <functional>

#include "engine/base/stop.hpp"

namespace colony {

inline constexpr int kWorkThreadsMax = 256;

/// How a long computation is done: nothing of it shows in the result.
struct Effort {
  int threads = 1;
  StopFlag stop = nullptr;  // asked before every piece
};

/// piece(0), ..., piece(count - 1), in any order.
void for_each_piece(std::size_t count, const Effort& effort, const std::function<void(std::size_t)>& piece);

}  // namespace colony
