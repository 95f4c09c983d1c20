#include "server/store/sqlite_analyses.hpp"

#include <array>
#include <limits>
#include <utility>

#include "engine/base/check.hpp"
#include "server/store/identity.hpp"

namespace colony::server {
namespace {

constexpr std::array<std::string_view, 2> kKindNames = {"analysis", "comparison"};
constexpr std::array<std::string_view, 4> kStateNames = {"queued", "running", "succeeded", "failed"};

// `result` last: a list leaves it out, and what is before it can be read without it.
#define COLONY_ANALYSIS_COLUMNS                                                                             \
  "SELECT analysis_key, id, kind, name, state, failure_code, detail, created_at, finished_at, options, media_type," \
  " image_bytes, job_id, analysis_id, try_count,"                                                            \
  " kind = 'analysis' OR EXISTS (SELECT 1 FROM analysis AS source WHERE source.id = analysis.analysis_id)"

template <std::size_t kCount>
int index_in(const std::array<std::string_view, kCount>& names, const std::string& text) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (names[i] == text) return static_cast<int>(i);
  }
  throw DbError(SQLITE_CORRUPT, "an analysis has an unknown kind or state");
}

AnalysisRow row_at(const Statement& row, bool with_result) {
  AnalysisRow out;
  out.analysis_key = row.integer(0);
  out.id = row.text(1);
  out.kind = static_cast<AnalysisKind>(index_in(kKindNames, row.text(2)));
  out.name = row.text(3);
  out.state = static_cast<AnalysisState>(index_in(kStateNames, row.text(4)));
  out.failure_code = row.text(5);
  out.detail = row.text(6);
  out.created_at = row.text(7);
  out.finished_at = row.text(8);
  out.options_json = row.text(9);
  out.media_type = row.text(10);
  out.image_bytes = static_cast<std::uint64_t>(row.integer(11));
  out.job_id = row.text(12);
  out.analysis_id = row.text(13);
  out.try_count = static_cast<int>(row.integer(14));
  out.has_source = row.integer(15) != 0;
  if (with_result) out.result_json = row.text(16);
  return out;
}

std::optional<AnalysisRow> first_row(Statement& statement) {
  if (!statement.step()) return std::nullopt;
  AnalysisRow row = row_at(statement, true);
  statement.reset();
  return row;
}

std::uint64_t number(Connection& connection, const char* sql) {
  Statement& row = connection.prepared(sql);
  CHECK(row.step());  // an aggregate has its row
  const auto value = static_cast<std::uint64_t>(row.integer(0));
  row.reset();
  return value;
}

Error missing(AnalysisKind kind, const std::string& id) {
  return {ErrorCode::kNotFound, "there is no " + std::string(name_of(kind)) + " " + id};
}

Status check_room(Connection& connection, const NewAnalysis& analysis, const AnalysisLimits& limits) {
  if (!analysis.image.empty()) {
    const std::uint64_t stored = number(connection, "SELECT coalesce(sum(image_bytes), 0) FROM analysis");
    if (stored + analysis.image.size() > limits.stored_image_bytes_max) {
      return Error{ErrorCode::kLimit, "images of " + std::to_string(stored) + " bytes are stored; all together may have " +
                                          std::to_string(limits.stored_image_bytes_max) +
                                          " (limits.stored_image_bytes_max): delete analyses that are not needed"};
    }
  }
  if (analysis.result_json.empty()) {
    const std::uint64_t waiting =
        number(connection, "SELECT count(*) FROM analysis WHERE state IN ('queued', 'running')");
    if (waiting >= limits.queued_max) {
      return Error{ErrorCode::kBusy, std::to_string(waiting) + " analyses are not done yet; the limit is " +
                                         std::to_string(limits.queued_max)};
    }
  }
  return Ok{};
}

