#include "server/store/job_rows.hpp"

#include <algorithm>
#include <limits>

#include "engine/base/check.hpp"
#include "engine/base/version.hpp"
#include "server/store/cell_index.hpp"
#include "server/store/identity.hpp"

namespace colony::server {
namespace {

#define COLONY_JOB_COLUMNS                                                                                             \
  "SELECT job_key, id, kind, name, state, reason, detail, command, submitted_by, created_at, started_at, finished_at," \
  " revision, last_seq, digest, engine_version, spec, until_time_h, until_cells, time_h, cell_count, active_count,"    \
  " passive_count, senescent_count, origin, result FROM job WHERE deleted = 0"

JobRow row_at(const Statement& row) {
  JobRow job;
  job.job_key = row.integer(0);
  job.id = row.text(1);
  job.kind = row.text(2);
  job.name = row.text(3);
  const auto state = job_state_from(row.text(4));
  if (!state) throw DbError(SQLITE_CORRUPT, "a job has an unknown state");
  job.state = *state;
  job.reason = row.text(5);
  job.detail = row.text(6);
  job.command = row.text(7);
  job.submitted_by = row.text(8);
  job.created_at = row.text(9);
  job.started_at = row.text(10);
  job.finished_at = row.text(11);
  job.revision = static_cast<std::uint64_t>(row.integer(12));
  job.last_seq = static_cast<std::uint64_t>(row.integer(13));
  const auto digest = row.blob(14);
  if (digest.size() != job.digest.bytes.size()) throw DbError(SQLITE_CORRUPT, "a job has a digest of another length");
  std::copy(digest.begin(), digest.end(), job.digest.bytes.begin());
  job.engine_version = row.text(15);
  job.spec_json = row.text(16);
  job.until_time_h = row.optional_real(17);
  if (!row.is_null(18)) job.until_cells = static_cast<std::uint64_t>(row.integer(18));
  job.time_h = row.real(19);
  job.cell_count = static_cast<std::uint64_t>(row.integer(20));
  job.active_count = static_cast<std::uint64_t>(row.integer(21));
  job.passive_count = static_cast<std::uint64_t>(row.integer(22));
  job.senescent_count = static_cast<std::uint64_t>(row.integer(23));
  job.origin_json = row.text(24);
  job.result_json = row.text(25);
  return job;
}

void read_labels(Connection& connection, JobRow& job) {
  Statement& row = connection.prepared("SELECT name, value FROM label WHERE job_key = ?");
  row.bind(job.job_key);
  while (row.step()) job.labels.emplace(row.text(0), row.text(1));
}

void insert_labels(Connection& connection, std::int64_t job_key, const std::map<std::string, std::string>& labels) {
  for (const auto& [name, value] : labels) {
    Statement& to = connection.prepared("INSERT INTO label VALUES (?, ?, ?)");
    to.bind(job_key).bind(std::string_view(name)).bind(std::string_view(value)).run();
  }
}

std::optional<JobRow> first_row(Connection& connection, Statement& statement) {
  if (!statement.step()) return std::nullopt;
  JobRow job = row_at(statement);
  statement.reset();
  read_labels(connection, job);
  return job;
}

struct Condition {
  bool is_label = false;
  std::string name;  // of a label (a client's text), else of a column (ours)
  std::string value;
};

std::vector<Condition> conditions_of(const JobFilter& filter) {
  std::vector<Condition> out;
  if (filter.state) out.push_back({false, "state", std::string(name_of(*filter.state))});
  if (filter.kind) out.push_back({false, "kind", *filter.kind});
  if (filter.name) out.push_back({false, "name", *filter.name});
  for (const auto& [name, value] : filter.labels) out.push_back({true, name, value});
  return out;
}

void bind_condition(Statement& to, const Condition& condition) {
  if (condition.is_label) {
    to.bind(std::string_view(condition.name));
  } else {
    to.skip(1);
  }
  to.bind(std::string_view(condition.value));
}

/// Which condition the fewest jobs before `before` fulfil, as far as that can be told by looking at kLookedAtMax of each. Each has an index in the
/// order of the list; the one of this condition is walked, and the others are tried on what it gives: a condition of most jobs with one of a
/// few then costs what the few do.
std::size_t rarest_of(Connection& connection, const std::vector<Condition>& conditions, std::int64_t before) {
  constexpr int kLookedAtMax = 2000;
  std::size_t rarest = 0;
  std::int64_t count_min = kLookedAtMax + 1;
  for (std::size_t i = 0; i < conditions.size() && conditions.size() > 1; ++i) {
    const Condition& condition = conditions[i];
    const std::string where = condition.is_label ? "label WHERE name = ?3 AND value = ?4"
                                                 : "job WHERE deleted = 0 AND " + condition.name + " = ?4";
    Statement row = connection.prepare_once("SELECT count(*) FROM (SELECT 1 FROM " + where +
                                            " AND job_key < ?1 LIMIT ?2)");
    row.bind(before).bind(std::int64_t{kLookedAtMax});
    bind_condition(row, condition);
    if (!row.step() || row.integer(0) >= count_min) continue;
    count_min = row.integer(0);
    rarest = i;
  }
  return rarest;
}

}  // namespace

std::optional<JobRow> find_job_row(Connection& connection, std::int64_t job_key) {
  return first_row(connection, connection.prepared(COLONY_JOB_COLUMNS " AND job_key = ?").bind(job_key));
}

std::optional<JobRow> find_job_row(Connection& connection, const std::string& id) {
  return first_row(connection, connection.prepared(COLONY_JOB_COLUMNS " AND id = ?").bind(std::string_view(id)));
}

std::optional<JobRow> oldest_queued_row(Connection& connection) {
  return first_row(connection,
                   connection.prepared(COLONY_JOB_COLUMNS " AND state = 'queued' ORDER BY job_key LIMIT 1"));
}

std::vector<JobRow> list_job_rows(Connection& connection, const JobFilter& filter, std::int64_t before,
                                  std::size_t limit, std::size_t spec_bytes_max) {
  const std::vector<Condition> conditions = conditions_of(filter);
  const std::size_t rarest = rarest_of(connection, conditions, before);
  std::string sql = COLONY_JOB_COLUMNS " AND job_key < ?1";
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const std::string first = "?" + std::to_string(2 * i + 3), second = "?" + std::to_string(2 * i + 4);
    if (!conditions[i].is_label) {
      // With the unary plus SQLite does not walk this condition's index.
      sql += std::string(" AND ") + (i == rarest ? "" : "+") + conditions[i].name + " = " + second;
    } else if (i == rarest) {
      const std::string_view from = "FROM job ";
      sql.replace(sql.find(from), from.size(),
                  "FROM (SELECT job_key FROM label WHERE name = " + first + " AND value = " + second +
                      ") CROSS JOIN job USING (job_key) ");
    } else {
      sql += " AND EXISTS (SELECT 1 FROM label WHERE label.job_key = job.job_key AND label.name = " + first +
             " AND label.value = " + second + ")";
    }
  }
  sql += " ORDER BY job_key DESC LIMIT ?2";
  Statement row = connection.prepare_once(sql);
  row.bind(before).bind(static_cast<std::int64_t>(limit));
  for (const Condition& condition : conditions) bind_condition(row, condition);
  std::vector<JobRow> jobs;
  std::size_t spec_bytes = 0;
  while ((jobs.empty() || spec_bytes <= spec_bytes_max) && row.step()) {
    jobs.push_back(row_at(row));
    spec_bytes += jobs.back().spec_json.size() + jobs.back().origin_json.size();
  }
  for (JobRow& job : jobs) read_labels(connection, job);
  return jobs;
}

