#include "server/api/pages.hpp"

#include <algorithm>
#include <pthread.h>

#include "engine/base/check.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/feed.hpp"

namespace colony::server::api {

Pages::Subscription::Subscription(Pages& pages, std::function<void(const News&)> hear)
    : pages_(pages), hear_(std::move(hear)) {
  {
    const std::lock_guard lock(pages_.watchers_mutex_);
    pages_.watchers_.insert(this);
  }
  const std::lock_guard lock(pages_.mutex_);
  ++pages_.watcher_count_;
}

Pages::Subscription::~Subscription() {
  {
    const std::lock_guard lock(pages_.watchers_mutex_);
    pages_.watchers_.erase(this);
  }
  const std::lock_guard lock(pages_.mutex_);
  if (--pages_.watcher_count_ > 0) return;
  // From here on no news are heard, so nothing that is kept can be known to be true.
  pages_.news_ = News();
  pages_.messages_.clear();
  pages_.progress_.clear();
}

Pages::Pages(JobService& jobs, std::string base_path, Mode mode)
    : jobs_(jobs), base_path_(std::move(base_path)), mode_(mode) {}

// First the hub, so that nobody calls any more.
Pages::~Pages() {
  hub_.reset();
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  CHECK(watchers_.empty());
}

std::unique_ptr<Pages::Subscription> Pages::subscribe(std::function<void(const News&)> hear) {
  auto subscription = std::make_unique<Subscription>(*this, std::move(hear));
  const std::lock_guard lock(begin_mutex_);
  if (!hub_) hub_ = jobs_.follow(std::nullopt, [this](const JobNews& news) { this->hear(news); });
  if (mode_ == Mode::kOwnThread && !thread_.joinable()) thread_ = std::thread([this] { loop(); });
  return subscription;
}

// On the thread that announces, which is the store's writer most of the time.
void Pages::hear(const JobNews& news) {
  {
    const std::lock_guard lock(mutex_);
    if (watcher_count_ == 0) return;
    ++stamp_;
    if (const auto kept = messages_.find(news.job_key); kept != messages_.end()) kept->second.stamp = stamp_;
    if (const auto kept = progress_.find(news.job_key); kept != progress_.end()) kept->second.stamp = stamp_;
    switch (news.kind) {
      case JobNews::Kind::kCommit:
        if (!news_.progressed.insert(news.job_key).second) return;
        break;
      case JobNews::Kind::kChange:
        if (!news_.changed.insert(news.job_key).second) return;
        break;
      case JobNews::Kind::kRemoved:
        news_.removed.emplace_back(news.job_key, news.id);
        messages_.erase(news.job_key);
        progress_.erase(news.job_key);
        break;
    }
    if (news_.changed.size() + news_.removed.size() > kNewsMax) {
      news_ = News();
      news_.is_too_much = true;
    }
  }
  changed_.notify_one();
}

void Pages::distribute() {
  News news;
  {
    const std::lock_guard lock(mutex_);
    std::swap(news, news_);
  }
  const std::lock_guard lock(watchers_mutex_);
  for (const Subscription* watcher : watchers_) watcher->hear(news);
}

// As of feeds: waking and what follows from it take no more than about half of a core, however many pages there are.
std::chrono::microseconds Pages::pause() const {
  const std::lock_guard lock(watchers_mutex_);
  return std::min<std::chrono::microseconds>(kPauseMax, kPausePerWatcher * watchers_.size());
}

void Pages::loop() {
  pthread_setname_np(pthread_self(), "pages");  // as operators see it, per thread
  Clock::time_point not_before{};
  std::unique_lock lock(mutex_);
  while (!ending_) {
    const bool has_news =
        !news_.changed.empty() || !news_.progressed.empty() || !news_.removed.empty() || news_.is_too_much;
    if (!has_news) {
      changed_.wait(lock);
    } else if (Clock::now() < not_before) {
      changed_.wait_until(lock, not_before);
    } else {
      lock.unlock();
      distribute();
      not_before = Clock::now() + pause();
      lock.lock();
    }
  }
}

void Pages::keep(std::int64_t job_key, std::uint64_t stamp, const std::shared_ptr<const JobMessage>& message) {
  if (message->text.size() > kPageTextBytesMax) return;
  const std::lock_guard lock(mutex_);
  const auto kept = messages_.find(job_key);
  // News came meanwhile, or all was forgotten: whether it is still true is not known.
  if (kept == messages_.end() || kept->second.stamp != stamp) return;
  kept->second.made_at = stamp;
  kept->second.message = message;
}

Result<std::shared_ptr<const JobMessage>> Pages::message_of(std::int64_t job_key) {
  std::uint64_t stamp = 0;
  {
    const std::lock_guard lock(mutex_);
    if (messages_.size() >= kPageTextsMax && !messages_.contains(job_key)) messages_.clear();
    // The place is made before the reading, so that news which come meanwhile are noted in it.
    KeptMessage& kept = messages_[job_key];
    if (kept.stamp == 0) kept.stamp = ++stamp_;
    if (kept.message && kept.made_at == kept.stamp) return kept.message;
    stamp = kept.stamp;
  }
  const auto view = jobs_.show(job_key);
  if (!view) return view.error();
  auto message = message_of(*view);
  keep(job_key, stamp, message);
  return message;
}

std::shared_ptr<const JobMessage> Pages::message_of(const JobView& view) {
  const JobRow& job = view.job;
  std::uint64_t stamp = 0;
  {
    const std::lock_guard lock(mutex_);
    if (messages_.size() >= kPageTextsMax && !messages_.contains(job.job_key)) messages_.clear();
    KeptMessage& kept = messages_[job.job_key];
    if (kept.stamp == 0) kept.stamp = ++stamp_;
    // Whenever it was made: what says the same of the same revision is the same, but for rates.
    const JobMessage* const is = kept.message.get();
    if (is != nullptr && is->revision == job.revision && is->state == job.state && is->last_seq == job.last_seq) {
      return kept.message;
    }
    stamp = kept.stamp;
  }
  auto message = std::make_shared<JobMessage>(JobMessage{job.id, job.revision, job.last_seq, job.state, "event: job\ndata: "});
  append_job_text(message->text, view, base_path_);
  message->text += "\n\n";
  if (message->text.size() <= kPageTextBytesMax) {
    const std::lock_guard lock(mutex_);
    const auto kept = messages_.find(job.job_key);
    // Not known to be newer than all news: it is found by what it says alone.
    if (kept != messages_.end() && kept->second.stamp == stamp) kept->second = {stamp, 0, message};
  }
  return message;
}

std::shared_ptr<const std::string> Pages::progress_of(std::int64_t job_key, const std::string& id, JobState state) {
  std::uint64_t stamp = 0;
  {
    const std::lock_guard lock(mutex_);
    if (progress_.size() >= kPageTextsMax && !progress_.contains(job_key)) progress_.clear();
    KeptProgress& kept = progress_[job_key];
    if (kept.stamp == 0) kept.stamp = ++stamp_;
    if (kept.text && kept.made_at == kept.stamp && kept.state == state) return kept.text;
    stamp = kept.stamp;
  }
  const auto progress = jobs_.live_progress(job_key);
  std::shared_ptr<const std::string> text;
  if (progress) {
    Json data = {{"id", id}, {"state", name_of(state)}, {"last_seq", progress->last_seq}};
    data.update(encode_progress(*progress));
    text = std::make_shared<const std::string>("event: progress\ndata: " + to_text(data) + "\n\n");
  }
  const std::lock_guard lock(mutex_);
  const auto kept = progress_.find(job_key);
  if (kept == progress_.end()) return text;
  if (!text) {
    progress_.erase(kept);
  } else if (kept->second.stamp == stamp) {
    kept->second = {stamp, stamp, state, text};
  }
  return text;
}

}  // namespace colony::server::api
