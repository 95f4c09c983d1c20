// connection: the SQLite C API as two values. Only this folder sees it.
// Errors:  DbError, which never leaves the folder: the store's functions turn it into an Error.
// Threads: a Connection and its statements belong to one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sqlite3.h>

#include "engine/base/result.hpp"

namespace colony::server {

class DbError : public std::runtime_error {
 public:
  DbError(int code, const std::string& message) : std::runtime_error(message), code_(code) {}
  /// True for a broken rule of the schema: a bug in one write, not a sick disk.
  bool is_constraint() const { return (code_ & 0xff) == SQLITE_CONSTRAINT || (code_ & 0xff) == SQLITE_MISMATCH; }

 private:
  int code_;
};

/// What the caller of the store gets to see.
Error to_error(const DbError& error);

class Statement {
 public:
  Statement(sqlite3* db, std::string_view sql);

  /// Parameters are numbered from 1; every bind returns *this so that they chain in order.
  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::string_view value);  // text; copied
  Statement& bind_lasting(std::string_view value);  // not empty, not copied: it must stay until the statement has run
  Statement& bind_null();
  Statement& skip(int count) {  // what is not bound is NULL
    next_ += count;
    is_clean_ = false;
    return *this;
  }
  Statement& bind(const std::optional<double>& value);
  Statement& bind_text_or_null(const std::string& value);  // empty: NULL
  Statement& bind_blob(std::span<const std::uint8_t> value);
  Statement& bind_lasting_blob(std::span<const std::uint8_t> value);  // as bind_lasting

  /// True if there is a row. After the last row the statement is reset.
  bool step();
  /// For statements without rows: step, reset.
  void run();
  /// Back to the start, parameters cleared.
  void reset();

  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  double real(int column) const { return sqlite3_column_double(statement_.get(), column); }
  bool is_null(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }
  std::string text(int column) const;  // NULL: empty
  std::span<const std::uint8_t> blob(int column) const;
  std::optional<double> optional_real(int column) const;

 private:
  void check(int code) const;
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  sqlite3* db_;
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
  int next_ = 1;
  bool is_clean_ = true;  // reset since it was last stepped or bound
};

class Connection {
 public:
  enum class Access { kWriter, kReader };
  /// A writer makes the file if it is not there. No URI: a path is a path, whatever characters it has.
  Connection(const std::string& path, Access access);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// A statement kept for the next time, reset and ready. For a bounded set of texts only.
  Statement& prepared(const char* sql);
  /// For texts put together at run time.
  Statement prepare_once(std::string_view sql) { return Statement(db_.get(), sql); }
  void execute(const std::string& sql);

  bool in_transaction() const { return sqlite3_get_autocommit(db_.get()) == 0; }
  int changes() const { return sqlite3_changes(db_.get()); }
  std::int64_t last_rowid() const { return sqlite3_last_insert_rowid(db_.get()); }
  /// Pages in the write-ahead log after the last commit of this connection.
  int wal_pages() const { return wal_pages_; }
  /// Moves the log into the database file. `wait` false: what can be moved now; true: waits for readers (a few seconds at
  /// most), so that the log starts again from its beginning.
  void checkpoint(bool wait);
  sqlite3* raw() { return db_.get(); }

 private:
  struct Close {
    void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
  };
  std::unique_ptr<sqlite3, Close> db_;
  std::map<const char*, std::unique_ptr<Statement>> statements_;  // by address of the literal; after db_: dies first
  int wal_pages_ = 0;
};

}  // namespace colony::server
