// page_stream: one event stream for a page that shows many jobs.
// Promise: first the state: of `all` every job that has not ended, of named jobs each one; then `event: ready`. From then on every
//          change: `event: job` (the whole job, when it is new or its revision has changed), `event: deleted`, and `event: progress`,
//          of a job at most 5 times a second, of all together at most 50 times, each job in its turn. A message has no id: a reader
//          that reconnects gets the whole state again, and knows by `ready` that what it held as not ended and was not told is over.
// Cost:    what changes, not what is stored; progress is read from memory; texts are shared with all other pages (pages.hpp). Between two
//          looks only the keys of jobs are kept, once each.
// Errors:  when the storage fails, or more news waits than kNewsMax, the body ends (after `event: lagged`); the reader reconnects.
// Threads: one pull at a time; news from any thread.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/api/pages.hpp"
#include "server/http/message.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

inline constexpr std::size_t kPageJobsMax = 100;  // that can be named
inline constexpr std::chrono::milliseconds kPageTick{200};
inline constexpr std::size_t kProgressPerTickMax = 10;

/// What the page shows; without a value: all jobs.
struct PageWish {
  std::map<std::int64_t, std::string> jobs;  // key to id
  std::vector<std::string> missing;          // named, but not there: told as deleted
  bool is_all = false;
};

class PageStream : public http::BodySource {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  /// Both outlive it.
  PageStream(JobService& jobs, Pages& pages, PageWish wish, Clock clock = std::chrono::steady_clock::now);
  Pull pull(std::string& out) override;
  std::optional<std::chrono::milliseconds> wake_after() override { return wake_after_; }
  void on_ready(std::function<void()> wake) override;
  std::string_view keep_alive() const override { return ": keep-alive\n\n"; }
  std::string_view farewell() const override { return "event: bye\ndata: {}\n\n"; }

 private:
  /// What came since the last look.
  struct News {
    std::mutex mutex;  // guards everything below
    std::set<std::int64_t> changed;
    std::deque<std::int64_t> progressed;  // in turn,
    std::set<std::int64_t> in_turn;       // each once
    std::vector<std::string> removed;
    bool is_too_much = false;
  };
  struct Told {
    std::string id;
    std::uint64_t revision = 0;
    JobState state = JobState::kQueued;
  };

  bool shows(std::int64_t job_key) const { return wish_.is_all || wish_.jobs.contains(job_key); }
  void hear(const Pages::News& news, const std::function<void()>& wake);
  void tell(std::string& out, std::int64_t job_key, const JobMessage& message);
  /// Looks at one job that may have changed; false: the storage failed.
  bool look(std::string& out, std::int64_t job_key);
  /// A piece of the state at the beginning; false: the storage failed.
  bool begin(std::string& out);
  bool tell_changes(std::string& out);
  void tell_progress(std::string& out);

  JobService& jobs_;  // fixed after construction
  Pages& pages_;
  const PageWish wish_;
  const Clock clock_;
  News news_;                                                 // synchronises itself
  std::unique_ptr<Pages::Subscription> subscription_;         // after news_: ends first
  std::map<std::int64_t, Told> told_;
  std::deque<std::int64_t> ended_;  // of `all`: those in told_ that have ended, kEndedKeptMax at most
  std::size_t told_count_ = 0;
  bool is_first_ = true, is_ready_ = false;
  std::size_t state_index_ = 0;  // of the states that `begin` goes through,
  std::string cursor_;           // and the page in it
  std::deque<std::int64_t> changed_;  // taken from news_
  std::vector<std::string> removed_;
  std::optional<std::chrono::steady_clock::time_point> next_tick_;
  std::optional<std::chrono::milliseconds> wake_after_;
};

}  // namespace colony::server::api
