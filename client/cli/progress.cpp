#include "client/cli/progress.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/cli/output.hpp"

namespace colony::client {
namespace {

std::optional<double> number_member(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::optional<int> percent_of(const Progress& progress) {
  if (!progress.fraction) return std::nullopt;
  return static_cast<int>(std::floor(std::clamp(*progress.fraction, 0.0, 1.0) * 100.0));
}

std::string rate_text(double cells_per_s) { return fixed(cells_per_s, cells_per_s < 10 ? 1 : 0) + " cells/s"; }

}  // namespace

Progress progress_from(const Json& object) {
  Progress out;
  if (!object.is_object()) return out;
  if (const auto state = object.find("state"); state != object.end() && state->is_string())
    out.state = state->get<std::string>();
  out.time_h = number_member(object, "time_h").value_or(0.0);
  out.cells = static_cast<std::int64_t>(number_member(object, "cells").value_or(0.0));
  out.fraction = number_member(object, "fraction");
  out.cells_per_s = number_member(object, "cells_per_s");
  out.eta_s = number_member(object, "eta_s");
  return out;
}

std::string progress_bar(const Progress& progress, int width) {
  const std::optional<int> percent = percent_of(progress);
  // In the order shown; `rank` says what goes first when it does not fit: the highest.
  struct Part {
    std::string text;
    int rank;
  };
  std::vector<Part> parts;
  if (!progress.state.empty() && progress.state != "running") parts.push_back({printable(progress.state), 0});
  if (percent) parts.push_back({std::to_string(*percent) + " %", 1});
  parts.push_back({std::to_string(progress.cells) + (progress.cells == 1 ? " cell" : " cells"), 2});
  if (progress.eta_s) parts.push_back({"ETA " + duration_text(*progress.eta_s), 3});
  parts.push_back({fixed(progress.time_h, 1) + " h", 4});
  if (progress.cells_per_s) parts.push_back({rate_text(*progress.cells_per_s), 5});

  const auto joined = [&] {
    std::string out;
    for (const Part& part : parts) out += (out.empty() ? "" : "  ") + part.text;
    return out;
  };
  const auto room = static_cast<std::size_t>(std::max(width, 0));
  while (parts.size() > 1 && joined().size() > room) {
    parts.erase(
        std::max_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.rank < b.rank; }));
  }
  std::string line = joined().substr(0, room);
  constexpr std::size_t kBarMin = 10, kBarMax = 40, kFrame = 4;  // "[", "]" and two spaces
  if (percent && room >= line.size() + kBarMin + kFrame) {
    const std::size_t size = std::min(kBarMax, room - line.size() - kFrame);
    const auto full = static_cast<std::size_t>(std::clamp(*progress.fraction, 0.0, 1.0) * static_cast<double>(size));
    std::string bar = "[";
    bar.append(full, '#').append(size - full, '.').append("]  ");
    line.insert(0, bar);
  }
  return line;
}

std::string progress_words(const Progress& progress) {
  std::string out = progress.state.empty() ? "running" : printable(progress.state);
  out += ": ";
  if (const auto percent = percent_of(progress)) out += std::to_string(*percent) + " %, ";
  out += std::to_string(progress.cells) + (progress.cells == 1 ? " cell, " : " cells, ") + fixed(progress.time_h, 1) +
         " h";
  if (progress.cells_per_s) out += ", " + rate_text(*progress.cells_per_s);
  if (progress.eta_s) out += ", about " + duration_text(*progress.eta_s) + " left";
  return out;
}

void ProgressPrinter::show(const Progress& progress, Clock::time_point now) {
  if (env_.out_is_terminal) {
    // One column stays free: a full line makes some terminals wrap.
    env_.out << '\r' << progress_bar(progress, env_.terminal_width() - 1) << "\x1b[K";
    flush_out(env_);
    drawn_ = true;
    return;
  }
  using std::chrono::seconds;
  const int percent = percent_of(progress).value_or(-1);
  const std::string line = progress_words(progress);
  const bool due =
      !last_at_ || (percent != last_percent_ && now - *last_at_ >= seconds(1)) || now - *last_at_ >= seconds(5);
  if (!due || line == last_line_) return;
  env_.out << line << '\n';
  flush_out(env_);
  last_at_ = now;
  last_percent_ = percent;
  last_line_ = line;
}

void ProgressPrinter::clear() {
  if (drawn_) env_.out << "\r\x1b[K" << std::flush;
  drawn_ = false;
}

}  // namespace colony::client
