// environment: what a command may touch of the process around it, as values, so that tests run commands in their own
// process.
#pragma once

#include <chrono>
#include <functional>
#include <istream>
#include <optional>
#include <ostream>
#include <string>

namespace colony::client {

/// Ctrl-C as something to wait on. raise() is async-signal-safe; fd() becomes readable and stays so.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  void raise() noexcept;
  bool raised() const noexcept;
  int fd() const { return pipe_[0]; }
  /// Returns after `duration`, or at once when raised.
  void wait(std::chrono::milliseconds duration) const;

 private:
  int pipe_[2];
};

/// How often and how patiently to ask again. Delays double from `first` to `max`, each shortened at random by up to a
/// quarter so that many clients of a restarted server do not come back together.
struct RetryPolicy {
  int attempts_max = 5;     // of a submit
  int reconnects_max = 20;  // of a watch, in a row
  std::chrono::milliseconds first{500};
  std::chrono::milliseconds max{30'000};
};

/// The delay before attempt `index + 1` (index from 0). Pure but for the jitter.
std::chrono::milliseconds retry_delay(const RetryPolicy& policy, int index);

struct Environment {
  std::istream& in;
  std::ostream& out;
  std::ostream& err;
  Interrupt& interrupt;
  std::function<std::optional<std::string>(const std::string&)> variable;  // of the process environment
  std::function<int()> terminal_width = [] { return 80; };                 // columns, asked at every redraw
  bool out_is_terminal = false;
  RetryPolicy retry = {};
};

/// Whether the locale's character set is UTF-8 (else sparklines are ASCII).
bool locale_is_utf8(const Environment& env);

}  // namespace colony::client
