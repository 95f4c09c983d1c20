// failure: the one way a command ends early. Thrown anywhere, printed once, by run() (app.hpp), as `error: <what>`.
// Why an exception here and a Result in the server: a command line has one caller and one reaction to every failure.
#pragma once

#include <stdexcept>
#include <string>

namespace colony::client {

/// What the process ends with; part of the interface (scripts and workflow runners branch on it).
enum class ExitCode {
  kDone = 0,
  kJobFailed = 1,
  kUsage = 2,  // wrong arguments, or a local file that cannot be read or written
  kNotReachable = 3,
  kRefused = 4,  // the server answered, and the answer is no
  kCancelled = 5,
  kInterrupted = 130,
};

class Failure : public std::runtime_error {
 public:
  Failure(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// No complete answer came. `transient`: asking again may help (refused or lost connections, not a wrong certificate).
class NotReachable : public Failure {
 public:
  NotReachable(const std::string& message, bool transient)
      : Failure(ExitCode::kNotReachable, message), transient_(transient) {}
  bool transient() const { return transient_; }

 private:
  bool transient_;
};

/// Whoever reads our standard output has closed it (`colony events ID | head`): nothing to report, nothing to go on
/// with.
class OutputClosed : public std::runtime_error {
 public:
  OutputClosed() : std::runtime_error("standard output is closed") {}
};

}  // namespace colony::client
