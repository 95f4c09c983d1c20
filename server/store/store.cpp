// Opening and closing, and what belongs to no single job.
#include "server/store/store.hpp"

#include <algorithm>
#include <utility>

#include "server/store/job_rows.hpp"
#include "server/store/schema.hpp"
#include "server/store/sqlite_store.hpp"

namespace colony::server {
namespace {
constexpr std::size_t kReaders = 4;
constexpr std::int64_t kSweepSeqs = 1000;  // one step of deleting a history: a few ms
constexpr std::uint64_t kPageBytes = 4096;
constexpr std::uint64_t kDatabaseBytesMin = 262'144;  // the empty tables, and some room to refuse from
}  // namespace

Result<std::unique_ptr<Store>> Store::open(const StoreConfig& config) {
  if (config.database_bytes_max > 0 && config.database_bytes_max < kDatabaseBytesMin) {
    return Error{ErrorCode::kInvalid,
                 "database_bytes_max must be 0 (no bound) or at least " + std::to_string(kDatabaseBytesMin)};
  }
  auto dir = DataDir::open(config.data_dir);
  if (!dir) return dir.error();
  try {
    const std::string path = (*dir)->database_path();
    auto connection = std::make_unique<Connection>(path, Connection::Access::kWriter);
    prepare_database(*connection);
    if (config.database_bytes_max > 0) {
      const std::uint64_t pages = config.database_bytes_max / kPageBytes;
      connection->execute("PRAGMA max_page_count = " + std::to_string(pages));
    }
    if (const Status kept = (*dir)->sync(); !kept) return kept.error();
    return std::unique_ptr<Store>(new SqliteStore(config, std::move(*dir), std::move(connection)));
  } catch (const IncompatibleDatabase& error) {
    return Error{ErrorCode::kStorage, error.what()};
  } catch (const DbError& error) {
    return to_error(error);
  }
}

SqliteStore::SqliteStore(const StoreConfig& config, std::unique_ptr<DataDir> dir,
                         std::unique_ptr<Connection> write_connection)
    : config_(config), dir_(std::move(dir)), write_connection_(std::move(write_connection)) {
  Statement salt = write_connection_->prepare_once("SELECT value FROM meta WHERE name = 'cursor_salt'");
  if (!salt.step()) throw DbError(SQLITE_CORRUPT, "the cursor salt is missing");
  cursor_salt_ = salt.integer(0);
  salt.reset();
  mark_unmade_jobs_deleted(*write_connection_);  // before anybody reads; the sweeper does the rest
  readers_ = std::make_unique<ReaderPool>(dir_->database_path(), kReaders);
  const WriterLimits limits{config_.batch_rows_max, std::chrono::milliseconds(config_.batch_wait_ms),
                            config_.queued_events_max};
  writer_ = std::make_unique<Writer>(*write_connection_, limits,
                                     [](Connection& connection) { return sweep_deleted(connection, kSweepSeqs); });
  analyses_ = std::make_unique<SqliteAnalyses>(*writer_, *readers_, cursor_salt_);
  tokens_ = std::make_unique<SqliteTokens>(*writer_, *readers_);
}

SqliteStore::~SqliteStore() {
  writer_.reset();   // commits what is queued
  readers_.reset();  // before the last checkpoint, so that it can move the whole log
  try {
    write_connection_->checkpoint(true);
  } catch (const DbError&) {
    // The log stays beside the database, and the next open reads it: nothing is lost.
  }
}

Status SqliteStore::check_writable(std::uint64_t free_bytes_min) {
  const auto disk = dir_->free_bytes();
  if (!disk) return disk.error();
  std::uint64_t free_bytes = *disk;
  const auto room = write<std::uint64_t>([](Connection& connection) -> Result<std::uint64_t> {
    connection.prepared("UPDATE meta SET value = 1 - value WHERE name = 'writable_probe'").run();
    std::uint64_t numbers[3] = {0, 0, 0};
    const char* questions[3] = {"PRAGMA max_page_count", "PRAGMA page_count", "PRAGMA freelist_count"};
    for (int i = 0; i < 3; ++i) {
      Statement question = connection.prepare_once(questions[i]);
      if (question.step()) numbers[i] = static_cast<std::uint64_t>(question.integer(0));
    }
    const std::uint64_t growth = numbers[0] > numbers[1] ? numbers[0] - numbers[1] : 0;
    return (growth + numbers[2]) * kPageBytes;
  });
  if (!room) return room.error();
  free_bytes = std::min(free_bytes, *room);
  if (free_bytes < free_bytes_min) {
    return Error{ErrorCode::kStorage, "only " + std::to_string(free_bytes) + " bytes are free for the database, " +
                                          std::to_string(free_bytes_min) + " are needed"};
  }
  return Ok{};
}

Status SqliteStore::add_log(std::int64_t job_key, const std::string& level, const std::string& message) {
  return writer_->request([&](Connection& connection) -> Status {
    if (!find_job_row(connection, job_key)) return Error{ErrorCode::kNotFound, "there is no such job"};
    insert_log_row(connection, job_key, level, message);
    return Ok{};
  });
}

Result<std::vector<LogRow>> SqliteStore::read_log(std::int64_t job_key, std::int64_t after_index, std::size_t limit) {
  return readers_->read([&](Connection& connection) -> Result<std::vector<LogRow>> {
    if (!find_job_row(connection, job_key)) return Error{ErrorCode::kNotFound, "there is no such job"};
    return read_log_rows(connection, job_key, after_index, limit);
  });
}

}  // namespace colony::server
