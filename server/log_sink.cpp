#include "server/log_sink.hpp"

#include <cerrno>
#include <unistd.h>
#include <utility>

namespace colony::server {

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

void LogSink::sink_it_(const spdlog::details::log_msg& message) {
  std::string line = formatted(message);
  bool is_to_wake = false;
  {
    const std::lock_guard lock(lines_mutex_);
    if (is_ending_) return;
    if (lines_.size() >= lines_max_) {
      lines_.pop_front();
      ++lost_count_;
    } else if (const std::size_t lost = std::exchange(lost_count_, 0); lost > 0) {
      const std::string told = tell_lost_(lost);
      lines_.push_back(formatted({message.logger_name, spdlog::level::warn, told}));
    }
    lines_.push_back(std::move(line));
    is_to_wake = std::exchange(is_waiting_, false);
  }
  if (is_to_wake) arrived_.notify_one();
}

void LogSink::run() {
  std::unique_lock lock(lines_mutex_);
  for (;;) {
    is_waiting_ = true;
    arrived_.wait(lock, [&] { return !lines_.empty() || is_ending_; });
    is_waiting_ = false;
    if (lines_.empty()) break;
    std::string bytes;
    for (const std::string& line : lines_) bytes += line;
    lines_.clear();
    lock.unlock();
    const bool is_written = write_all(bytes);
    lock.lock();
    if (!is_written) lines_.clear();  // nobody is there
    arrived_.wait_for(lock, kGather, [&] { return is_ending_; });
  }
  has_ended_ = true;
  ended_.notify_all();
}

// False: the other end is gone.
bool LogSink::write_all(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool LogSink::end(std::chrono::milliseconds patience) {
  std::unique_lock lock(lines_mutex_);
  is_ending_ = true;
  arrived_.notify_all();
  return ended_.wait_for(lock, patience, [&] { return has_ended_; });
}

}  // namespace colony::server
