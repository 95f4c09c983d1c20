// http_sources: bodies made piece by piece, and what a test knows of them.
#pragma once

#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {

/// What a test knows of the sources that a server holds.
class Watch {
 public:
  void created() { change(created_); }
  void destroyed() { change(destroyed_); }
  void waiting() { change(waiting_); }
  void wait_for_destroyed(int count) { wait(destroyed_, count); }
  void wait_for_waiting(int count) { wait(waiting_, count); }
  int destroyed_count() {
    const std::lock_guard lock(mutex_);
    return destroyed_;
  }
  int created_count() {
    const std::lock_guard lock(mutex_);
    return created_;
  }

 private:
  void change(int& count) {
    const std::lock_guard lock(mutex_);
    ++count;
    changed_.notify_all();
  }
  void wait(const int& count, int wanted) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, std::chrono::milliseconds(kPatienceMs), [&] { return count >= wanted; })) {
      throw std::runtime_error("nothing happens");
    }
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  int created_ = 0;
  int destroyed_ = 0;
  int waiting_ = 0;
};

/// A source made of a function.
class Source : public BodySource {
 public:
  using Pulls = std::function<Pull(std::string&)>;
  Source(Watch& watch, Pulls pulls, std::string farewell = "", std::string keep_alive = "")
      : watch_(watch), pulls_(std::move(pulls)), farewell_(std::move(farewell)), keep_alive_(std::move(keep_alive)) {
    watch_.created();
  }
  ~Source() override { watch_.destroyed(); }
  Pull pull(std::string& out) override {
    const Pull result = pulls_(out);
    if (result == Pull::kWait) watch_.waiting();
    return result;
  }
  std::string_view keep_alive() const override { return keep_alive_; }
  std::string_view farewell() const override { return farewell_; }

 private:
  Watch& watch_;
  Pulls pulls_;
  std::string farewell_;
  std::string keep_alive_;
};

using Pull = BodySource::Pull;

inline Source::Pulls pieces(std::vector<std::string> all) {
  return [all = std::move(all), next = std::size_t{0}](std::string& out) mutable {
    out += all[next++];
    return next == all.size() ? Pull::kEnd : Pull::kMore;
  };
}

inline Handler source_route(Watch& watch, std::function<Source::Pulls()> make, std::string farewell = "",
                     std::string keep_alive = "") {
  return [&watch, make = std::move(make), farewell, keep_alive](const Request&) {
    return streamed(std::make_unique<Source>(watch, make(), farewell, keep_alive));
  };
}

inline Source::Pulls waits_for_ever() {
  return [](std::string& out) {
    if (out.empty()) out += "data: 1\n\n";
    return Pull::kWait;
  };
}

}  // namespace colony::server::http
