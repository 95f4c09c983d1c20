// colony-bench: grows the scenes that speed is judged by and prints one CSV line each, the digest beside every figure, so that a
// faster wrong run is seen.
// Usage: colony-bench [scene ...]     (no scene: all; --list names them)
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "engine/sim/simulator.hpp"
#include "engine/space/overlap_kernel.hpp"

namespace {

using namespace colony;

struct Scene {
  std::string_view name;
  std::string_view text;
  RunSpec (*make)();
};

RunSpec paper(std::uint64_t cells) {
  RunSpec spec;
  spec.until.cells = cells;
  return spec;
}

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = {
      {"paper-180", "preset paper, seed 1, to 180 cells", [] { return paper(180); }},
      {"paper-1k", "preset paper, seed 1, to 1,000 cells", [] { return paper(1000); }},
  };
  return all;
}

struct Counts {
  std::uint64_t divisions = 0, searches = 0, evaluations = 0, corrected = 0;
};

void count(const Event& event, Counts& counts) {
  if (const auto* divided = std::get_if<Divided>(&event.body)) {
    ++counts.divisions;
    ++counts.searches;
    counts.evaluations += divided->evaluation_count;
    counts.corrected += divided->corrected ? 1 : 0;
  } else if (const auto* inhibited = std::get_if<Inhibited>(&event.body)) {
    ++counts.searches;
    counts.evaluations += inhibited->evaluation_count;
    counts.corrected += inhibited->corrected ? 1 : 0;
  }
}

double peak_memory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void run(const Scene& scene) {
  Simulator simulator(scene.make());
  Counts counts;
  const auto start = std::chrono::steady_clock::now();
  while (const std::optional<Event> event = simulator.step()) count(*event, counts);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Colony& colony = simulator.colony();
  const auto per = [](std::uint64_t n, std::uint64_t d) { return static_cast<double>(n) / static_cast<double>(d > 0 ? d : 1); };
  std::printf("%s,1,%s,%zu,%.1f,%.3f,%.1f,%.1f,%.3f,%.1f,%.3f,%.0f,%.3f,%.2f,%.1f,%s\n", std::string(scene.name).c_str(), kernel::vector_target(),
              colony.cells().size(), colony.time_h(), wall_s, static_cast<double>(colony.cells().size()) / wall_s,
              static_cast<double>(counts.divisions) / wall_s, per(counts.searches, counts.divisions),
              per(counts.evaluations, counts.divisions), per(counts.corrected, counts.searches), per(simulator.work().field_count, counts.divisions),
              per(simulator.work().noise_count, simulator.work().field_count), 1e9 * wall_s / static_cast<double>(simulator.work().field_count), peak_memory_mib(),
              colony.digest().hex().c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string_view> names(argv + 1, argv + argc);
  if (!names.empty() && names[0] == "--list") {
    for (const Scene& scene : scenes()) std::printf("%-12s %s\n", std::string(scene.name).c_str(), std::string(scene.text).c_str());
    return 0;
  }
  for (const std::string_view name : names) {
    bool known = false;
    for (const Scene& scene : scenes()) known = known || scene.name == name;
    if (!known) {
      std::fprintf(stderr, "colony-bench: no scene \"%s\"; --list names them\n", std::string(name).c_str());
      return 2;
    }
  }
  std::printf("scene,threads,vector_target,cells,time_h,wall_s,cells_per_s,divisions_per_s,searches_per_division,"
              "evaluations_per_division,corrected_share,field_evaluations_per_division,band_share,ns_per_evaluation,peak_memory_mib,digest\n");
  for (const Scene& scene : scenes()) {
    bool wanted = names.empty();
    for (const std::string_view name : names) wanted = wanted || scene.name == name;
    if (wanted) run(scene);
  }
  return 0;
}
