#include "server/store/connection.hpp"

namespace colony::server {

Error to_error(const DbError& error) {
  if (error.is_constraint()) return {ErrorCode::kInternal, std::string("the database refused a row: ") + error.what()};
  return {ErrorCode::kStorage, std::string("the database cannot be used: ") + error.what()};
}

Statement::Statement(sqlite3* db, std::string_view sql) : db_(db) {
  sqlite3_stmt* statement = nullptr;
  const int code =
      sqlite3_prepare_v3(db, sql.data(), static_cast<int>(sql.size()), SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  statement_.reset(statement);
  check(code);
}

void Statement::check(int code) const {
  if (code != SQLITE_OK) throw DbError(sqlite3_extended_errcode(db_), sqlite3_errmsg(db_));
}

Statement& Statement::bind(std::int64_t value) {
  is_clean_ = false;
  check(sqlite3_bind_int64(statement_.get(), next_++, value));
  return *this;
}

Statement& Statement::bind(double value) {
  is_clean_ = false;
  check(sqlite3_bind_double(statement_.get(), next_++, value));
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  is_clean_ = false;
  // An empty view may have no address, which SQLite would take for NULL.
  const char* data = value.empty() ? "" : value.data();
  check(sqlite3_bind_text(statement_.get(), next_++, data, static_cast<int>(value.size()), SQLITE_TRANSIENT));
  return *this;
}

Statement& Statement::bind_lasting(std::string_view value) {
  is_clean_ = false;
  check(sqlite3_bind_text(statement_.get(), next_++, value.data(), static_cast<int>(value.size()), SQLITE_STATIC));
  return *this;
}

Statement& Statement::bind_lasting_blob(std::span<const std::uint8_t> value) {
  is_clean_ = false;
  check(sqlite3_bind_blob(statement_.get(), next_++, value.data(), static_cast<int>(value.size()), SQLITE_STATIC));
  return *this;
}

Statement& Statement::bind_null() {
  is_clean_ = false;
  check(sqlite3_bind_null(statement_.get(), next_++));
  return *this;
}

Statement& Statement::bind(const std::optional<double>& value) { return value ? bind(*value) : bind_null(); }

Statement& Statement::bind_text_or_null(const std::string& value) {
  return value.empty() ? bind_null() : bind(std::string_view(value));
}

Statement& Statement::bind_blob(std::span<const std::uint8_t> value) {
  is_clean_ = false;
  check(sqlite3_bind_blob(statement_.get(), next_++, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT));
  return *this;
}

bool Statement::step() {
  is_clean_ = false;
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) {
    reset();
    return false;
  }
  const DbError error(sqlite3_extended_errcode(db_), sqlite3_errmsg(db_));
  reset();
  throw error;
}

void Statement::run() {
  while (step()) {
  }
}

void Statement::reset() {
  if (is_clean_) return;
  is_clean_ = true;
  sqlite3_reset(statement_.get());  // repeats the code of the last step, which was reported then
  sqlite3_clear_bindings(statement_.get());
  next_ = 1;
}

std::string Statement::text(int column) const {
  const unsigned char* data = sqlite3_column_text(statement_.get(), column);
  if (data == nullptr) return {};
  return {reinterpret_cast<const char*>(data),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::span<const std::uint8_t> Statement::blob(int column) const {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  return {static_cast<const std::uint8_t*>(data),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::optional<double> Statement::optional_real(int column) const {
  if (is_null(column)) return std::nullopt;
  return real(column);
}

Connection::Connection(const std::string& path, Access access) {
  const int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE |
                    (access == Access::kWriter ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY);
  sqlite3* db = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &db, flags, nullptr);
  db_.reset(db);
  if (code != SQLITE_OK) throw DbError(code, db == nullptr ? "out of memory" : sqlite3_errmsg(db));
  sqlite3_busy_timeout(db, 5000);
  sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  // Checkpoints are the writer's explicit act alone, at close too: SQLite 3.40.1 can corrupt a database when two connections
  // checkpoint or reset the log at the same time.
  sqlite3_db_config(db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  sqlite3_wal_autocheckpoint(db, 0);
  execute("PRAGMA trusted_schema = OFF");
  if (access == Access::kReader) {
    execute("PRAGMA query_only = ON");
    return;
  }
  sqlite3_wal_hook(
      db,
      [](void* self, sqlite3*, const char*, int pages) {
        static_cast<Connection*>(self)->wal_pages_ = pages;
        return SQLITE_OK;
      },
      this);
}

Statement& Connection::prepared(const char* sql) {
  std::unique_ptr<Statement>& slot = statements_[sql];
  if (slot == nullptr) {
    slot = std::make_unique<Statement>(db_.get(), sql);
  } else {
    slot->reset();
  }
  return *slot;
}

void Connection::execute(const std::string& sql) {
  if (sqlite3_exec(db_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    throw DbError(sqlite3_extended_errcode(db_.get()), sqlite3_errmsg(db_.get()));
  }
}

void Connection::checkpoint(bool wait) {
  const int mode = wait ? SQLITE_CHECKPOINT_RESTART : SQLITE_CHECKPOINT_PASSIVE;
  const int code = sqlite3_wal_checkpoint_v2(db_.get(), nullptr, mode, nullptr, nullptr);
  if (code != SQLITE_OK && (code & 0xff) != SQLITE_BUSY) {
    throw DbError(sqlite3_extended_errcode(db_.get()), sqlite3_errmsg(db_.get()));
  }
  wal_pages_ = 0;
}

}  // namespace colony::server
