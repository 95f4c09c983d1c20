// colonyd_process: a real server in a data folder of its own, and the few requests a benchmark makes of it.
// Errors:  std::runtime_error with what went wrong.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

#include "tests/support/temp_dir.hpp"

namespace colony::bench {

class ColonydProcess {
 public:
  /// Returns when it listens. `data`: a folder that is there already; empty: one of its own.
  ColonydProcess(const std::string& program, std::vector<std::string> arguments, const std::string& data = "");
  /// Ended, or killed if finish() was not called.
  ~ColonydProcess();
  ColonydProcess(const ColonydProcess&) = delete;
  ColonydProcess& operator=(const ColonydProcess&) = delete;

  /// The body of the answer, whatever its status.
  std::string request(const std::string& method, const std::string& path, const std::string& body) const;
  /// Gives the body of a stream to `take`, piece by piece, until the server ends it.
  void follow(const std::string& path, const std::function<void(std::string_view)>& take) const;
  /// CPU seconds so far of its threads, by name; those that a thread starts bear its name.
  std::map<std::string, double> thread_cpu_s() const;
  std::uint64_t database_bytes() const;
  /// Resident now.
  std::uint64_t resident_bytes() const;
  std::uint16_t port() const { return port_; }
  /// The most it ever held in memory.
  std::uint64_t peak_memory_bytes() const;
  /// Ends it by SIGTERM; the CPU seconds of its whole life.
  double finish();

 private:
  int connect() const;

  const tests::TempDir own_;
  const std::string data_;
  pid_t pid_ = -1;
  int out_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace colony::bench
