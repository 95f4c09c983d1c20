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

/// A new file or folder survives a power cut only when the folder that names it was synchronised.
Status sync_folder(const std::string& path) {
  const int folder = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return storage_error("cannot open the folder " + path, errno);
  const int failed = fsync(folder) == 0 ? 0 : errno;
  ::close(folder);
  // Some file systems cannot synchronise a folder (EINVAL): they promise nothing, and that is no reason to refuse them.
  if (failed != 0 && failed != EINVAL) return storage_error("cannot synchronise the folder " + path, failed);
  return Ok{};
}

/// Makes the folder and what is missing above it, and puts each new name on disk.
Status make_folder(const std::filesystem::path& path, mode_t mode, mode_t parent_mode) {
  if (mkdir(path.c_str(), mode) == 0) return sync_folder(path.parent_path());
  if (errno == EEXIST) return Ok{};
  if (errno != ENOENT || path == path.parent_path())
    return storage_error("cannot make the folder " + path.string(), errno);
  if (const Status parent = make_folder(path.parent_path(), parent_mode, parent_mode); !parent) return parent;
  if (mkdir(path.c_str(), mode) == 0) return sync_folder(path.parent_path());
  if (errno == EEXIST) return Ok{};
  return storage_error("cannot make the folder " + path.string(), errno);
}
}  // namespace

Result<std::unique_ptr<DataDir>> DataDir::open(const std::string& path) {
  if (path.empty() || path.find('\0') != std::string::npos) {
    return Error{ErrorCode::kStorage, "the data folder needs a name"};
  }
  std::error_code failed;
  std::filesystem::path folder = std::filesystem::absolute(path, failed);
  if (failed) return storage_error("cannot tell where " + path + " is", failed.value());
  folder = folder.lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "data/" is "data"
  if (const Status made = make_folder(folder, 0700, 0777); !made) return made.error();

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
  if (const Status kept = dir->sync(); !kept) return kept.error();
  return dir;
}

DataDir::~DataDir() { ::close(lock_fd_); }

Status DataDir::sync() const { return sync_folder(path_); }

Result<std::uint64_t> DataDir::free_bytes() const {
  struct statvfs disk {};
  if (statvfs(path_.c_str(), &disk) != 0) return storage_error("cannot ask for the free space of " + path_, errno);
  return static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize;
}

}  // namespace colony::server
