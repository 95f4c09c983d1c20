// data_dir: the folder DATA: made 0700, its files 0600, and one process at a time.
// Promise: a folder that was made is on disk, up to the first parent that was there before; while a DataDir lives, no other process (nor another DataDir of this one) holds the same folder.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "engine/base/result.hpp"

namespace colony::server {

class DataDir {
 public:
  /// Errors: kConflict when somebody else holds the lock, kStorage when the folder cannot be made or written.
  static Result<std::unique_ptr<DataDir>> open(const std::string& path);
  ~DataDir();
  DataDir(const DataDir&) = delete;
  DataDir& operator=(const DataDir&) = delete;

  std::string database_path() const { return path_ + "/colony.db"; }
  /// Puts the names of the files inside on disk (their bytes are their writers' affair).
  Status sync() const;
  /// Bytes an ordinary process can still write on its disk.
  Result<std::uint64_t> free_bytes() const;

 private:
  DataDir(std::string path, int lock_fd) : path_(std::move(path)), lock_fd_(lock_fd) {}
  const std::string path_;  // fixed after construction
  const int lock_fd_;       // closing it gives the lock back, also when the process dies
};

}  // namespace colony::server
