// output: where data goes: standard output, or a file that appears whole or not at all.
// Method:  a file is written beside its final name and renamed by finish(); without finish() it is removed again. What
// exists and
//          is not a regular file (/dev/null, a pipe) is written directly.
// Errors:  Failure kUsage naming the path; OutputClosed when standard output's reader is gone.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "client/cli/environment.hpp"

namespace colony::client {

class Output {
 public:
  /// `path` empty or "-": standard output.
  Output(Environment& env, const std::string& path);
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void write(std::string_view bytes);
  void finish();
  bool is_file() const { return fd_ >= 0; }
  std::size_t written_bytes() const { return written_bytes_; }

 private:
  [[noreturn]] void fail(const std::string& what) const;

  Environment& env_;
  std::string path_;       // final
  std::string temporary_;  // empty: written directly
  int fd_ = -1;
  std::size_t written_bytes_ = 0;
};

/// Throws as above if anything written to standard output so far was lost.
void flush_out(Environment& env);

/// The whole file, or standard input for "-". Failure kUsage; larger than `bytes_max` is an error.
std::string read_input(Environment& env, const std::string& path, std::size_t bytes_max);

}  // namespace colony::client