std::vector<std::uint64_t> count_job_rows(Connection& connection) {
  std::vector<std::uint64_t> counts(kJobStateCount, 0);
  Statement& row = connection.prepared("SELECT state, count(*) FROM job WHERE deleted = 0 GROUP BY state");
  while (row.step()) {
    const auto state = job_state_from(row.text(0));
    if (state) counts[static_cast<std::size_t>(*state)] = static_cast<std::uint64_t>(row.integer(1));
  }
  return counts;
}

std::uint64_t count_queued_rows(Connection& connection) {
  Statement& row = connection.prepared("SELECT count(*) FROM job WHERE deleted = 0 AND state = 'queued'");
  CHECK(row.step());  // an aggregate has its row
  const auto count = static_cast<std::uint64_t>(row.integer(0));
  row.reset();
  return count;
}

std::int64_t insert_job_row(Connection& connection, const NewJob& job) {
  Statement& to = connection.prepared(
      "INSERT INTO job (id, kind, name, state, reason, detail, submitted_by, created_at, revision, last_seq, digest,"
      " engine_version, spec, origin, until_time_h, until_cells, time_h, cell_count, active_count, passive_count, "
      "senescent_count)"
      " VALUES (?, ?, ?, 'queued', '', '', ?, ?, 1, 0, ?, ?, ?, ?, ?, ?, 0, 0, 0, 0, 0)");
  to.bind(std::string_view(new_job_id())).bind(std::string_view(job.kind)).bind(std::string_view(job.name));
  to.bind(std::string_view(job.submitted_by));
  to.bind(std::string_view(wall_time_text())).bind_blob(Digest{}.bytes).bind(std::string_view(engine_version_text()));
  to.bind(std::string_view(job.spec_json)).bind_text_or_null(job.origin_json).bind(job.until_time_h);
  if (job.until_cells) {
    to.bind(static_cast<std::int64_t>(*job.until_cells));
  } else {
    to.bind_null();
  }
  to.run();
  const std::int64_t job_key = connection.last_rowid();
  insert_labels(connection, job_key, job.labels);
  return job_key;
}

