#include "server/api/page_stream.hpp"

#include <array>
#include <utility>

#include "server/api/codec_event.hpp"

namespace colony::server::api {
namespace {

constexpr std::size_t kPieceBytesMax = 64 * 1024;
constexpr std::size_t kJobsPerRead = 20;
constexpr std::size_t kEndedKeptMax = 1000;
constexpr std::array kLive = {JobState::kRunning, JobState::kQueued, JobState::kPaused};

void append_message(std::string& out, std::string_view event, const Json& data) {
  ((((out += "event: ") += event) += "\ndata: ") += to_text(data)) += "\n\n";
}

}  // namespace

PageStream::PageStream(JobService& jobs, Pages& pages, PageWish wish, Clock clock)
    : jobs_(jobs), pages_(pages), wish_(std::move(wish)), clock_(std::move(clock)) {}

void PageStream::on_ready(std::function<void()> wake) {
  subscription_ = pages_.subscribe([this, wake = std::move(wake)](const Pages::News& news) { hear(news, wake); });
}

void PageStream::hear(const Pages::News& news, const std::function<void()>& wake) {
  bool is_to_wake = news.is_too_much;
  {
    const std::lock_guard lock(news_.mutex);
    for (const std::int64_t key : news.changed) {
      if (shows(key) && news_.changed.insert(key).second) is_to_wake = true;
    }
    for (const auto& [key, id] : news.removed) {
      if (!shows(key)) continue;
      news_.removed.push_back(id);
      is_to_wake = true;
    }
    for (const std::int64_t key : news.progressed) {
      if (!shows(key) || !news_.in_turn.insert(key).second) continue;
      // While progress waits for its turn, more of it wakes nobody: the stream comes back by itself.
      if (news_.progressed.empty()) is_to_wake = true;
      news_.progressed.push_back(key);
    }
    if (news.is_too_much || news_.changed.size() + news_.removed.size() > kNewsMax) news_.is_too_much = true;
  }
  if (is_to_wake) wake();
}

void PageStream::tell(std::string& out, std::int64_t job_key, const JobMessage& message) {
  out += message.text;
  if (!is_ready_) ++told_count_;
  told_[job_key] = {message.id, message.revision, message.state};
  if (!wish_.is_all || !is_terminal(message.state)) return;
  // Its end can be announced twice, by the runner and by the command. What ended long ago is forgotten: a job more that is told
  // again is no harm, a list that grows for ever is.
  ended_.push_back(job_key);
  if (ended_.size() > kEndedKeptMax) {
    told_.erase(ended_.front());
    ended_.pop_front();
  }
}

bool PageStream::look(std::string& out, std::int64_t job_key) {
  const auto message = pages_.message_of(job_key);
  if (!message) return message.error().code == ErrorCode::kNotFound;  // gone: that is news of its own
  const JobMessage& job = **message;
  const auto told = told_.find(job_key);
  // A kept text can be of before what the state began with, as long as the news of that are on their way.
  const bool is_known = told != told_.end() && (told->second.revision > job.revision ||
                                                (told->second.revision == job.revision && told->second.state == job.state));
  if (!is_known) tell(out, job_key, job);
  return true;
}

bool PageStream::begin(std::string& out) {
  if (!wish_.is_all) {
    for (const auto& [key, id] : wish_.jobs) {
      const auto message = pages_.message_of(key);
      if (!message && message.error().code != ErrorCode::kNotFound) return false;
      if (message) {
        tell(out, key, **message);
      } else {
        append_message(out, "deleted", {{"id", id}});
      }
    }
    for (const std::string& id : wish_.missing) append_message(out, "deleted", {{"id", id}});
    state_index_ = kLive.size();
  }
  // A job that changes its state between two of these pages can be missed by both, but then it is news.
  while (state_index_ < kLive.size() && out.size() < kPieceBytesMax) {
    JobFilter filter;
    filter.state = kLive[state_index_];
    const auto page = jobs_.list(filter, kJobsPerRead, cursor_);
    if (!page) return false;
    for (const JobView& view : page->items) tell(out, view.job.job_key, *pages_.message_of(view));
    cursor_ = page->next.value_or("");
    if (!page->next) ++state_index_;
  }
  if (state_index_ == kLive.size()) {
    is_ready_ = true;
    append_message(out, "ready", {{"jobs", told_count_}});
  }
  return true;
}

bool PageStream::tell_changes(std::string& out) {
  if (changed_.empty() && removed_.empty()) {
    const std::lock_guard lock(news_.mutex);
    changed_.assign(news_.changed.begin(), news_.changed.end());
    news_.changed.clear();
    removed_ = std::exchange(news_.removed, {});
  }
  for (; !changed_.empty() && out.size() < kPieceBytesMax; changed_.pop_front()) {
    if (!look(out, changed_.front())) return false;
  }
  if (!changed_.empty()) return true;
  for (const std::string& id : removed_) {
    append_message(out, "deleted", {{"id", id}});
    std::erase_if(told_, [&](const auto& told) { return told.second.id == id; });
  }
  removed_.clear();
  return true;
}

void PageStream::tell_progress(std::string& out) {
  wake_after_.reset();
  const auto now = clock_();
  std::vector<std::int64_t> due;
  {
    const std::lock_guard lock(news_.mutex);
    if (news_.progressed.empty()) return;
    if (next_tick_ && now < *next_tick_) {
      wake_after_ = std::chrono::ceil<std::chrono::milliseconds>(*next_tick_ - now);
      return;
    }
    while (!news_.progressed.empty() && due.size() < kProgressPerTickMax) {
      due.push_back(news_.progressed.front());
      news_.in_turn.erase(due.back());
      news_.progressed.pop_front();
    }
    if (!news_.progressed.empty()) wake_after_ = kPageTick;
  }
  next_tick_ = now + kPageTick;
  for (const std::int64_t key : due) {
    const auto told = told_.find(key);
    if (told == told_.end()) continue;  // not told of yet: the job itself is news then
    // None: no runner any more, and that is news too.
    if (const auto text = pages_.progress_of(key, told->second.id, told->second.state)) out += *text;
  }
}

http::BodySource::Pull PageStream::pull(std::string& out) {
  wake_after_.reset();
  if (std::exchange(is_first_, false)) out += "retry: 2000\n\n";
  {
    const std::lock_guard lock(news_.mutex);
    if (news_.is_too_much) {
      out += "event: lagged\ndata: {}\n\n";
      return Pull::kEnd;
    }
  }
  if (!is_ready_) return begin(out) ? Pull::kMore : Pull::kEnd;
  if (!tell_changes(out)) return Pull::kEnd;
  if (!changed_.empty()) return Pull::kMore;
  tell_progress(out);
  return Pull::kWait;
}

}  // namespace colony::server::api
