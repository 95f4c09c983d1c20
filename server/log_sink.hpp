// log_sink: lines on their way to a descriptor, written by a thread of their own: whoever does not read standard error must not hold
// the threads that serve.
// Method:  lines gather for kGather after each write, so that a busy server makes some hundred writes a second and wakes the thread as
//          often, whatever the requests: a wake a line cost as much as an answer. The first line after a pause is written at once.
// Limits:  lines_max wait; beyond, the oldest are lost. So are those of a write that fails (a full disk); of a descriptor that is busy
//          (EAGAIN) the end is waited for. The next line that is taken, at the latest the end, tells how many, and no line runs into
//          one that was written in part.
// Threads: log() from any; the destructor is end() without end.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <spdlog/sinks/base_sink.h>

namespace colony::server {

class LogSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  static constexpr std::chrono::milliseconds kGather{5};

  /// What stands in the log when so many lines have been lost since the start. (Of all, because such a line can be lost too.)
  using TellLost = std::function<std::string(std::size_t lines)>;

  /// Writes to `descriptor`, which stays open and the caller's.
  LogSink(int descriptor, std::size_t lines_max, TellLost tell_lost);
  ~LogSink() override;
  LogSink(const LogSink&) = delete;
  LogSink& operator=(const LogSink&) = delete;

  /// No line is taken any more. True once all are written; false if that takes longer than `patience`.
  bool end(std::chrono::milliseconds patience);

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  std::string formatted(const spdlog::details::log_msg& message);
  /// The line that tells of lost ones, if any are untold. Needs both mutexes.
  void tell_of_lost(spdlog::string_view_t logger_name);
  void run();
  /// How many bytes are written.
  std::size_t write_all(std::string_view bytes) const;

  const int descriptor_;  // fixed after construction
  const std::size_t lines_max_;
  const TellLost tell_lost_;
  std::mutex lines_mutex_;  // guards everything below but the thread
  std::condition_variable arrived_, ended_;
  std::deque<std::string> lines_;
  std::size_t lost_count_ = 0, told_count_ = 0;
  bool is_waiting_ = false;  // for a line
  bool is_ending_ = false;
  bool has_ended_ = false;
  std::thread thread_;
};

}  // namespace colony::server