std::int64_t insert_row(Connection& connection, const NewAnalysis& analysis) {
  const bool is_done = !analysis.result_json.empty();
  const std::string now = wall_time_text();
  Statement& to = connection.prepared(
      "INSERT INTO analysis (id, kind, name, state, failure_code, detail, created_at, finished_at, options, media_type,"
      " image_bytes, job_id, analysis_id, try_count, result) VALUES (?, ?, ?, ?, '', '', ?, ?, ?, ?, ?, ?, ?, 0, ?)");
  to.bind(std::string_view(new_job_id())).bind(name_of(analysis.kind)).bind(std::string_view(analysis.name));
  to.bind(name_of(is_done ? AnalysisState::kSucceeded : AnalysisState::kQueued)).bind(std::string_view(now));
  to.bind_text_or_null(is_done ? now : std::string()).bind(std::string_view(analysis.options_json));
  to.bind_text_or_null(analysis.media_type).bind(static_cast<std::int64_t>(analysis.image.size()));
  to.bind_text_or_null(analysis.job_id).bind_text_or_null(analysis.analysis_id);
  to.bind_text_or_null(analysis.result_json).run();
  const std::int64_t key = connection.last_rowid();
  if (!analysis.image.empty()) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(analysis.image.data());
    connection.prepared("INSERT INTO analysis_image VALUES (?, ?)")
        .bind(key)
        .bind_lasting_blob({bytes, analysis.image.size()})
        .run();
  }
  return key;
}

std::optional<AnalysisRow> find_key(Connection& connection, std::int64_t key) {
  return first_row(
      connection.prepared(COLONY_ANALYSIS_COLUMNS ", result FROM analysis WHERE analysis_key = ?").bind(key));
}

std::optional<AnalysisRow> find_id(Connection& connection, AnalysisKind kind, const std::string& id) {
  return first_row(connection.prepared(COLONY_ANALYSIS_COLUMNS ", result FROM analysis WHERE id = ? AND kind = ?")
                       .bind(std::string_view(id))
                       .bind(name_of(kind)));
}

}  // namespace

std::string_view name_of(AnalysisKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }
std::string_view name_of(AnalysisState state) { return kStateNames[static_cast<std::size_t>(state)]; }

Result<AnalysisRow> SqliteAnalyses::create(const NewAnalysis& analysis, const AnalysisLimits& limits) {
  AnalysisRow made;
  const Status written = writer_.request([&](Connection& connection) -> Status {
    if (Status room = check_room(connection, analysis, limits); !room) return room;
    std::optional<AnalysisRow> row = find_key(connection, insert_row(connection, analysis));
    CHECK(row.has_value());
    made = std::move(*row);
    return Ok{};
  });
  if (!written) return written.error();
  return made;
}

Result<AnalysisRow> SqliteAnalyses::find(AnalysisKind kind, const std::string& id) {
  return readers_.read([&](Connection& connection) -> Result<AnalysisRow> {
    std::optional<AnalysisRow> row = find_id(connection, kind, id);
    if (!row) return missing(kind, id);
    return std::move(*row);
  });
}

