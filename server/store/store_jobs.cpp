// Jobs: submit, find, list, and every change of state. Each write is one task of the writer: read, decide, write, commit.
#include <algorithm>
#include <limits>
#include <utility>

#include "server/store/append.hpp"
#include "server/store/event_rows.hpp"
#include "server/store/finished_event.hpp"
#include "server/store/identity.hpp"
#include "server/store/job_rows.hpp"
#include "server/store/sqlite_store.hpp"

namespace colony::server {
namespace {

Error no_job() { return {ErrorCode::kNotFound, "there is no such job"}; }

Error wrong_state(const JobRow& job) {
  return {ErrorCode::kConflict, (is_terminal(job.state) ? "the job has already ended: it is " : "the job is ") +
                                    std::string(name_of(job.state))};
}

/// Sets the state and everything that goes with it, writes the row and a line of the log.
void change_state(Connection& connection, JobRow& job, JobState to, const std::string& reason,
                  const std::string& detail, const std::string& actor = {}) {
  std::string line = std::string(name_of(job.state)) + " -> " + std::string(name_of(to));
  if (!reason.empty()) line += " (" + reason + ")";
  line += " at event " + std::to_string(job.last_seq);
  if (!detail.empty()) line += ": " + detail;
  job.state = to;
  job.reason = reason;
  job.detail = detail;
  job.command.clear();
  ++job.revision;
  if (to == JobState::kRunning && job.started_at.empty()) job.started_at = wall_time_text();
  if (is_terminal(to)) job.finished_at = wall_time_text();
  update_job_row(connection, job);
  insert_log_row(connection, job.job_key, to == JobState::kFailed ? "error" : "info", line, actor);
}

Result<Store::Commanded> wish(Connection& connection, JobRow job, const std::string& command, const std::string& actor) {
  if (job.command == command) return Store::Commanded{std::move(job), false, true};
  job.command = command;
  update_job_row(connection, job);
  insert_log_row(connection, job.job_key, "info", command + " asked for", actor);
  return Store::Commanded{std::move(job), true, true};
}

Result<Store::Commanded> command_cancel(Connection& connection, JobRow job, const std::string& actor) {
  if (job.state == JobState::kCancelled) return Store::Commanded{std::move(job), false, false};
  if (is_terminal(job.state)) return wrong_state(job);
  if (job.state == JobState::kRunning) return wish(connection, std::move(job), "cancel", actor);
  const Event last = finished_event(job, FinishReason::kCancelled);
  write_event(connection, job.job_key, last);
  job.last_seq = last.seq;
  change_state(connection, job, JobState::kCancelled, "cancelled", "", actor);
  return Store::Commanded{std::move(job), true, false};
}

Result<Store::Commanded> command_pause(Connection& connection, JobRow job, const std::string& actor) {
  if (is_terminal(job.state)) return wrong_state(job);
  if (job.state == JobState::kRunning) {
    if (job.command == "cancel") return Error{ErrorCode::kConflict, "the job is being cancelled"};
    return wish(connection, std::move(job), "pause", actor);
  }
  if (job.state == JobState::kPaused && job.reason == "user") return Store::Commanded{std::move(job), false, false};
  change_state(connection, job, JobState::kPaused, "user", "", actor);
  return Store::Commanded{std::move(job), true, false};
}

Result<Store::Commanded> command_resume(Connection& connection, JobRow job, bool only_storage,
                                       const std::string& actor) {
  if (is_terminal(job.state)) return wrong_state(job);
  if (job.command == "cancel") return Error{ErrorCode::kConflict, "the job is being cancelled"};
  if (job.state != JobState::kPaused) {
    const bool pending = job.command == "pause";  // it will be paused in a moment; then it can be resumed
    return Store::Commanded{std::move(job), false, pending};
  }
  if (only_storage && job.reason != "storage") return Store::Commanded{std::move(job), false, false};
  change_state(connection, job, JobState::kQueued, "", "", actor);
  return Store::Commanded{std::move(job), true, false};
}

std::map<std::string, std::string> with_changes(std::map<std::string, std::string> labels, const JobTextChange& change) {
  if (change.drops_labels) labels.clear();
  for (const auto& [key, value] : change.labels) {
    if (value) {
      labels[key] = *value;
    } else {
      labels.erase(key);
    }
  }
  return labels;
}

/// "renamed to ...; label plate = 8; label old removed", of what differs.
std::string text_change_line(const JobRow& job, const std::string& name,
                             const std::map<std::string, std::string>& labels) {
  std::string line;
  const auto say = [&line](const std::string& part) { line += (line.empty() ? "" : "; ") + part; };
  if (name != job.name) say(name.empty() ? "name removed" : "renamed to \"" + name + "\"");
  for (const auto& [key, value] : labels) {
    const auto before = job.labels.find(key);
    if (before == job.labels.end() || before->second != value) say("label " + key + " = \"" + value + "\"");
  }
  for (const auto& [key, value] : job.labels) {
    if (!labels.contains(key)) say("label " + key + " removed");
  }
  return line;
}

}  // namespace

Result<Store::Submitted> SqliteStore::create_job(const NewJob& job, std::size_t queued_max) {
  return write<Submitted>([&](Connection& connection) -> Result<Submitted> {
    auto same = find_submitted_row(connection, job);
    if (!same) return same.error();
    if (*same) return Submitted{std::move(**same), false};
    const std::uint64_t queued = count_queued_rows(connection);
    if (queued >= queued_max) {
      return Error{ErrorCode::kBusy,
                   std::to_string(queued) + " jobs are queued already; the limit is " + std::to_string(queued_max)};
    }
    const std::int64_t job_key = insert_job_row(connection, job);
    if (!job.idempotency_key.empty()) insert_used_key(connection, job, job_key);
    insert_log_row(connection, job_key, "info", "submitted by " + job.submitted_by, job.submitted_by);
    std::optional<JobRow> row = find_job_row(connection, job_key);
    if (!row) return no_job();
    return Submitted{std::move(*row), true};
  });
}

Result<std::optional<JobRow>> SqliteStore::find_submitted(const NewJob& job) {
  return readers_->read(
      [&](Connection& connection) -> Result<std::optional<JobRow>> { return find_submitted_row(connection, job); });
}

Result<JobRow> SqliteStore::find_job(const std::string& id) {
  return readers_->read([&](Connection& connection) -> Result<JobRow> {
    std::optional<JobRow> job = find_job_row(connection, id);
    if (!job) return Error{ErrorCode::kNotFound, "there is no job " + id};
    return std::move(*job);
  });
}

Result<JobRow> SqliteStore::find_job(std::int64_t job_key) {
  return readers_->read([&](Connection& connection) -> Result<JobRow> {
    std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    return std::move(*job);
  });
}

Result<JobPage> SqliteStore::list_jobs(const JobFilter& filter, std::size_t limit, const std::string& cursor) {
  std::int64_t before = std::numeric_limits<std::int64_t>::max();
  if (!cursor.empty()) {
    const auto key = cursor_key(cursor, cursor_salt_);
    if (!key)
      return Error{
          ErrorCode::kInvalid, "the cursor was not given by this server", {{"cursor", "not a cursor of this server"}}};
    before = *key;
  }
  constexpr std::size_t kPageMax = 100'000;
  constexpr std::size_t kPageSpecBytesMax = 4 << 20;
  if (limit == 0 || limit > kPageMax) {
    return Error{
        ErrorCode::kInvalid, "limit is out of range", {{"limit", "must lie in 1.." + std::to_string(kPageMax)}}};
  }
  return readers_->read([&](Connection& connection) -> Result<JobPage> {
    JobPage page;
    // One more tells whether there is a next page. A spec can be a megabyte (positions of founders), so a page is bounded in
    // bytes as well: it may have fewer items than asked for, and then `next`.
    page.items = list_job_rows(connection, filter, before, limit + 1, kPageSpecBytesMax);
    std::size_t spec_bytes = 0;
    for (const JobRow& job : page.items) spec_bytes += job.spec_json.size() + job.origin_json.size();
    if (page.items.size() > limit || (page.items.size() > 1 && spec_bytes > kPageSpecBytesMax)) {
      page.items.pop_back();
      page.next = cursor_text(page.items.back().job_key, cursor_salt_);
    }
    return page;
  });
}

Result<std::vector<std::uint64_t>> SqliteStore::count_jobs() {
  return readers_->read(
      [](Connection& connection) -> Result<std::vector<std::uint64_t>> { return count_job_rows(connection); });
}

Result<std::vector<JobRow>> SqliteStore::running_jobs() {
  return readers_->read([](Connection& connection) -> Result<std::vector<JobRow>> {
    JobFilter running;
    running.state = JobState::kRunning;
    std::vector<JobRow> jobs = list_job_rows(connection, running, std::numeric_limits<std::int64_t>::max(), 1'000'000);
    std::reverse(jobs.begin(), jobs.end());  // oldest first
    return jobs;
  });
}

Result<std::optional<JobRow>> SqliteStore::take_queued_job() {
  return write<std::optional<JobRow>>([](Connection& connection) -> Result<std::optional<JobRow>> {
    std::optional<JobRow> job = oldest_queued_row(connection);
    if (job) change_state(connection, *job, JobState::kRunning, "", "");
    return job;
  });
}

Result<JobRow> SqliteStore::set_state(std::int64_t job_key, const std::vector<JobState>& from, JobState to,
                                      const std::string& reason, const std::string& detail) {
  return write<JobRow>([&](Connection& connection) -> Result<JobRow> {
    std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    const bool expected = std::find(from.begin(), from.end(), job->state) != from.end();
    if (!expected || !may_follow(job->state, to) || is_terminal(to)) return wrong_state(*job);
    if (job->command == "cancel") return Error{ErrorCode::kConflict, "the job is being cancelled"};
    // A pause asked for stands, also when the disk stopped the job first: else it would go on by itself.
    const bool wished = to == JobState::kPaused && job->command == "pause";
    change_state(connection, *job, to, wished ? "user" : reason, detail);
    return std::move(*job);
  });
}

Result<JobRow> SqliteStore::finish_job(const EventBatch& last, JobState state, const std::string& reason,
                                       const std::string& detail) {
  if (!is_terminal(state) || last.events.empty() || last.events.back().kind() != EventKind::kFinished) {
    return Error{ErrorCode::kInternal, "a job ends in a terminal state with a finished event"};
  }
  return write<JobRow>(
      [&](Connection& connection) -> Result<JobRow> {
        std::optional<JobRow> job = find_job_row(connection, last.job_key);
        if (!job) return no_job();
        if (!may_follow(job->state, state)) return wrong_state(*job);
        const Status appended = append_batch(connection, last, *job);
        if (!appended) return appended.error();
        job->result_json = last.result_json;
        change_state(connection, *job, state, reason, detail);
        return std::move(*job);
      },
      /*in_order=*/true);
}

Result<Store::Commanded> SqliteStore::command_job(std::int64_t job_key, JobCommand command, const std::string& actor,
                                                  const RevisionCondition& condition) {
  return write<Commanded>([&](Connection& connection) -> Result<Commanded> {
    std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    if (!condition.holds(job->revision)) return Commanded{std::move(*job), false, false, false};
    switch (command) {
      case JobCommand::kCancel:
        return command_cancel(connection, std::move(*job), actor);
      case JobCommand::kPause:
        return command_pause(connection, std::move(*job), actor);
      case JobCommand::kResume:
        return command_resume(connection, std::move(*job), false, actor);
      case JobCommand::kResumeStorage:
        return command_resume(connection, std::move(*job), true, actor);
    }
    return Error{ErrorCode::kInternal, "unknown command"};
  });
}

Result<Store::TextUpdated> SqliteStore::update_job_text(std::int64_t job_key, const JobTextChange& change,
                                                        const RevisionCondition& condition, const std::string& actor) {
  return write<TextUpdated>([&](Connection& connection) -> Result<TextUpdated> {
    std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    if (!condition.holds(job->revision)) return TextUpdated{std::move(*job), false, false};
    const std::string name = change.name.value_or(job->name);
    std::map<std::string, std::string> labels = with_changes(job->labels, change);
    if (labels.size() > change.labels_max) {
      return Error{ErrorCode::kInvalid,
                   "the job would have too many labels",
                   {{"/labels", "would be " + std::to_string(labels.size()) + " labels; at most " +
                                    std::to_string(change.labels_max) + " are allowed"}}};
    }
    if (name == job->name && labels == job->labels) return TextUpdated{std::move(*job), false, true};
    const std::string line = text_change_line(*job, name, labels);
    job->name = name;
    job->labels = std::move(labels);
    ++job->revision;
    update_job_text_row(connection, *job);
    insert_log_row(connection, job_key, "info", line, actor);
    return TextUpdated{std::move(*job), true, true};
  });
}

Result<Store::Deleted> SqliteStore::delete_job(std::int64_t job_key, const RevisionCondition& condition) {
  auto deleted = write<Deleted>([&](Connection& connection) -> Result<Deleted> {
    std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    if (!condition.holds(job->revision)) return Deleted{std::move(*job), false};
    if (!is_terminal(job->state)) {
      return Error{ErrorCode::kConflict,
                   "the job is " + std::string(name_of(job->state)) + "; only an ended job can be deleted"};
    }
    mark_job_deleted(connection, job_key);
    return Deleted{std::move(*job), true};
  });
  if (deleted && deleted->is_current) writer_->wake_sweep();
  return deleted;
}

}  // namespace colony::server
