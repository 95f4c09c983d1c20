// job_texts: answers of GET /v1/jobs/{id}, kept while they are true.
// Promise: an answer that is found is that of a reading after which nothing was committed. Of a running job it is also not older than
//          kLiveTextAge: its rates are of now, though nothing is committed.
// Method:  a text is kept with the number of commits before the reading, and is good as long as that number stands. No list of what a write
//          touches, so none that could be forgotten. While colonies grow there are some twenty commits a second, so this is for a crowd that
//          asks.
// Limits:  kJobTextsMax texts of at most kJobTextBytesMax; when there is no room all are forgotten.
// Threads: synchronises itself. find() waits for no store.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "engine/base/result.hpp"
#include "server/http/message.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

inline constexpr std::size_t kJobTextsMax = 512;
inline constexpr std::size_t kJobTextBytesMax = 32 * 1024;
inline constexpr std::chrono::milliseconds kLiveTextAge{100};

struct JobText {
  std::string text;
  std::string tag;  // job_tag
};

http::Response job_answer(const JobText& text);

class JobTexts {
 public:
  /// `base_path`: what the links begin with.
  JobTexts(JobService& jobs, std::string base_path) : jobs_(jobs), base_path_(std::move(base_path)) {}
  /// Null: not known, or no longer true.
  std::shared_ptr<const JobText> find(const std::string& id);
  /// Found, or read and kept.
  Result<std::shared_ptr<const JobText>> read(const std::string& id);

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::shared_ptr<const JobText> text;
    std::uint64_t commits = 0;  // before it was read
    Clock::time_point until;
  };
  JobService& jobs_;
  const std::string base_path_;
  std::mutex mutex_;  // guards everything below
  std::map<std::string, Kept> kept_;
};

}  // namespace colony::server::api
