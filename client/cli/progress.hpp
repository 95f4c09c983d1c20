// progress: how a running job looks: a bar redrawn in place on a terminal, a plain line now and then elsewhere.
// Units:   h of model time, s of wall time; fraction in [0, 1].
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/environment.hpp"
#include "client/cli/text.hpp"

namespace colony::client {

struct Progress {
  std::string state;  // empty: unknown
  double time_h = 0.0;
  std::int64_t cells = 0;
  std::optional<double> fraction, cells_per_s, eta_s;
};

/// From a `progress` object; members that are missing or null stay unset.
Progress progress_from(const Json& object);

/// One line of at most `width` columns. The bar gives way first, then the rate, the model time and the ETA.
std::string progress_bar(const Progress& progress, int width);

/// The same for a log: "running: 47 %, 86 cells, 118.2 h, 210 cells/s, about 4 s left".
std::string progress_words(const Progress& progress);

class ProgressPrinter {
 public:
  using Clock = std::chrono::steady_clock;
  explicit ProgressPrinter(Environment& env) : env_(env) {}

  /// Not a terminal: a line for each new whole percent but at most one a second, and one every 5 s whatever changed.
  void show(const Progress& progress, Clock::time_point now);

  /// Removes the bar, so that other text can follow.
  void clear();

 private:
  Environment& env_;
  bool drawn_ = false;
  std::string last_line_;
  int last_percent_ = -1;
  std::optional<Clock::time_point> last_at_;
};

}  // namespace colony::client
