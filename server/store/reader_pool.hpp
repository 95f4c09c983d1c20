// reader_pool: a few read-only connections, lent one at a time.
// Promise: a reader never writes, never checkpoints, and its transaction ends with the call: nothing pins the log while waiting.
// Threads: read() from any thread; it waits while every connection is lent.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/store/connection.hpp"

namespace colony::server {

class ReaderPool {
 public:
  ReaderPool(const std::string& path, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      free_.push_back(std::make_unique<Connection>(path, Connection::Access::kReader));
    }
  }

  /// Runs `body(connection)` in one read transaction (one snapshot) and returns its Result; a DbError becomes an Error.
  template <class Body>
  auto read(Body&& body) -> decltype(body(std::declval<Connection&>())) {
    Lent lent(*this);
    Connection& connection = *lent.connection;
    try {
      connection.prepared("BEGIN").run();
      auto result = body(connection);
      connection.prepared("COMMIT").run();
      return result;
    } catch (const DbError& error) {
      if (connection.in_transaction()) sqlite3_exec(connection.raw(), "ROLLBACK", nullptr, nullptr, nullptr);
      return to_error(error);
    }
  }

 private:
  struct Lent {
    explicit Lent(ReaderPool& owner) : pool(owner) {
      std::unique_lock lock(pool.mutex_);
      pool.returned_.wait(lock, [&] { return !pool.free_.empty(); });
      connection = std::move(pool.free_.back());
      pool.free_.pop_back();
    }
    ~Lent() {
      {
        const std::lock_guard lock(pool.mutex_);
        pool.free_.push_back(std::move(connection));
      }
      pool.returned_.notify_one();
    }
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;
    ReaderPool& pool;
    std::unique_ptr<Connection> connection;
  };

  std::mutex mutex_;  // guards everything below
  std::condition_variable returned_;
  std::vector<std::unique_ptr<Connection>> free_;
};

}  // namespace colony::server
