// lines: cuts a stream of bytes into lines and forwards each when it is complete. Memory: one line.
// Errors: Failure kRefused for a line over kLineBytesMax.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "client/cli/failure.hpp"

namespace colony::client {

class LineSplitter {
 public:
  static constexpr std::size_t kLineBytesMax = 64u << 20;
  using Handler = std::function<void(std::string_view)>;
  explicit LineSplitter(Handler handle) : handle_(std::move(handle)) {}

  void feed(std::string_view bytes) {
    for (;;) {
      const std::size_t end = bytes.find('\n');
      if (line_.size() + bytes.size() > kLineBytesMax && end == std::string_view::npos) {
        throw Failure(ExitCode::kRefused, "the server sent a line of more than 64 MiB");
      }
      line_ += bytes.substr(0, end);
      if (end == std::string_view::npos) return;
      if (!line_.empty()) handle_(line_);
      line_.clear();
      bytes.remove_prefix(end + 1);
    }
  }

  /// A last line without its end.
  void finish() {
    if (!line_.empty()) handle_(line_);
    line_.clear();
  }

 private:
  Handler handle_;
  std::string line_;
};

}  // namespace colony::client
