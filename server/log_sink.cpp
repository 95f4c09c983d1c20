#include "server/log_sink.hpp"

#include <cerrno>
#include <poll.h>
#include <unistd.h>
#include <utility>

namespace colony::server {
namespace {

std::size_t text_size(const std::deque<std::string>& lines) {
  std::size_t size = 0;
  for (const std::string& line : lines) size += line.size();
  return size;
}

}  // namespace

LogSink::LogSink(int descriptor, std::size_t lines_max, TellLost tell_lost)
    : descriptor_(descriptor), lines_max_(lines_max), tell_lost_(std::move(tell_lost)), thread_([this] { run(); }) {}

LogSink::~LogSink() {
  (void)end(std::chrono::milliseconds::zero());
  thread_.join();
}

std::string LogSink::formatted(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t text;
  formatter_->format(message, text);
  return {text.data(), text.size()};
}

void LogSink::tell_of_lost(spdlog::string_view_t logger_name) {
  if (std::exchange(told_count_, lost_count_) == lost_count_) return;
  const std::string told = tell_lost_(lost_count_);
  lines_.push_back(formatted({logger_name, spdlog::level::warn, told}));
}

void LogSink::sink_it_(const spdlog::details::log_msg& message) {
  std::string line = formatted(message);
  bool is_to_wake = false;
  {
    const std::lock_guard lock(lines_mutex_);
    if (is_ending_) return;
    if (lines_.size() >= lines_max_) {
      lines_.pop_front();
      ++lost_count_;
    } else {
      tell_of_lost(message.logger_name);
    }
    lines_.push_back(std::move(line));
    is_to_wake = std::exchange(is_waiting_, false);
  }
  if (is_to_wake) arrived_.notify_one();
}

void LogSink::run() {
  bool is_torn = false;  // the last line written lacks its end
  std::unique_lock lock(lines_mutex_);
  for (;;) {
    is_waiting_ = true;
    arrived_.wait(lock, [&] { return !lines_.empty() || is_ending_; });
    is_waiting_ = false;
    if (lines_.empty()) break;
    const std::deque<std::string> taken = std::exchange(lines_, {});
    lock.unlock();
    std::string bytes = is_torn ? "\n" : "";
    for (const std::string& line : taken) bytes += line;
    std::size_t written = write_all(bytes);
    is_torn = written > 0 ? bytes[written - 1] != '\n' : is_torn;
    std::size_t whole = 0;  // of taken
    for (std::size_t end = bytes.size() - text_size(taken); whole < taken.size(); ++whole) {
      end += taken[whole].size();
      if (end > written) break;
    }
    lock.lock();
    lost_count_ += taken.size() - whole;
    arrived_.wait_for(lock, kGather, [&] { return is_ending_; });
  }
  has_ended_ = true;
  ended_.notify_all();
}

std::size_t LogSink::write_all(std::string_view bytes) const {
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t now = ::write(descriptor_, bytes.data() + written, bytes.size() - written);
    if (now > 0) {
      written += static_cast<std::size_t>(now);
    } else if (now < 0 && errno == EAGAIN) {
      // Somebody who shares the descriptor made it non-blocking.
      pollfd ready{descriptor_, POLLOUT, 0};
      if (::poll(&ready, 1, -1) < 0 && errno != EINTR) break;
    } else if (now < 0 && errno != EINTR) {
      break;
    }
  }
  return written;
}

bool LogSink::end(std::chrono::milliseconds patience) {
  const std::lock_guard format_lock(mutex_);
  std::unique_lock lock(lines_mutex_);
  if (!is_ending_) tell_of_lost("");
  is_ending_ = true;
  arrived_.notify_all();
  return ended_.wait_for(lock, patience, [&] { return has_ended_; });
}

}  // namespace colony::server
