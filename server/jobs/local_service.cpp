// The public face of the service; the threads behind it are in scheduler.cpp.
#include "server/jobs/local_service.hpp"

#include <cmath>
#include <utility>

namespace colony::server {
namespace {
constexpr std::size_t kSeriesPointsMax = 10'000;

Error no_colony(const JobRow& job) {
  return {ErrorCode::kNotFound, "job " + job.id + " has no colony: it is of kind " + job.kind};
}
}  // namespace

std::unique_ptr<JobService> JobService::create(Store& store, JobsConfig config, SpecDecoder decode, VerifyCodec verify) {
  return std::make_unique<LocalJobService>(store, std::move(config), std::move(decode), std::move(verify));
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
  if (created->created) {
    hub_->announce({created->job.job_key, JobNews::Kind::kChange});
    nudge_runners();
  }
  return Submitted{view_of(std::move(created->job)), created->created};
}

Result<JobView> LocalJobService::show(const std::string& id) {
  auto job = store_.find_job(id);
  if (!job) return job.error();
  return view_of(std::move(*job));
}

Result<std::optional<JobView>> LocalJobService::submitted_before(const NewJob& job) {
  auto row = store_.find_submitted(job);
  if (!row) return row.error();
  if (!*row) return std::optional<JobView>();
  return std::optional<JobView>(view_of(std::move(**row)));
}

Result<JobService::ForkPoint> LocalJobService::fork_point(const std::string& id, std::optional<double> at_h,
                                                          std::optional<std::uint64_t> at_seq) {
  auto job = store_.find_job(id);
  if (!job) return job.error();
  if (job->kind != kColonyKind) return no_colony(*job);
  const bool is_live = !is_terminal(job->state);
  std::uint64_t seq = at_seq.value_or(job->last_seq);
  if (seq > job->last_seq) {
    const std::string message = "the last event of the job is " + std::to_string(job->last_seq);
    if (is_live) return Error{ErrorCode::kNotReached, "the job has not reached this event", {{"/at_seq", message}}};
    return Error{ErrorCode::kInvalid, "the history ends before this event", {{"/at_seq", message}}};
  }
  if (at_h) {
    if (!std::isfinite(*at_h) || *at_h < 0.0) {
      return Error{ErrorCode::kInvalid, "at_h is out of range", {{"/at_h", "must be a finite number, 0 or more"}}};
    }
    if (is_live && *at_h > job->time_h) {
      return Error{ErrorCode::kNotReached,
                   "the job has not reached this time",
                   {{"/at_h", "the job is at " + std::to_string(job->time_h) + " h"}}};
    }
    if (*at_h < job->time_h) {
      const auto found = store_.seq_at(job->job_key, *at_h);
      if (!found) return found.error();
      seq = *found;
    }
  }
  if (!is_live && seq == job->last_seq) --seq;  // `finished` stays behind
  auto at = past_.colony_after(*job, seq);
  if (!at) return at.error();
  return ForkPoint{std::move(*job), seq, std::move(*at)};
}

Result<JobService::Submitted> LocalJobService::fork(const NewJob& job, const ForkPoint& point) {
  const Colony& colony = *point.at.colony;
  const ForkTail tail{point.at_seq,
                      colony.time_h(),
                      colony.digest(),
                      colony.cells().size(),
                      colony.count(Activity::kActive),
                      colony.count(Activity::kPassive),
                      colony.count(Activity::kSenescent)};
  auto made = store_.fork_job(job, point.origin.job_key, tail, config_.queued_max, &stop_copying_);
  if (!made) return made.error();
  if (made->created) nudge_runners();
  return Submitted{view_of(std::move(made->job)), made->created};
}

Result<JobView> LocalJobService::show(std::int64_t job_key) {
  auto job = store_.find_job(job_key);
  if (!job) return job.error();
  return view_of(std::move(*job));
}

std::optional<Progress> LocalJobService::live_progress(std::int64_t job_key) {
  const std::lock_guard lock(mutex_);
  const auto live = live_.find(job_key);
  return live == live_.end() ? std::nullopt : std::optional(live->second->progress());
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
                                                      const std::string& actor, const RevisionCondition& condition) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  const std::int64_t job_key = job->job_key;
  auto commanded = store_.command_job(job_key, what, actor, condition);  // durable from here on, whatever becomes of the notification
  if (!commanded) return commanded.error();
  if (!commanded->is_current) return Commanded{view_of(std::move(commanded->job)), false, false};
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
        // Without the condition: it held, and the pause that was waited for is a revision of its own.
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
  hub_->announce({job_key, JobNews::Kind::kChange});
  nudge_runners();
  return Commanded{view_of(std::move(commanded->job)), changed};
}

Result<JobService::Commanded> LocalJobService::cancel(const std::string& id, const std::string& actor,
                                                      const RevisionCondition& condition) {
  return command(id, JobCommand::kCancel, LiveJob::Wish::kCancel, actor, condition);
}

