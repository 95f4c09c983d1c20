// A job that begins with a copy of another one's rows. The copy is made in pieces, each a short task of the writer, so that growing jobs
// and requests wait for one piece at most; until the last one the job is marked as being made, and nobody sees it.
#include <algorithm>
#include <string>
#include <utility>

#include "server/store/cell_index.hpp"
#include "server/store/job_rows.hpp"
#include "server/store/sqlite_store.hpp"

namespace colony::server {
namespace {

constexpr std::uint64_t kSeqsPerPiece = 2000;  // some 5,000 rows: about 10 ms of the writer

Error gone() { return {ErrorCode::kNotFound, "the job to fork was deleted meanwhile"}; }

Error not_whole() { return {ErrorCode::kInternal, "the history to copy is not whole"}; }

Error queue_full(std::uint64_t queued, std::size_t queued_max) {
  return {ErrorCode::kBusy,
          std::to_string(queued) + " jobs are queued already; the limit is " + std::to_string(queued_max)};
}

/// All columns of a table but job_key, which comes first. From the schema, so that a column added later is copied too.
std::string columns_of(Connection& connection, const std::string& table) {
  Statement column = connection.prepare_once("SELECT name FROM pragma_table_info('" + table + "') WHERE name <> 'job_key' ORDER BY cid");
  std::string names;
  while (column.step()) names += ", " + column.text(0);
  return names;
}

void copy_rows(Connection& connection, const std::string& table, const std::string& condition, std::int64_t from, std::int64_t to,
               auto low, auto high) {
  const std::string columns = columns_of(connection, table);
  Statement copy = connection.prepare_once("INSERT INTO " + table + " (job_key" + columns + ") SELECT ?1" + columns + " FROM " + table +
                                           " WHERE job_key = ?2 AND " + condition);
  copy.bind(to).bind(from).bind(low).bind(high).run();
}

Status copy_piece(Connection& connection, std::int64_t from, std::int64_t to, std::uint64_t after, std::uint64_t last) {
  if (!find_job_row(connection, from)) return gone();  // it is being swept: rows may be missing
  for (const char* table : {"placement", "woken", "event"}) {
    copy_rows(connection, table, "seq > ?3 AND seq <= ?4", from, to, static_cast<std::int64_t>(after),
              static_cast<std::int64_t>(last));
  }
  if (static_cast<std::uint64_t>(connection.changes()) != last - after) return not_whole();  // of event, the last of the three
  index_cells_if_due(connection, to, last);
  return Ok{};
}

/// Whether the last event copied is the one of the tail.
bool fits(Connection& connection, std::int64_t job_key, const ForkTail& tail) {
  Statement& last = connection.prepared("SELECT digest, kind FROM event WHERE job_key = ? AND seq = ?");
  last.bind(job_key).bind(static_cast<std::int64_t>(tail.at_seq));
  if (!last.step()) return false;
  const auto digest = last.blob(0);
  const bool same = std::equal(digest.begin(), digest.end(), tail.digest.bytes.begin(), tail.digest.bytes.end()) &&
                    last.text(1) != "finished";
  last.reset();
  return same;
}

}  // namespace

Result<Store::Submitted> SqliteStore::fork_job(const NewJob& job, std::int64_t source_key, const ForkTail& tail,
                                               std::size_t queued_max, const std::atomic<bool>* stop) {
  // `created` with a key alone: the row that is being made.
  auto begun = write<Submitted>([&](Connection& connection) -> Result<Submitted> {
    auto same = find_submitted_row(connection, job);
    if (!same) return same.error();
    if (*same) return Submitted{std::move(**same), false};
    const std::uint64_t queued = count_queued_rows(connection);
    if (queued >= queued_max) return queue_full(queued, queued_max);
    Submitted made;
    made.job.job_key = insert_job_row(connection, job);
    connection.prepared("UPDATE job SET deleted = ? WHERE job_key = ?").bind(std::int64_t{kBeingMade}).bind(made.job.job_key).run();
    return made;
  });
  if (!begun || !begun->created) return begun;
  const std::int64_t job_key = begun->job.job_key;

  const auto copied = [&]() -> Status {
    for (std::uint64_t after = 0; after < tail.at_seq; after += kSeqsPerPiece) {
      if (stop != nullptr && stop->load()) return Error{ErrorCode::kUnavailable, "the server is shutting down"};
      const std::uint64_t last = std::min(after + kSeqsPerPiece, tail.at_seq);
      Status piece = writer_->request(
          [&](Connection& connection) { return copy_piece(connection, source_key, job_key, after, last); });
      if (!piece) return piece;
    }
    return Ok{};
  }();
  auto made = copied ? write<Submitted>([&](Connection& connection) -> Result<Submitted> {
    const std::optional<JobRow> source = find_job_row(connection, source_key);
    if (!source) return gone();
    // Rows for every whole hour before the last event: what a runner that goes on from here finds done.
    copy_rows(connection, "series", "time_h >= ?3 AND time_h < ?4", source_key, job_key, 0.0, tail.time_h);
    if (!fits(connection, job_key, tail)) return not_whole();
    auto same = find_submitted_row(connection, job);  // another request with this key may have been faster
    if (!same) return same.error();
    if (*same) return Submitted{std::move(**same), false};
    const std::uint64_t queued = count_queued_rows(connection);
    if (queued >= queued_max) return queue_full(queued, queued_max);
    connection.prepared("UPDATE job SET deleted = 0 WHERE job_key = ?").bind(job_key).run();
    std::optional<JobRow> row = find_job_row(connection, job_key);
    if (!row) return gone();
    row->last_seq = tail.at_seq;
    row->time_h = tail.time_h;
    row->digest = tail.digest;
    row->cell_count = tail.cell_count;
    row->active_count = tail.active_count;
    row->passive_count = tail.passive_count;
    row->senescent_count = tail.senescent_count;
    update_job_row(connection, *row);
    if (!job.idempotency_key.empty()) insert_used_key(connection, job, job_key);
    insert_log_row(connection, job_key, "info",
                   "submitted by " + job.submitted_by + " as a fork of job " + source->id + " at event " + std::to_string(tail.at_seq) +
                       ", digest " + tail.digest.hex(),
                   job.submitted_by);
    return Submitted{std::move(*row), true};
  }) : Result<Submitted>(copied.error());
  if (made && made->created) return made;
  // If not even this can be written, the next start does it.
  (void)writer_->request([&](Connection& connection) -> Status {
    mark_job_deleted(connection, job_key);
    return Ok{};
  });
  writer_->wake_sweep();
  return made;
}

}  // namespace colony::server
