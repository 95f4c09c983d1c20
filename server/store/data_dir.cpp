#include "server/store/data_dir.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <system_error>
#include <unistd.h>

namespace colony::server {
namespace {
Error storage_error(const std::string& what, int code) {
  return {ErrorCode::kStorage, what + ": " + std::strerror(code)};  // NOLINT(concurrency-mt-unsafe): glibc's is safe
}
}  // namespace

Result<std::unique_ptr<DataDir>> DataDir::open(const std::string& path) {
  if (path.empty() || path.find('\0') != std::string::npos) {
    return Error{ErrorCode::kStorage, "the data folder needs a name"};
  }
  std::error_code failed;
  const std::filesystem::path parent = std::filesystem::absolute(path, failed).lexically_normal().parent_path();
  if (!failed) std::filesystem::create_directories(parent, failed);
  if (failed) return storage_error("cannot make the folder above " + path, failed.value());
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
    return storage_error("cannot make the data folder " + path, errno);

  const int lock = ::open((path + "/LOCK").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (lock < 0) return storage_error("cannot open " + path + "/LOCK", errno);
  if (flock(lock, LOCK_EX | LOCK_NB) != 0) {
    const int code = errno;
    ::close(lock);
    if (code == EWOULDBLOCK) return Error{ErrorCode::kConflict, "another process uses the data folder " + path};
    return storage_error("cannot lock " + path + "/LOCK", code);
  }
  std::unique_ptr<DataDir> dir(new DataDir(path, lock));
  // SQLite would make it with the process's umask; its -wal and -shm files take over the mode found here.
  const int database = ::open(dir->database_path().c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (database < 0) return storage_error("cannot open " + dir->database_path(), errno);
  ::close(database);
  return dir;
}

DataDir::~DataDir() { ::close(lock_fd_); }

Result<std::uint64_t> DataDir::free_bytes() const {
  struct statvfs disk {};
  if (statvfs(path_.c_str(), &disk) != 0) return storage_error("cannot ask for the free space of " + path_, errno);
  return static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize;
}

}  // namespace colony::server