void update_job_text_row(Connection& connection, const JobRow& job) {
  Statement& to = connection.prepared("UPDATE job SET name = ?, revision = ? WHERE job_key = ?");
  to.bind(std::string_view(job.name)).bind(static_cast<std::int64_t>(job.revision)).bind(job.job_key).run();
  connection.prepared("DELETE FROM label WHERE job_key = ?").bind(job.job_key).run();
  insert_labels(connection, job.job_key, job.labels);
}

void update_job_row(Connection& connection, const JobRow& job) {
  Statement& to = connection.prepared(
      "UPDATE job SET state = ?, reason = ?, detail = ?, command = ?, started_at = ?, finished_at = ?, revision = ?,"
      " last_seq = ?, digest = ?, time_h = ?, cell_count = ?, active_count = ?, passive_count = ?, senescent_count = ?,"
      " result = ? WHERE job_key = ?");
  to.bind(name_of(job.state)).bind(std::string_view(job.reason)).bind(std::string_view(job.detail));
  to.bind_text_or_null(job.command).bind_text_or_null(job.started_at).bind_text_or_null(job.finished_at);
  to.bind(static_cast<std::int64_t>(job.revision)).bind(static_cast<std::int64_t>(job.last_seq));
  to.bind_blob(job.digest.bytes).bind(job.time_h);
  for (const std::uint64_t count : {job.cell_count, job.active_count, job.passive_count, job.senescent_count}) {
    to.bind(static_cast<std::int64_t>(count));
  }
  to.bind_text_or_null(job.result_json).bind(job.job_key).run();
}

Result<std::optional<JobRow>> find_submitted_row(Connection& connection, const NewJob& job) {
  if (job.idempotency_key.empty()) return std::optional<JobRow>();
  Statement& row = connection.prepared("SELECT job_key, body_hash FROM idempotency WHERE submitted_by = ? AND key = ?");
  row.bind(std::string_view(job.submitted_by)).bind(std::string_view(job.idempotency_key));
  if (!row.step()) return std::optional<JobRow>();
  const std::int64_t job_key = row.integer(0);
  const bool is_same = row.text(1) == job.body_hash;
  row.reset();
  if (!is_same) {
    return Error{ErrorCode::kKeyReused,
                 "the idempotency key was used with another body",
                 {{"Idempotency-Key", "used before with another body"}}};
  }
  std::optional<JobRow> same = find_job_row(connection, job_key);
  CHECK(same.has_value());  // a key goes with its job
  return same;
}

