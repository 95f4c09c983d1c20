#include "client/cli/output.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>

#include "client/cli/failure.hpp"
#include "client/cli/text.hpp"

namespace colony::client {
namespace {

[[noreturn]] void fail_out() {
  if (errno == EPIPE) throw OutputClosed();
  throw Failure(ExitCode::kUsage, std::string("cannot write standard output: ") + std::strerror(errno));
}

}  // namespace

Output::Output(Environment& env, const std::string& path) : env_(env) {
  if (path.empty() || path == "-") return;
  std::error_code error;
  const std::filesystem::path real = std::filesystem::weakly_canonical(path, error);  // through a symlink, not over it
  path_ = error ? path : real.string();
  struct stat info {};
  if (::stat(path_.c_str(), &info) == 0 && !S_ISREG(info.st_mode)) {
    fd_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd_ < 0) fail("cannot open");
    return;
  }
  const std::filesystem::path final_path(path_);
  std::string beside = ".";
  beside += final_path.filename().string();
  beside += ".XXXXXX";
  temporary_ = (final_path.parent_path() / beside).string();
  fd_ = ::mkostemp(temporary_.data(), O_CLOEXEC);
  if (fd_ < 0) {
    temporary_.clear();
    fail("cannot create a file there");
  }
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(fd_, 0666 & ~mask);  // mkostemp makes it private; a result is as public as the umask says
}

Output::~Output() {
  if (fd_ >= 0) ::close(fd_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void Output::write(std::string_view bytes) {
  written_bytes_ += bytes.size();
  if (fd_ < 0) {
    if (env_.out.good()) errno = 0;
    if (path_.empty() && !env_.out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()))) fail_out();
    return;
  }
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("cannot write");
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

void Output::finish() {
  if (fd_ < 0) return flush_out(env_);
  const int fd = fd_;
  fd_ = -1;
  if (::close(fd) != 0) fail("cannot write");
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot rename into place");
  temporary_.clear();
}

void Output::fail(const std::string& what) const {
  throw Failure(ExitCode::kUsage, "-o " + printable(path_) + ": " + what + ": " + std::strerror(errno));
}

void flush_out(Environment& env) {
  if (env.out.good()) errno = 0;  // else it tells why the write just before failed
  if (!env.out.flush()) fail_out();
}

std::string read_input(Environment& env, const std::string& path, std::size_t bytes_max) {
  std::ifstream file;
  const std::string name = path == "-" ? "standard input" : printable(path);
  if (path != "-") {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) throw Failure(ExitCode::kUsage, name + ": is a directory");
    file.open(path, std::ios::binary);
    if (!file) throw Failure(ExitCode::kUsage, name + ": " + std::strerror(errno));
  }
  std::istream& in = path == "-" ? env.in : file;
  std::string text;
  char buffer[65536];
  while (in.read(buffer, sizeof buffer) || in.gcount() > 0) {
    text.append(buffer, static_cast<std::size_t>(in.gcount()));
    if (text.size() > bytes_max) {
      throw Failure(ExitCode::kUsage,
                    name + ": larger than this command's limit of " + std::to_string(bytes_max) + " bytes");
    }
  }
  if (in.bad()) throw Failure(ExitCode::kUsage, name + ": cannot be read");
  return text;
}

}  // namespace colony::client
