#include "server/jobs/live.hpp"

#include <algorithm>
#include <utility>

namespace colony::server {
namespace {

constexpr std::chrono::milliseconds kSampleEvery{200};
constexpr std::size_t kSamplesMax = 50;  // 10 s: long enough for one slow search, short enough to follow

std::optional<double> fraction_of(double time_h, std::uint64_t cells, const std::optional<double>& until_time_h,
                                  const std::optional<std::uint64_t>& until_cells) {
  std::optional<double> fraction;
  if (until_time_h && *until_time_h > 0.0) fraction = time_h / *until_time_h;
  if (until_cells && *until_cells > 0) {
    fraction = std::max(fraction.value_or(0.0), static_cast<double>(cells) / static_cast<double>(*until_cells));
  }
  if (fraction) fraction = std::clamp(*fraction, 0.0, 1.0);
  return fraction;
}

}  // namespace

class Hub::Entry : public JobService::Subscription {
 public:
  Entry(std::shared_ptr<Hub> hub, std::optional<std::int64_t> job_key, std::function<void(const JobNews&)> hear)
      : hub_(std::move(hub)), job_key_(job_key), hear_(std::move(hear)) {
    const std::lock_guard lock(hub_->mutex_);
    hub_->followers_[job_key_].insert(this);
  }
  ~Entry() override {
    const std::lock_guard lock(hub_->mutex_);
    const auto found = hub_->followers_.find(job_key_);
    found->second.erase(this);
    if (found->second.empty()) hub_->followers_.erase(found);
  }
  void hear(const JobNews& news) const { hear_(news); }

 private:
  const std::shared_ptr<Hub> hub_;  // a subscription may outlive the service
  const std::optional<std::int64_t> job_key_;
  const std::function<void(const JobNews&)> hear_;
};

std::unique_ptr<JobService::Subscription> Hub::follow(std::optional<std::int64_t> job_key,
                                                      std::function<void(const JobNews&)> hear) {
  return std::make_unique<Entry>(shared_from_this(), job_key, std::move(hear));
}

void Hub::announce(const JobNews& news) {
  const std::lock_guard lock(mutex_);
  for (const auto& key : {std::optional(news.job_key), std::optional<std::int64_t>()}) {
    const auto found = followers_.find(key);
    if (found == followers_.end()) continue;
    for (const Entry* entry : found->second) entry->hear(news);
  }
}

Progress progress_of(const JobRow& job) {
  Progress progress;
  progress.last_seq = job.last_seq;
  progress.time_h = job.time_h;
  progress.cells = job.cell_count;
  progress.active = job.active_count;
  progress.passive = job.passive_count;
  progress.senescent = job.senescent_count;
  progress.fraction = job.state == JobState::kSucceeded
                          ? std::optional<double>(1.0)
                          : fraction_of(job.time_h, job.cell_count, job.until_time_h, job.until_cells);
  return progress;
}

LiveJob::LiveJob(const JobRow& job)
    : until_time_h_(job.until_time_h), until_cells_(job.until_cells), last_(progress_of(job)) {}

void LiveJob::ask(Wish wish) {
  Wish now = wish_.load();
  while (now < wish && !wish_.compare_exchange_weak(now, wish)) {
  }
  if (wish != Wish::kNone) stop_.store(true);
}

void LiveJob::committed(const JobRow& job) {
  const std::lock_guard lock(mutex_);
  has_committed_.store(true, std::memory_order_release);
  last_ = progress_of(job);
  const Clock::time_point now = Clock::now();
  if (!samples_.empty() && now - samples_.back().at < kSampleEvery) return;
  samples_.push_back({now, last_.cells, last_.fraction.value_or(0.0)});
  if (samples_.size() > kSamplesMax) samples_.pop_front();
}

void LiveJob::progressed(const Progress& progress) {
  const std::lock_guard lock(mutex_);
  last_ = progress;
  const Clock::time_point now = Clock::now();
  if (!samples_.empty() && now - samples_.back().at < kSampleEvery) return;
  samples_.push_back({now, last_.cells, last_.fraction.value_or(0.0)});
  if (samples_.size() > kSamplesMax) samples_.pop_front();
}

Progress LiveJob::progress() const {
  const std::lock_guard lock(mutex_);
  Progress progress = last_;
  if (samples_.empty()) return progress;
  // Up to now, not up to the last commit: a rate must fall while nothing happens.
  const double seconds = std::chrono::duration<double>(Clock::now() - samples_.front().at).count();
  if (seconds <= 0.2) return progress;  // too short to say anything
  const Sample& first = samples_.front();
  progress.cells_per_s = (static_cast<double>(last_.cells) - static_cast<double>(first.cells)) / seconds;
  if (last_.fraction && *last_.fraction > first.fraction) {
    progress.eta_s = (1.0 - *last_.fraction) * seconds / (*last_.fraction - first.fraction);
  }
  return progress;
}

}  // namespace colony::server