Result<JobService::Commanded> LocalJobService::pause(const std::string& id, const std::string& actor,
                                                     const RevisionCondition& condition) {
  return command(id, JobCommand::kPause, LiveJob::Wish::kPause, actor, condition);
}

Result<JobService::Commanded> LocalJobService::resume(const std::string& id, const std::string& actor,
                                                      const RevisionCondition& condition) {
  return command(id, JobCommand::kResume, LiveJob::Wish::kNone, actor, condition);
}

Result<JobService::Removed> LocalJobService::remove(const std::string& id, const RevisionCondition& condition) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  auto deleted = store_.delete_job(job->job_key, condition);
  if (!deleted) return deleted.error();
  if (deleted->is_current) forget(*job);
  return Removed{std::move(deleted->job), deleted->is_current};
}

void LocalJobService::forget(const JobRow& job) {
  past_.forget(job.job_key);
  {
    const std::lock_guard lock(mutex_);
    last_pause_.erase(job.job_key);
  }
  hub_->announce({job.job_key, JobNews::Kind::kRemoved, job.id});
}

Result<JobService::Edited> LocalJobService::edit(const std::string& id, const JobTextChange& change,
                                                 const RevisionCondition& condition, const std::string& actor) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  auto updated = store_.update_job_text(job->job_key, change, condition, actor);
  if (!updated) return updated.error();
  if (updated->changed) hub_->announce({job->job_key, JobNews::Kind::kChange});
  return Edited{view_of(std::move(updated->job)), updated->changed, updated->is_current};
}

Result<std::vector<Event>> LocalJobService::events(const std::string& id, const EventFilter& filter,
                                                   std::size_t limit) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  return store_.read_events(job->job_key, filter, limit);
}

Result<std::optional<std::uint64_t>> LocalJobService::page_end(const std::string& id, const EventFilter& filter,
                                                               std::size_t limit) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  return store_.page_end(job->job_key, filter, limit);
}

Result<std::vector<LogRow>> LocalJobService::log(const std::string& id, std::int64_t after_index, std::size_t limit) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  return store_.read_log(job->job_key, after_index, limit);
}

Result<std::uint64_t> LocalJobService::seq_of(const JobRow& job, std::optional<double> at_h) {
  if (!at_h) return job.last_seq;
  if (!std::isfinite(*at_h) || *at_h < 0.0) {
    return Error{ErrorCode::kInvalid, "at_h is out of range", {{"at_h", "must be a finite number, 0 or more"}}};
  }
  if (!is_terminal(job.state) && *at_h > job.time_h) {
    return Error{ErrorCode::kNotReached,
                 "the job has not reached this time",
                 {{"at_h", "the job is at " + std::to_string(job.time_h) + " h"}}};
  }
  if (*at_h < job.time_h) return store_.seq_at(job.job_key, *at_h);
  return job.last_seq;
}

Result<ColonyAt> LocalJobService::colony_at(const std::string& id, std::optional<double> at_h) {
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  if (job->kind != kColonyKind) return no_colony(*job);
  const auto seq = seq_of(*job, at_h);
  if (!seq) return seq.error();
  auto colony = past_.colony_after(*job, *seq);
  if (colony && at_h && *at_h < job->time_h) colony->time_h = *at_h;  // beyond the end: the final state, at its own time
  return colony;
}

Result<Moment> LocalJobService::moment(const std::string& id, std::optional<double> at_h) {
  auto job = store_.find_job(id);
  if (!job) return job.error();
  const auto seq = seq_of(*job, at_h);
  if (!seq) return seq.error();
  Moment moment{std::move(*job), *seq, {}};
  if (*seq == moment.job.last_seq) {
    moment.digest = moment.job.digest;
  } else if (*seq > 0) {
    EventFilter just_before;
    just_before.after = *seq - 1;
    const auto event = store_.read_events(moment.job.job_key, just_before, 1);
    if (!event) return event.error();
    if (event->empty()) return Error{ErrorCode::kInternal, "the stored history of job " + moment.job.id + " lacks event " + std::to_string(*seq)};
    moment.digest = event->front().digest;
  }
  return moment;
}

Result<std::vector<SeriesRow>> LocalJobService::series(const std::string& id, std::size_t points) {
  if (points < 1 || points > kSeriesPointsMax) {
    return Error{ErrorCode::kInvalid,
                 "points is out of range",
                 {{"points", "must lie in 1.." + std::to_string(kSeriesPointsMax)}}};
  }
  const auto job = store_.find_job(id);
  if (!job) return job.error();
  if (job->kind != kColonyKind) return no_colony(*job);
  return past_.series(*job, points);
}

std::unique_ptr<JobService::Subscription> LocalJobService::subscribe(std::int64_t job_key, std::function<void()> wake) {
  return hub_->follow(job_key, [wake = std::move(wake)](const JobNews&) { wake(); });
}

std::unique_ptr<JobService::Subscription> LocalJobService::follow(std::optional<std::int64_t> job_key,
                                                                  std::function<void(const JobNews&)> hear) {
  return hub_->follow(job_key, std::move(hear));
}

}  // namespace colony::server
