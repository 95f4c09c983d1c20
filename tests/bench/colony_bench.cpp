// colony-bench: grows the scenes that speed is judged by and prints one CSV line for each scene, thread count and
// vector target, the digest beside the figures: a faster wrong run is seen, and fails. Every run is a process of its
// own, so that its peak memory is its own.
// Usage:  colony-bench [--threads 1,2] [--targets best|all|NAME,...] [--repeat N] [scene ...]     see --help
// Exit:   0; 1 a run failed, or the digest of a scene is not the same everywhere; 2 usage.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <hwy/targets.h>
#include <map>
#include <string>
#include <string_view>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "engine/analysis/series.hpp"
#include "engine/sim/simulator.hpp"
#include "engine/space/overlap_kernel.hpp"
#include "tests/bench/scenes.hpp"

namespace {

using namespace colony;
using bench::Scene;

constexpr int kRepeatMax = 100;

struct Options {
  std::vector<const Scene*> scenes;
  std::vector<int> threads = {1};
  std::vector<std::int64_t> targets;  // Highway's bits; 0: the best
  int repeat = 1;
};

// Plain data: it comes through a pipe.
struct Row {
  bool done = false;
  char target[16] = {};
  char digest[40] = {};
  std::uint64_t cells = 0, divisions = 0, rounds = 0, ready = 0, freed = 0, events = 0;
  double time_h = 0.0, wall_s = 0.0, cpu_s = 0.0, area_um2 = 0.0, bytes = 0.0, peak_mib = 0.0, active = 0.0;
  Work work;
};

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(usage.ru_utime) + s(usage.ru_stime);
}

void choose_target(std::int64_t bit) {
  hwy::SetSupportedTargetsForTest(bit);  // 0: all
  hwy::GetChosenTarget().DeInit();
}

/// Names of the vector targets of this machine and their bits; several bits may stand for one.
std::map<std::string, std::int64_t> targets_here() {
  std::map<std::string, std::int64_t> found;
  const std::int64_t supported = hwy::SupportedTargets();
  for (std::int64_t bit = 1; bit > 0 && bit <= supported; bit <<= 1) {
    if ((supported & bit) == 0) continue;
    choose_target(bit);
    found.emplace(kernel::vector_target(), bit);
    choose_target(0);
  }
  return found;
}

// Cells grow about as the square of the time in a lone colony, and faster in a dish: the estimate is rough and says so.
void show_progress(const Scene& scene, const Simulator& simulator, double wall_s) {
  const auto cells = static_cast<double>(simulator.colony().cells().size());
  const double left = static_cast<double>(*simulator.spec().until.cells) / cells - 1.0;
  std::fprintf(stderr, "\r%s: %.0f cells, %.0f h, %.0f s, about %.0f s left   ", std::string(scene.name).c_str(), cells,
               simulator.colony().time_h(), wall_s, wall_s * left);
}

Row run(const Scene& scene, const RunSpec& spec, int threads, std::int64_t target) {
  choose_target(target);
  Row row;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  Simulator simulator(spec, nullptr, threads);
  double shown_s = 2.0;
  while (const std::optional<Event> event = simulator.step()) {
    if (std::holds_alternative<Divided>(event->body)) ++row.divisions;
    ++row.events;
    if (terminal && row.events % 1024 == 0 && elapsed_s() > shown_s) {
      shown_s = elapsed_s() + 1.0;
      show_progress(scene, simulator, elapsed_s());
    }
  }
  row.wall_s = elapsed_s();
  row.cpu_s = cpu_s();
  if (terminal && row.wall_s > 2.0) std::fprintf(stderr, "\r\033[K");
  const Colony& colony = simulator.colony();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  row.peak_mib = static_cast<double>(usage.ru_maxrss) / 1024.0;  // before the area is measured
  row.cells = colony.cells().size();
  row.active = static_cast<double>(colony.count(Activity::kActive)) / static_cast<double>(row.cells);
  row.time_h = colony.time_h();
  row.bytes = static_cast<double>(colony.memory_bytes() + simulator.agenda().memory_bytes());
  row.work = simulator.work();
  row.rounds = simulator.window_counts().round_count;
  row.ready = simulator.window_counts().ready_count;
  row.freed = simulator.window_counts().freed_count;
  row.area_um2 = measure_series(colony, colony.time_h()).area_um2;
  std::snprintf(row.target, sizeof row.target, "%s", kernel::vector_target());
  std::snprintf(row.digest, sizeof row.digest, "%s", colony.digest().hex().c_str());
  row.done = true;
  return row;
}