void insert_used_key(Connection& connection, const NewJob& job, std::int64_t job_key) {
  Statement& to = connection.prepared("INSERT INTO idempotency VALUES (?, ?, ?, ?)");
  to.bind(std::string_view(job.submitted_by)).bind(std::string_view(job.idempotency_key));
  to.bind(std::string_view(job.body_hash)).bind(job_key).run();
}

void insert_log_row(Connection& connection, std::int64_t job_key, const std::string& level,
                    const std::string& message, const std::string& actor) {
  Statement& to = connection.prepared(
      "INSERT INTO job_log (job_key, line, at, level, message, actor)"
      " SELECT ?1, coalesce(max(line), 0) + 1, ?2, ?3, ?4, ?5 FROM job_log WHERE job_key = ?1");
  to.bind(job_key)
      .bind(std::string_view(wall_time_text()))
      .bind(std::string_view(level))
      .bind(std::string_view(message))
      .bind(std::string_view(actor));
  to.run();
}

std::vector<LogRow> read_log_rows(Connection& connection, std::int64_t job_key, std::int64_t after_index,
                                  std::size_t limit) {
  Statement& row = connection.prepared(
      "SELECT line, at, level, message, actor FROM job_log WHERE job_key = ? AND line > ? ORDER BY line LIMIT ?");
  constexpr auto kMax = static_cast<std::size_t>(std::numeric_limits<std::int64_t>::max());
  row.bind(job_key).bind(after_index).bind(static_cast<std::int64_t>(std::min(limit, kMax)));
  std::vector<LogRow> lines;
  while (row.step()) lines.push_back({row.integer(0), row.text(1), row.text(2), row.text(3), row.text(4)});
  return lines;
}

void mark_unmade_jobs_deleted(Connection& connection) {
  Statement unmade = connection.prepare_once("SELECT job_key FROM job WHERE deleted = 2");
  std::vector<std::int64_t> job_keys;
  while (unmade.step()) job_keys.push_back(unmade.integer(0));
  for (const std::int64_t job_key : job_keys) mark_job_deleted(connection, job_key);
}

void mark_job_deleted(Connection& connection, std::int64_t job_key) {
  for (const char* sql : {"UPDATE job SET deleted = 1 WHERE job_key = ?", "DELETE FROM label WHERE job_key = ?",
                          "DELETE FROM idempotency WHERE job_key = ?"}) {
    connection.prepared(sql).bind(job_key).run();
  }
}

bool sweep_deleted(Connection& connection, std::int64_t seqs) {
  Statement& marked = connection.prepared("SELECT job_key FROM job WHERE deleted = 1 LIMIT 1");
  if (!marked.step()) return false;
  const std::int64_t job_key = marked.integer(0);
  marked.reset();
  Statement& first = connection.prepared("SELECT min(seq) FROM event WHERE job_key = ?").bind(job_key);
  const bool has_events = first.step() && !first.is_null(0);
  const std::int64_t end = has_events ? first.integer(0) + seqs : 0;
  first.reset();
  if (has_events) {
    for (const char* sql :
         {"DELETE FROM placement WHERE job_key = ? AND seq < ?", "DELETE FROM woken WHERE job_key = ? AND seq < ?",
          "DELETE FROM event WHERE job_key = ? AND seq < ?"}) {
      connection.prepared(sql).bind(job_key).bind(end).run();
    }
    return true;
  }
  if (sweep_cell_index(connection, job_key)) return true;
  for (const char* sql : {"DELETE FROM series WHERE job_key = ?", "DELETE FROM job_log WHERE job_key = ?",
                          "DELETE FROM job WHERE job_key = ?"}) {
    connection.prepared(sql).bind(job_key).run();
  }
  return true;
}

#undef COLONY_JOB_COLUMNS

}  // namespace colony::server