Result<AnalysisPage> SqliteAnalyses::list(AnalysisKind kind, std::size_t limit, const std::string& cursor) {
  std::int64_t before = std::numeric_limits<std::int64_t>::max();
  if (!cursor.empty()) {
    const auto key = cursor_key(cursor, cursor_salt_);
    if (!key) {
      return Error{
          ErrorCode::kInvalid, "the cursor was not given by this server", {{"cursor", "not a cursor of this server"}}};
    }
    before = *key;
  }
  CHECK(limit >= 1 && limit <= 100'000);
  return readers_.read([&](Connection& connection) -> Result<AnalysisPage> {
    Statement& row = connection.prepared(COLONY_ANALYSIS_COLUMNS
                                         " FROM analysis WHERE kind = ? AND analysis_key < ?"
                                         " ORDER BY analysis_key DESC LIMIT ?");
    row.bind(name_of(kind)).bind(before).bind(static_cast<std::int64_t>(limit + 1));
    AnalysisPage page;
    while (row.step()) page.items.push_back(row_at(row, false));
    if (page.items.size() > limit) {
      page.items.pop_back();
      page.next = cursor_text(page.items.back().analysis_key, cursor_salt_);
    }
    return page;
  });
}

Result<std::string> SqliteAnalyses::image(const std::string& id) {
  return readers_.read([&](Connection& connection) -> Result<std::string> {
    const std::optional<AnalysisRow> found = find_id(connection, AnalysisKind::kAnalysis, id);
    if (!found) return missing(AnalysisKind::kAnalysis, id);
    Statement& row = connection.prepared("SELECT bytes FROM analysis_image WHERE analysis_key = ?");
    row.bind(found->analysis_key);
    if (!row.step()) throw DbError(SQLITE_CORRUPT, "the image of an analysis is missing");
    const auto bytes = row.blob(0);
    std::string image(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    row.reset();
    return image;
  });
}

Status SqliteAnalyses::remove(AnalysisKind kind, const std::string& id) {
  return writer_.request([&](Connection& connection) -> Status {
    const std::optional<AnalysisRow> row = find_id(connection, kind, id);
    if (!row) return missing(kind, id);
    connection.prepared("DELETE FROM analysis_image WHERE analysis_key = ?").bind(row->analysis_key).run();
    connection.prepared("DELETE FROM analysis WHERE analysis_key = ?").bind(row->analysis_key).run();
    return Ok{};
  });
}

Result<std::optional<AnalysisRow>> SqliteAnalyses::take_queued() {
  std::optional<AnalysisRow> taken;
  const Status written = writer_.request([&](Connection& connection) -> Status {
    taken = first_row(connection.prepared(
        COLONY_ANALYSIS_COLUMNS ", result FROM analysis WHERE state = 'queued' ORDER BY analysis_key LIMIT 1"));
    if (!taken) return Ok{};
    connection.prepared("UPDATE analysis SET state = 'running', try_count = try_count + 1 WHERE analysis_key = ?")
        .bind(taken->analysis_key)
        .run();
    taken->state = AnalysisState::kRunning;
    ++taken->try_count;
    return Ok{};
  });
  if (!written) return written.error();
  return taken;
}

Status SqliteAnalyses::finish(std::int64_t analysis_key, AnalysisState state, const std::string& failure_code,
                              const std::string& detail, const std::string& result_json) {
  return writer_.request([&](Connection& connection) -> Status {
    Statement& to = connection.prepared(
        "UPDATE analysis SET state = ?, failure_code = ?, detail = ?, finished_at = ?, result = ?"
        " WHERE analysis_key = ? AND state = 'running'");
    to.bind(name_of(state)).bind(std::string_view(failure_code)).bind(std::string_view(detail));
    to.bind(std::string_view(wall_time_text())).bind_text_or_null(result_json).bind(analysis_key).run();
    if (connection.changes() == 1) return Ok{};
    return Error{ErrorCode::kNotFound, "the analysis is not running any more"};
  });
}

Status SqliteAnalyses::succeed(std::int64_t analysis_key, const std::string& result_json) {
  return finish(analysis_key, AnalysisState::kSucceeded, {}, {}, result_json);
}

Status SqliteAnalyses::fail(std::int64_t analysis_key, const std::string& failure_code, const std::string& detail) {
  return finish(analysis_key, AnalysisState::kFailed, failure_code, detail, {});
}

Status SqliteAnalyses::put_back(std::int64_t analysis_key) {
  return writer_.request([&](Connection& connection) -> Status {
    connection
        .prepared("UPDATE analysis SET state = 'queued', try_count = try_count - 1"
                  " WHERE analysis_key = ? AND state = 'running'")
        .bind(analysis_key)
        .run();
    return Ok{};
  });
}

Status SqliteAnalyses::recover() {
  return writer_.request([&](Connection& connection) -> Status {
    connection
        .prepared("UPDATE analysis SET state = 'failed', failure_code = 'internal', finished_at = ?,"
                  " detail = 'given up: the server ended without warning each time it was at work on this'"
                  " WHERE state = 'running' AND try_count >= ?")
        .bind(std::string_view(wall_time_text()))
        .bind(std::int64_t{kAnalysisTriesMax})
        .run();
    connection.prepared("UPDATE analysis SET state = 'queued' WHERE state = 'running'").run();
    return Ok{};
  });
}

#undef COLONY_ANALYSIS_COLUMNS

}  // namespace colony::server