/// In a process of its own, made before this one has any thread.
Row run_apart(const Scene& scene, const RunSpec& spec, int threads, std::int64_t target) {
  Row row;
  int ends[2];
  if (pipe(ends) != 0) return row;
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    const Row found = run(scene, spec, threads, target);
    const bool written = write(ends[1], &found, sizeof found) == static_cast<ssize_t>(sizeof found);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  if (child > 0) {
    Row found;
    std::size_t have = 0;
    for (ssize_t n = 1; n > 0 && have < sizeof found; have += static_cast<std::size_t>(std::max<ssize_t>(n, 0))) {
      n = read(ends[0], reinterpret_cast<char*>(&found) + have, sizeof found - have);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (have == sizeof found && WIFEXITED(status) && WEXITSTATUS(status) == 0) row = found;
  }
  close(ends[0]);
  return row;
}

double per(double n, double d) { return d > 0.0 ? n / d : 0.0; }

void print(const Scene& scene, int threads, const std::string& which, const Row& r) {
  const auto n = [](std::uint64_t count) { return static_cast<double>(count); };
  std::printf(
      "%s,%d,%s,%s,%llu,%.1f,%.3f,%.3f,%.1f,%.1f,%.3f,%.1f,%.0f,%.0f,%.0f,%.0f,%.3f,%.2f,%.1f,%.3f,%.0f,%.1f,%.1f,%s\n",
      std::string(scene.name).c_str(), threads, r.target, which.c_str(), static_cast<unsigned long long>(r.cells),
      r.time_h, r.wall_s, r.cpu_s, per(n(r.cells), r.wall_s), per(n(r.divisions), r.wall_s),
      per(n(r.work.search_count), n(r.divisions)), per(n(r.work.candidate_count), n(r.divisions)),
      per(n(r.work.field_count), n(r.divisions)), per(n(r.work.move_field_count), n(r.divisions)),
      per(n(r.work.lookup_count), n(r.divisions)), per(n(r.work.cover_count), n(r.divisions)), per(n(r.work.noise_count), n(r.work.field_count)),
      per(1e9 * r.cpu_s, n(r.work.field_count)), per(r.area_um2, n(r.cells)), r.active, per(r.bytes, n(r.cells)),
      r.peak_mib, per(n(r.ready + r.freed), n(r.rounds)), r.digest);
  std::fflush(stdout);
}

constexpr const char* kHeader =
    "scene,threads,vector_target,run,cells,time_h,wall_s,cpu_s,cells_per_s,divisions_per_s,searches_per_division,"
    "candidates_per_division,"
    "field_evaluations_per_division,of_moves,lookups_per_division,covers_per_division,band_share,ns_per_evaluation,area_per_"
    "cell_um2,active_share,"
    "bytes_per_cell,peak_memory_mib,decisions_per_round,digest";

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

bool measure(const Options& options) {
  bool good = true;
  std::printf("%s\n", kHeader);
  for (const Scene* scene : options.scenes) {
    const std::optional<RunSpec> spec = scene->make();
    if (!spec) {
      std::fprintf(stderr, "colony-bench: %s left out: this version has not the preset it needs\n",
                   std::string(scene->name).c_str());
      continue;
    }
    std::string digest;
    for (const int threads : options.threads) {
      for (const std::int64_t target : options.targets) {
        std::vector<double> wall_s, cpu;
        Row row;
        for (int k = 1; k <= options.repeat; ++k) {
          row = run_apart(*scene, *spec, threads, target);
          if (!row.done) {
            std::fprintf(stderr, "colony-bench: %s on %d threads failed\n", std::string(scene->name).c_str(), threads);
            return false;
          }
          print(*scene, threads, std::to_string(k), row);
          if (digest.empty()) digest = row.digest;
          if (digest != row.digest) {
            std::fprintf(stderr, "colony-bench: %s: another digest than before\n", std::string(scene->name).c_str());
            good = false;
          }
          if (row.cells < *spec->until.cells) {
            std::fprintf(stderr, "colony-bench: %s ended at %llu cells\n", std::string(scene->name).c_str(),
                         static_cast<unsigned long long>(row.cells));
            good = false;
          }
          wall_s.push_back(row.wall_s);
          cpu.push_back(row.cpu_s);
        }
        if (options.repeat == 1) continue;
        row.wall_s = median(wall_s);
        row.cpu_s = median(cpu);
        print(*scene, threads, "median", row);
      }
    }
  }
  return good;
}

std::vector<std::string> split(std::string_view list) {
  std::vector<std::string> parts(1);
  for (const char c : list) {
    if (c == ',')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

bool number(const std::string& text, int max, int& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size() && out >= 1 && out <= max;
}

int refuse(const std::string& what) {
  std::fprintf(stderr, "colony-bench: %s; --help says more\n", what.c_str());
  return 2;
}

void print_scenes() {
  for (const Scene& scene : bench::scenes())
    std::printf("  %-13s %s\n", std::string(scene.name).c_str(), std::string(scene.text).c_str());
}

void print_help() {
  std::printf(
      "colony-bench [options] [scene ...]    one CSV line for each scene x threads x vector target; no scene: those up "
      "to paper-10k\n"
      "  --threads LIST    e.g. 1,2: threads that decide; default 1\n"
      "  --targets LIST    best (default), all, or names of this machine's vector targets\n"
      "  --repeat N        N runs of each, then a line with the medians of wall_s and cpu_s\n"
      "  --list, --help\n"
      "What is counted as an evaluation: engine/growth/workspace.hpp. ns_per_evaluation is all CPU time over field "
      "evaluations.\nscenes:\n");
  print_scenes();
}

/// -1: go on; else the exit status.
int parse(const std::vector<std::string>& arguments, Options& options) {
  std::string targets = "best";
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--help") return print_help(), 0;
    if (argument == "--list") return print_scenes(), 0;
    if (argument.starts_with("--")) {
      if (i + 1 == arguments.size()) return refuse(argument + " needs a value, or is not an option");
      const std::string& value = arguments[++i];
      if (argument == "--threads") {
        options.threads.clear();
        for (const std::string& part : split(value)) {
          int threads = 0;
          if (!number(part, kThreadsMax, threads)) return refuse("--threads: \"" + part + "\" is not within 1 to 256");
          options.threads.push_back(threads);
        }
      } else if (argument == "--repeat") {
        if (!number(value, kRepeatMax, options.repeat))
          return refuse("--repeat: \"" + value + "\" is not within 1 to 100");
      } else if (argument == "--targets") {
        targets = value;
      } else {
        return refuse("no option " + argument);
      }
      continue;
    }
    const auto all = bench::scenes();
    const auto scene = std::find_if(all.begin(), all.end(), [&](const Scene& s) { return s.name == argument; });
    if (scene == all.end()) return refuse("no scene \"" + argument + "\"");
    options.scenes.push_back(&*scene);
  }
  if (options.scenes.empty()) {
    for (const Scene& scene : bench::scenes()) {
      options.scenes.push_back(&scene);
      if (scene.name == "paper-10k") break;
    }
  }
  const std::map<std::string, std::int64_t> here = targets_here();
  for (const std::string& name : split(targets)) {
    if (name == "best") {
      options.targets.push_back(0);
    } else if (name == "all") {
      for (const auto& [each, bit] : here) options.targets.push_back(bit);
    } else if (const auto found = here.find(name); found != here.end()) {
      options.targets.push_back(found->second);
    } else {
      std::string names;
      for (const auto& [each, bit] : here) names += " " + each;
      return refuse("--targets: this machine has not \"" + name + "\"; it has" + names);
    }
  }
  return -1;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  const int status = parse(std::vector<std::string>(argv + 1, argv + argc), options);
  if (status >= 0) return status;
  return measure(options) ? 0 : 1;
}
