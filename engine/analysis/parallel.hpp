// parallel: the one place where analysis makes threads.
// Promise: work(i) is called once for each i in [0, count); which thread takes which i is not defined. So a caller writes what work(i)
//          finds into slot i and combines the slots afterwards in index order: then the thread count cannot matter.
// Errors:  what `work` throws is thrown again by the caller's thread, after all threads have ended: that of the lowest index that threw.
//          Stopped if `stop` is set before the last index was taken.
// Threads: at most `threads`, the caller's included; they end with the call.
#pragma once

#include <cstddef>
#include <functional>

#include "engine/base/stop.hpp"

namespace colony {

inline constexpr int kAnalysisThreadsMax = 256;

/// CHECKs 1 <= threads <= kAnalysisThreadsMax. With 1 no thread is made.
void for_each_index(std::size_t count, int threads, const std::function<void(std::size_t)>& work, StopFlag stop = nullptr);

}  // namespace colony
