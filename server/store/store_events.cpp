// The event log: appended through the writer's queue, read in snapshots.
#include <memory>
#include <utility>

#include "engine/base/check.hpp"
#include "server/store/append.hpp"
#include "server/store/cell_index.hpp"
#include "server/store/event_rows.hpp"
#include "server/store/job_rows.hpp"
#include "server/store/sqlite_store.hpp"

namespace colony::server {
namespace {
Error no_job() { return {ErrorCode::kNotFound, "there is no such job"}; }
}  // namespace

Status append_batch(Connection& connection, const EventBatch& batch, JobRow& job) {
  for (const Event& event : batch.events) {
    if (event.seq != job.last_seq + 1) {
      return Error{ErrorCode::kConflict, "event " + std::to_string(event.seq) + " does not follow the stored event " +
                                             std::to_string(job.last_seq)};
    }
    CHECK(event.time_h >= job.time_h);
    write_event(connection, batch.job_key, event);
    job.last_seq = event.seq;
    job.time_h = event.time_h;
    job.digest = event.digest;
  }
  index_cells_if_due(connection, batch.job_key, job.last_seq);
  for (const SeriesRow& row : batch.series) write_series(connection, batch.job_key, row);
  job.cell_count = batch.cell_count;
  job.active_count = batch.active_count;
  job.passive_count = batch.passive_count;
  job.senescent_count = batch.senescent_count;
  return Ok{};
}

void SqliteStore::append_events(EventBatch batch, std::function<void(const Status&)> committed) {
  std::size_t rows = 1 + batch.series.size();
  for (const Event& event : batch.events) rows += row_count(event);
  const auto shared = std::make_shared<const EventBatch>(std::move(batch));
  WriteTask task;
  task.rows = rows;
  task.done = std::move(committed);
  task.run = [shared](Connection& connection) -> Status {
    std::optional<JobRow> job = find_job_row(connection, shared->job_key);
    if (!job) return no_job();
    if (job->state != JobState::kRunning) {
      return Error{ErrorCode::kConflict, "the job is " + std::string(name_of(job->state)) + ", not running"};
    }
    Status status = append_batch(connection, *shared, *job);
    if (!status) return status;
    update_job_row(connection, *job);
    return Ok{};
  };
  writer_->submit_bulk(std::move(task));
}

Status SqliteStore::flush() {
  return writer_->request_in_order([](Connection&) -> Status { return Ok{}; });
}

Result<std::vector<Event>> SqliteStore::read_events(std::int64_t job_key, const EventFilter& filter,
                                                    std::size_t limit) {
  return readers_->read([&](Connection& connection) -> Result<std::vector<Event>> {
    if (!find_job_row(connection, job_key)) return no_job();
    return server::read_events(connection, job_key, filter, limit);
  });
}

Result<std::optional<std::uint64_t>> SqliteStore::page_end(std::int64_t job_key, const EventFilter& filter,
                                                           std::size_t limit) {
  return readers_->read([&](Connection& connection) -> Result<std::optional<std::uint64_t>> {
    const std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    CHECK(limit >= 1);
    if (filter.kinds.empty() && !filter.cell_id) {  // dense: nothing need be counted
      const bool goes_on = filter.after < job->last_seq && job->last_seq - filter.after > limit;
      return goes_on ? std::optional(filter.after + limit) : std::nullopt;
    }
    return server::page_end(connection, job_key, filter, limit);
  });
}

Result<std::uint64_t> SqliteStore::seq_at(std::int64_t job_key, double at_h) {
  return readers_->read([&](Connection& connection) -> Result<std::uint64_t> {
    const std::optional<JobRow> job = find_job_row(connection, job_key);
    if (!job) return no_job();
    // seq is dense and time_h never falls with it: the answer lies in [low, high].
    std::uint64_t low = 0;
    std::uint64_t high = job->last_seq;
    while (low < high) {
      const std::uint64_t middle = low + (high - low + 1) / 2;
      Statement& row = connection.prepared("SELECT time_h FROM event WHERE job_key = ? AND seq = ?");
      row.bind(job_key).bind(static_cast<std::int64_t>(middle));
      if (!row.step()) throw DbError(SQLITE_CORRUPT, "an event is missing");
      const double time_h = row.real(0);
      row.reset();
      if (time_h <= at_h) {
        low = middle;
      } else {
        high = middle - 1;
      }
    }
    return low;
  });
}

Result<std::vector<SeriesRow>> SqliteStore::read_series(std::int64_t job_key) {
  return readers_->read([&](Connection& connection) -> Result<std::vector<SeriesRow>> {
    if (!find_job_row(connection, job_key)) return no_job();
    return server::read_series(connection, job_key);
  });
}

}  // namespace colony::server
