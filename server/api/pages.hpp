// pages: what all streams of pages share: who is told of news, and the text of a job or of its progress, encoded once for all.
// Promise: news reach every page that subscribed before they came. A text that is given was read after the last news of its job that this
//          object has heard; while there are none, a thousand pages cost one reading and one encoding (at most one a worker, when several
//          ask at the same moment).
// Method:  one subscription to all jobs, on the thread that announces: it notes keys and does nothing else. A thread of its own (`pages`)
//          tells the pages, which wakes each: a thousand wakes are milliseconds that the writer of the store must not spend.
// Limits:  kPageTextsMax texts of jobs of at most kPageTextBytesMax, and as many of progress; when there is no room all are forgotten. kNewsMax keys between two
//          tellings, beyond that the pages are told to begin again.
// Threads: synchronises itself. The functions of subscribers run on the thread `pages`.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/jobs/service.hpp"

namespace colony::server::api {

inline constexpr std::size_t kNewsMax = 100'000;
inline constexpr std::size_t kPageTextsMax = 512;
inline constexpr std::size_t kPageTextBytesMax = 32 * 1024;

/// `event: job` with what it says of which job.
struct JobMessage {
  std::string id;
  std::uint64_t revision = 0, last_seq = 0;
  JobState state = JobState::kQueued;
  std::string text;
};

class Pages {
 public:
  enum class Mode { kOwnThread, kByHand };  // by hand: for tests, which call distribute()
  /// `base_path`: what the links begin with.
  Pages(JobService& jobs, std::string base_path, Mode mode = Mode::kOwnThread);
  /// All subscriptions must be gone.
  ~Pages();
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;

  /// Keys of jobs, each once.
  struct News {
    std::set<std::int64_t> changed, progressed;
    std::vector<std::pair<std::int64_t, std::string>> removed;  // with their ids
    bool is_too_much = false;  // news were lost
  };
  class Subscription;
  /// Calls `hear` with what is new until the subscription is destroyed; it must not block nor come back here.
  std::unique_ptr<Subscription> subscribe(std::function<void(const News&)> hear);

  /// The job as it is after all news heard so far. Errors as JobService::show.
  Result<std::shared_ptr<const JobMessage>> message_of(std::int64_t job_key);
  /// The same of a view just read.
  std::shared_ptr<const JobMessage> message_of(const JobView& view);
  /// `event: progress` of a job of which the page has told `state`; null where no runner has it.
  std::shared_ptr<const std::string> progress_of(std::int64_t job_key, const std::string& id, JobState state);

  /// Tells the news there are, now.
  void distribute();

 private:
  using Clock = std::chrono::steady_clock;
  /// A text is true while no news of its job came after `made_at`, the stamp before it was read.
  struct KeptMessage {
    std::uint64_t stamp = 0, made_at = 0;
    std::shared_ptr<const JobMessage> message;
  };
  struct KeptProgress {
    std::uint64_t stamp = 0, made_at = 0;
    JobState state = JobState::kQueued;
    std::shared_ptr<const std::string> text;
  };
  void hear(const JobNews& news);
  void keep(std::int64_t job_key, std::uint64_t stamp, const std::shared_ptr<const JobMessage>& message);
  std::chrono::microseconds pause() const;
  void loop();

  JobService& jobs_;              // fixed after construction
  const std::string base_path_;
  const Mode mode_;

  std::mutex begin_mutex_;        // guards the next two; held while the hub is asked
  std::unique_ptr<JobService::Subscription> hub_;  // from the first page on
  std::thread thread_;

  std::mutex mutex_;              // guards everything below
  std::condition_variable changed_;
  std::size_t watcher_count_ = 0;
  News news_;                     // not yet told
  std::uint64_t stamp_ = 0;       // of the last news
  std::map<std::int64_t, KeptMessage> messages_;
  std::map<std::int64_t, KeptProgress> progress_;
  bool ending_ = false;

  mutable std::mutex watchers_mutex_;  // guards everything below; held while functions of subscribers run
  std::set<Subscription*> watchers_;
};

class Pages::Subscription {
 public:
  Subscription(Pages& pages, std::function<void(const News&)> hear);
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  void hear(const News& news) const { hear_(news); }

 private:
  Pages& pages_;
  const std::function<void(const News&)> hear_;
};

}  // namespace colony::server::api
