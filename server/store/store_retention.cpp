// Which ended jobs may go, and marking them. The sweeper removes what is marked.
#include <algorithm>

#include "engine/base/check.hpp"
#include "server/store/identity.hpp"
#include "server/store/job_rows.hpp"
#include "server/store/sqlite_store.hpp"

namespace colony::server {
namespace {

constexpr std::size_t kExpiredPerCall = 100;
constexpr std::int64_t kDay_ms = 86'400'000;

// Ended, without the label that protects, and read by no verify job that has still work to do. Of a fork nothing is asked: it has its
// own copy. (The spec of a verify job names its target.)
#define COLONY_MAY_GO                                                                                                  \
  " deleted = 0 AND state IN ('succeeded', 'failed', 'cancelled')"                                                     \
  " AND NOT EXISTS (SELECT 1 FROM label WHERE label.job_key = job.job_key AND label.name = 'keep' AND label.value = 'true')" \
  " AND NOT EXISTS (SELECT 1 FROM job AS v WHERE v.deleted = 0 AND v.state IN ('queued', 'running', 'paused')"         \
  " AND v.kind = 'verify' AND json_extract(v.spec, '$.job_id') = job.id)"

std::int64_t integer(Connection& connection, const char* sql) {
  Statement question = connection.prepare_once(sql);
  return question.step() ? question.integer(0) : 0;
}

/// Bytes of all histories: what the database fills, less the pictures of analyses, which have a limit of their own.
double history_bytes(Connection& connection) {
  const std::int64_t pages = integer(connection, "PRAGMA page_count") - integer(connection, "PRAGMA freelist_count");
  const std::int64_t images = integer(connection, "SELECT coalesce(sum(image_bytes), 0) FROM analysis");
  return std::max(0.0, static_cast<double>(pages * integer(connection, "PRAGMA page_size") - images));
}

std::vector<std::int64_t> keys_of(Statement& row) {
  std::vector<std::int64_t> keys;
  while (row.step()) keys.push_back(row.integer(0));
  return keys;
}

std::vector<std::int64_t> too_old(Connection& connection, std::uint64_t keep_days, std::int64_t now_ms) {
  const std::int64_t before_ms = now_ms - static_cast<std::int64_t>(keep_days) * kDay_ms;
  Statement row = connection.prepare_once("SELECT job_key FROM job WHERE" COLONY_MAY_GO
                                          " AND finished_at < ? ORDER BY finished_at, job_key LIMIT ?");
  row.bind(std::string_view(wall_time_text_at(before_ms))).bind(static_cast<std::int64_t>(kExpiredPerCall));
  return keys_of(row);
}

/// The bytes of a history are its share, by events, of those of all: exact in sum, and no page is counted.
std::vector<std::int64_t> too_much(Connection& connection, std::uint64_t keep_bytes) {
  // What is still being removed fills pages that no job owns.
  if (integer(connection, "SELECT EXISTS (SELECT 1 FROM job WHERE deleted <> 0)") != 0) return {};
  const auto events = static_cast<double>(integer(connection, "SELECT coalesce(sum(last_seq), 0) FROM job"));
  // Only of those that may go: what is protected must not push the others out.
  const auto ended =
      static_cast<double>(integer(connection, "SELECT coalesce(sum(last_seq), 0) FROM job WHERE" COLONY_MAY_GO));
  if (events <= 0.0) return {};
  const double bytes_per_event = history_bytes(connection) / events;
  double excess = ended * bytes_per_event - static_cast<double>(keep_bytes);
  std::vector<std::int64_t> keys;
  if (excess <= 0.0) return keys;
  Statement row = connection.prepare_once("SELECT job_key, last_seq FROM job WHERE" COLONY_MAY_GO
                                          " ORDER BY finished_at, job_key LIMIT ?");
  row.bind(static_cast<std::int64_t>(kExpiredPerCall));
  while (excess > 0.0 && row.step()) {
    keys.push_back(row.integer(0));
    excess -= bytes_per_event * row.real(1);
  }
  return keys;
}

}  // namespace

Result<std::vector<JobRow>> SqliteStore::expire_jobs(const RetentionLimits& limits, std::int64_t now_ms) {
  // Asked of a reader: mostly the answer is "none", and the list of jobs may be long.
  const auto expired = [&](Connection& connection) -> Result<std::vector<std::int64_t>> {
    std::vector<std::int64_t> keys;
    if (limits.keep_days > 0) keys = too_old(connection, limits.keep_days, now_ms);
    if (keys.empty() && limits.keep_bytes > 0) keys = too_much(connection, limits.keep_bytes);
    return keys;
  };
  const auto keys = readers_->read(expired);
  if (!keys) return keys.error();
  if (keys->empty()) return std::vector<JobRow>{};
  auto marked = write<std::vector<JobRow>>([&](Connection& connection) -> Result<std::vector<JobRow>> {
    std::vector<JobRow> rows;
    for (const std::int64_t job_key : *keys) {
      // Again, since a label or a verify job may have come.
      Statement& still = connection.prepared("SELECT 1 FROM job WHERE job_key = ? AND" COLONY_MAY_GO).bind(job_key);
      const bool may_go = still.step();
      still.reset();
      if (!may_go) continue;
      std::optional<JobRow> row = find_job_row(connection, job_key);
      CHECK(row.has_value());
      rows.push_back(std::move(*row));
      mark_job_deleted(connection, job_key);
    }
    return rows;
  });
  if (marked && !marked->empty()) writer_->wake_sweep();
  return marked;
}

#undef COLONY_MAY_GO

}  // namespace colony::server
