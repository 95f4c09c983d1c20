// The public face of the service; the threads behind it are in scheduler.cpp.
#include "server/jobs/local_service.hpp"

#include <cmath>
#include <utility>

namespace colony::server {
namespace {
constexpr std::size_t kSeriesPointsMax = 10'000;
}  // namespace

std::unique_ptr<JobService> JobService::create(Store& store, JobsConfig config, SpecDecoder decode) {
  return std::make_unique<LocalJobService>(store, config, std::move(decode));
}

JobView LocalJobService::view_of(JobRow job) {
  Progress progress = progress_of(job);
  const std::lock_guard lock(mutex_);
  if (job.state == JobState::kRunning) {
    if (const auto live = live_.find(job.job_key); live != live_.end()) {
      Progress fresher = live->second->progress();
      if (fresher.last_seq >= progress.last_seq) progress = std::move(fresher);
    } else if (stalled_.contains(job.job_key)) {
      // The store that stopped it could not even write that down.
      job.state = JobState::kPaused;
      job.reason = "storage";
    }
  }
  return {std::move(job), std::move(progress)};
}

Result<JobService::Submitted> LocalJobService::submit(const NewJob& job) {
  {
    const std::lock_guard lock(mutex_);
    if (draining_) return Error{ErrorCode::kUnavailable, "the server is shutting down"};
  }
  auto created = store_.create_job(job, config_.queued_max);
  if (!created) return created.error();
  if (created->created) nudge_runners();
  return Submitted{view_of(std::move(created->job)), created->created};
}

Result<JobView> LocalJobService::show(const std::string& id) {
  auto job = store_.find_job(id);
  if (!job) return job.error();
  return view_of(std::move(*job));
}

Result<JobService::Page> LocalJobService::list(const JobFilter& filter, std::size_t limit, const std::string& cursor) {
  auto rows = store_.list_jobs(filter, limit, cursor);
  if (!rows) return rows.error();
  Page page;
  page.next = std::move(rows->next);
  for (JobRow& row : rows->items) page.items.push_back(view_of(std::move(row)));
  return page;
}

Result<std::vector<std::uint64_t>> LocalJobService::counts() { return store_.count_jobs(); }

bool LocalJobService::wait_until_left(std::int64_t job_key) {
  std::unique_lock lock(mutex_);
  const auto left = [&] { return draining_ || !live_.contains(job_key); };
  return changed_.wait_for(lock, std::chrono::milliseconds(config_.command_wait_ms), left) && !live_.contains(job_key);
}

Result<JobService::Commanded> LocalJobService::command(const std::string& id, JobCommand what, LiveJob::Wish wish,
                                                      const std::string& actor) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  const std::int64_t job_key = job->job_key;
  auto commanded = store_.command_job(job_key, what, actor);  // durable from here on, whatever becomes of the notification
  if (!commanded) return commanded.error();
  bool changed = commanded->changed;
  if (commanded->pending) {
    {
      const std::lock_guard take_lock(take_mutex_);
      const std::lock_guard lock(mutex_);
      if (const auto live = live_.find(job_key); live != live_.end()) live->second->ask(wish);
    }
    if (wait_until_left(job_key)) {
      // The runner has left the job: paused, cancelled, or ended by itself before the wish reached it.
      if (what == JobCommand::kResume) {
        commanded = store_.command_job(job_key, what, actor);
        if (!commanded) return commanded.error();
        changed = changed || commanded->changed;
      } else {
        auto row = store_.find_job(job_key);
        if (!row) return row.error();
        const JobState wanted = what == JobCommand::kCancel ? JobState::kCancelled : JobState::kPaused;
        if (is_terminal(row->state) && row->state != wanted) {
          return Error{ErrorCode::kConflict, "the job has already ended: it is " + std::string(name_of(row->state))};
        }
        commanded->job = std::move(*row);
      }
    }
  }
  hub_->announce(job_key);
  nudge_runners();
  return Commanded{view_of(std::move(commanded->job)), changed};
}

Result<JobService::Commanded> LocalJobService::cancel(const std::string& id, const std::string& actor) {
  return command(id, JobCommand::kCancel, LiveJob::Wish::kCancel, actor);
}

Result<JobService::Commanded> LocalJobService::pause(const std::string& id, const std::string& actor) {
  return command(id, JobCommand::kPause, LiveJob::Wish::kPause, actor);
}

Result<JobService::Commanded> LocalJobService::resume(const std::string& id, const std::string& actor) {
  return command(id, JobCommand::kResume, LiveJob::Wish::kNone, actor);
}

Status LocalJobService::remove(const std::string& id) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  const Status removed = store_.delete_job(job->job_key);
  if (!removed) return removed.error();
  past_.forget(job->job_key);
  {
    const std::lock_guard lock(mutex_);
    last_pause_.erase(job->job_key);
  }
  hub_->announce(job->job_key);
  return Ok{};
}

Result<std::vector<Event>> LocalJobService::events(const std::string& id, const EventFilter& filter,
                                                   std::size_t limit) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  return store_.read_events(job->job_key, filter, limit);
}

Result<std::vector<LogRow>> LocalJobService::log(const std::string& id, std::int64_t after_index, std::size_t limit) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  return store_.read_log(job->job_key, after_index, limit);
}

Result<ColonyAt> LocalJobService::colony_at(const std::string& id, std::optional<double> at_h) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  if (!at_h) return past_.colony_after(*job, job->last_seq);
  if (!std::isfinite(*at_h) || *at_h < 0.0) {
    return Error{ErrorCode::kInvalid, "at_h is out of range", {{"at_h", "must be a finite number, 0 or more"}}};
  }
  if (!is_terminal(job->state) && *at_h > job->time_h) {
    return Error{ErrorCode::kNotReached,
                 "the job has not reached this time",
                 {{"at_h", "the job is at " + std::to_string(job->time_h) + " h"}}};
  }
  std::uint64_t seq = job->last_seq;
  if (*at_h < job->time_h) {
    const auto found = store_.seq_at(job->job_key, *at_h);
    if (!found) return found.error();
    seq = *found;
  }
  auto colony = past_.colony_after(*job, seq);
  if (colony && *at_h < job->time_h) colony->time_h = *at_h;  // beyond the end: the final state, at its own time
  return colony;
}

Result<std::vector<SeriesRow>> LocalJobService::series(const std::string& id, std::size_t points) {
  if (points < 1 || points > kSeriesPointsMax) {
    return Error{ErrorCode::kInvalid,
                 "points is out of range",
                 {{"points", "must lie in 1.." + std::to_string(kSeriesPointsMax)}}};
  }
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  return past_.series(*job, points);
}

std::unique_ptr<JobService::Subscription> LocalJobService::subscribe(std::int64_t job_key, std::function<void()> wake) {
  return hub_->subscribe(job_key, std::move(wake));
}

}  // namespace colony::server
