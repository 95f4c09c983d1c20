#include "tests/bench/estimate_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "tests/bench/colonyd_process.hpp"

namespace colony::bench {
namespace {

using Json = nlohmann::json;

struct Case {
  const char* name;
  const char* spec;
  bool is_large = false;
  bool is_unusual = false;  // shown, not judged: so poor a search ends the colony early, which no closed formula knows
};

constexpr const char* kNoLimit = R"({"preset": "paper", "seed": 1, "until": {"cells": 10000}, "model": {"division": {"generation_limit": null}}})";
constexpr std::array<Case, 12> kCases = {{
    {"paper 1k", R"({"preset": "paper", "seed": 3, "until": {"cells": 1000}})"},
    {"paper 10k, no limit", kNoLimit},
    {"paper 240 h", R"({"preset": "paper", "seed": 1, "until": {"time_h": 240}})"},
    {"paper to its end", R"({"preset": "paper", "seed": 1, "until": {"time_h": 5000}})"},
    {"paper 1k, short search", R"({"preset": "paper", "seed": 3, "until": {"cells": 1000}, "model": {"search": {"population": 8, "generations": 2, "points": 64}}})",
     false, true},
    {"paper 500, fine search", R"({"preset": "paper", "seed": 1, "until": {"cells": 500}, "model": {"search": {"population": 64, "generations": 24, "points": 1024}}})"},
    {"young-colony 2k", R"({"preset": "young-colony", "seed": 1, "until": {"cells": 2000}, "model": {"division": {"generation_limit": null}}})"},
    {"tumour 3k", R"({"preset": "tumour", "seed": 1, "until": {"cells": 3000}})"},
    {"clonogenic 150 h", R"({"preset": "clonogenic", "seed": 1, "until": {"time_h": 150}})"},
    {"340 founders, 4k", R"({"preset": "clonogenic", "seed": 1, "until": {"cells": 4000}, "model": {"founders": {"count": 340, "radius_um": 3000}}})"},
    {"dish of 855 um, 20k", R"({"preset": "paper", "seed": 1, "until": {"cells": 20000}, "model": {"founders": {"count": 100, "radius_um": 805}, "dish": {"radius_um": 855}}})", true},
    {"1,000 founders, 50k", R"({"preset": "clonogenic", "seed": 1, "until": {"cells": 50000}, "model": {"founders": {"count": 1000, "radius_um": 3000}}})", true},
}};

struct Actual {
  double cells = 0.0, time_h = 0.0, cpu_s = 0.0, memory_bytes = 0.0, stored_bytes = 0.0;
};

Actual run(const std::string& colonyd, const Case& one, int threads, Json& estimate) {
  ColonydProcess server(colonyd, {"--jobs.concurrent-max", "1", "--jobs.threads-per-job", std::to_string(threads)});
  estimate = Json::parse(server.request("POST", "/v1/jobs?dry_run=true", one.spec))["estimate"];
  double before_s = 0.0;
  for (const auto& [name, cpu_s] : server.thread_cpu_s()) before_s += cpu_s;
  const Json submitted = Json::parse(server.request("POST", "/v1/jobs", one.spec));
  if (!submitted.contains("id")) throw std::runtime_error("the job is refused: " + submitted.dump());
  const std::string path = "/v1/jobs/" + submitted["id"].get<std::string>();
  server.follow(path + "/events?kind=progress", [](std::string_view) {});
  const Json job = Json::parse(server.request("GET", path, ""));
  if (job["state"] != "succeeded") throw std::runtime_error("the job did not succeed: " + job.dump());
  Actual out;
  out.cells = job["progress"]["cells"];
  out.time_h = job["progress"]["time_h"];
  out.memory_bytes = static_cast<double>(server.peak_memory_bytes());
  out.cpu_s = server.finish() - before_s;
  out.stored_bytes = static_cast<double>(server.database_bytes());
  return out;
}

bool is_near(double ratio) { return ratio >= 0.5 && ratio <= 2.0; }

}  // namespace

int run_estimate(const std::string& colonyd, bool full) {
  std::printf("# The machine may be busy: the time a job takes is its CPU time, all threads of the server, over its threads.\n");
  std::printf("%-24s %7s | %9s %9s | %7s %7s | %8s %8s %5s | %7s %7s %5s | %8s %8s %5s\n", "case", "threads", "cells est", "actual",
              "h est", "actual", "s est", "cpu/thr", "ratio", "MB est", "peak", "ratio", "stored", "actual", "ratio");
  int status = 0;
  for (const Case& one : kCases) {
    if (one.is_large && !full) continue;
    for (const int threads : {1, 2}) {
      Json estimate;
      const Actual actual = run(colonyd, one, threads, estimate);
      const double wall_s = actual.cpu_s / threads;
      const double time = estimate["wall_s"].get<double>() / wall_s;
      const double memory = estimate["memory_bytes"].get<double>() / actual.memory_bytes;
      const double stored = estimate["stored_bytes"].get<double>() / actual.stored_bytes;
      const bool is_right = is_near(time) && is_near(memory) && is_near(stored);
      if (!is_right && !one.is_unusual) status = 1;
      std::printf("%-24s %7d | %9.0f %9.0f | %7.1f %7.1f | %8.3f %8.3f %5.2f | %7.1f %7.1f %5.2f | %8.2f %8.2f %5.2f%s\n", one.name, threads,
                  estimate["cells"].get<double>(), actual.cells, estimate["time_h"].get<double>(), actual.time_h,
                  estimate["wall_s"].get<double>(), wall_s, time, 1e-6 * estimate["memory_bytes"].get<double>(),
                  1e-6 * actual.memory_bytes, memory, 1e-6 * estimate["stored_bytes"].get<double>(), 1e-6 * actual.stored_bytes, stored,
                  is_right ? "" : "  <- beyond a factor of 2");
      std::fflush(stdout);
    }
  }
  return status;
}

}  // namespace colony::bench
