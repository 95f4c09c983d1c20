// colony-service-bench: what the service costs on top of the engine.
// Usage: colony-service-bench job [--cells N] [--threads N] [--seed N] [--rounds N] [--quick 1] [--colonyd PATH]
//          The same colony (preset paper without generation limit, to N cells; default 100,000) bare, in this process, and then as
//          a job of a real colonyd with one live event stream read to its end. One CSV line a round, the digest beside the
//          figures; the median ratio last. --quick: a search so short that the engine takes a fraction of a millisecond a
//          division: a harder test of the service, and of one thread. Status 1 if a digest, or one seq of the stream, is not as it should be.
//        colony-service-bench parts [--divisions N]
//          The CPU time a division takes in writer, reader, encoder and growth curve, without an engine.
//        colony-service-bench estimate [--full 1] [--colonyd PATH]
//          What a dry run says against what the job takes; status 1 where they differ by more than a factor of 2.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "engine/sim/simulator.hpp"
#include "server/api/codec_spec.hpp"
#include "tests/bench/colonyd_process.hpp"
#include "tests/bench/estimate_bench.hpp"
#include "tests/bench/service_parts.hpp"

namespace colony::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::uint64_t cells = 100'000, seed = 1, rounds = 1, divisions = 100'000;
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool quick = false, full = false;
  std::string colonyd;
};

/// The job; what is bare and what is served are made from the same text.
nlohmann::json spec_of(const Options& options) {
  nlohmann::json model = {{"division", {{"generation_limit", nullptr}}}};
  if (options.quick) model["search"] = {{"population", 8}, {"generations", 1}, {"points", 64}, {"points_final", 64}};
  return {{"name", "bench"},
          {"seed", options.seed},
          {"preset", "paper"},
          {"until", {{"cells", options.cells}, {"time_h", 10'000}}},
          {"model", model}};
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double own_cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Bare {
  double wall_s = 0.0, cpu_s = 0.0;
  std::uint64_t events = 0, divisions = 0;
  std::string digest;
};

Bare run_bare(const Options& options) {
  const auto body = server::api::parse_json(spec_of(options).dump());
  const auto spec = server::api::decode_spec(*body, server::api::SpecLimits{options.cells});
  if (!spec) throw std::runtime_error("the spec is wrong: " + spec.error().message);
  Bare out;
  const double cpu_before_s = own_cpu_s();
  const auto start = Clock::now();
  Simulator simulator(spec->run, nullptr, options.threads);
  while (const auto event = simulator.step()) {
    ++out.events;
    out.divisions += event->kind() == EventKind::kDivided ? 1 : 0;
  }
  out.wall_s = seconds_since(start);
  out.cpu_s = own_cpu_s() - cpu_before_s;
  out.digest = simulator.colony().digest().hex();
  return out;
}

/// Counts the messages of an event stream and holds their ids to 1, 2, 3, ...
class StreamCheck {
 public:
  void take(std::string_view piece) {
    bytes_ += piece.size();
    for (;;) {
      const std::size_t end = piece.find('\n');
      if (end == std::string_view::npos) break;
      line(line_.empty() ? piece.substr(0, end) : std::string_view(line_ += piece.substr(0, end)));
      line_.clear();
      piece.remove_prefix(end + 1);
    }
    line_ += piece;
  }
  std::uint64_t last_id() const { return last_id_; }
  std::uint64_t bytes() const { return bytes_; }
  bool has_ended() const { return has_ended_; }

 private:
  void line(std::string_view text) {
    if (text == "event: end") has_ended_ = true;
    if (!text.starts_with("id: ")) return;
    std::uint64_t id = 0;
    std::from_chars(text.data() + 4, text.data() + text.size(), id);
    // Before `end` the last id comes once more, alone.
    if (id != last_id_ + 1 && id != last_id_) throw std::runtime_error("the stream jumps to " + std::string(text));
    last_id_ = id;
  }
  std::string line_;
  std::uint64_t last_id_ = 0, bytes_ = 0;
  bool has_ended_ = false;
};

double run_round(const Options& options, std::uint64_t round) {
  const Bare bare = run_bare(options);
  ColonydProcess server(options.colonyd,
                        {"--jobs.concurrent-max", "1", "--jobs.threads-per-job", std::to_string(options.threads)});
  double server_start_s = 0.0;
  for (const auto& [name, cpu_s] : server.thread_cpu_s()) server_start_s += cpu_s;
  const double cpu_before_s = own_cpu_s();
  const auto start = Clock::now();
  const auto submitted = nlohmann::json::parse(server.request("POST", "/v1/jobs", spec_of(options).dump()));
  if (!submitted.contains("id")) throw std::runtime_error("the job is refused: " + submitted.dump());
  const std::string path = "/v1/jobs/" + submitted["id"].get<std::string>();
  StreamCheck stream;
  server.follow(path + "/events", [&](std::string_view piece) { stream.take(piece); });
  const double wall_s = seconds_since(start);
  const double reader_s = own_cpu_s() - cpu_before_s;
  const auto job = nlohmann::json::parse(server.request("GET", path, ""));
  auto threads_s = server.thread_cpu_s();
  // Once more, as fast as it goes: what a division costs the http threads when nothing is waited for.
  StreamCheck again;
  const auto again_start = Clock::now();
  server.follow(path + "/events", [&](std::string_view piece) { again.take(piece); });
  const double again_wall_s = seconds_since(again_start);
  double again_s = 0.0;
  for (const auto& [name, cpu_s] : server.thread_cpu_s()) again_s += cpu_s - threads_s[name];
  const double runner_s = threads_s["runner"], writer_s = threads_s["writer"];
  const double server_s = server.finish() - server_start_s - again_s;
  const std::uint64_t bytes = server.database_bytes();  // with the log moved into it at the end

  const bool same = job["digest"] == bare.digest && job["last_seq"] == bare.events && stream.last_id() == bare.events &&
                    stream.has_ended() && job["state"] == "succeeded";
  const double ratio = wall_s / bare.wall_s;
  const auto per_division_us = [&](double seconds) {
    return 1e6 * seconds / static_cast<double>(std::max<std::uint64_t>(1, bare.divisions));
  };
  std::printf("%llu,%llu,%d,%llu,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,%s,%s\n",
              static_cast<unsigned long long>(round), static_cast<unsigned long long>(options.cells), options.threads,
              static_cast<unsigned long long>(bare.events), bare.wall_s, bare.cpu_s, wall_s, server_s, ratio,
              server_s / bare.cpu_s, per_division_us(runner_s - bare.cpu_s), per_division_us(writer_s),
              per_division_us(server_s - runner_s - writer_s), per_division_us(reader_s), per_division_us(again_s),
              per_division_us(again_wall_s), static_cast<double>(stream.bytes()) / 1e6,
              static_cast<double>(bytes) / 1e6, bare.digest.c_str(), job["digest"].get<std::string>().c_str());
  std::fflush(stdout);
  if (!same) throw std::runtime_error("the job is not the bare colony: " + job.dump());
  return ratio;
}

int run_job(const Options& options) {
  std::printf(
      "round,cells,threads,events,bare_wall_s,bare_cpu_s,service_wall_s,service_cpu_s,wall_ratio,cpu_ratio,runner_us_"
      "per_"
      "division,"
      "writer_us_per_division,http_us_per_division,reader_us_per_division,"
      "again_us_per_division,again_wall_us_per_division,stream_MB,database_MB,bare_digest,job_digest\n");
  std::vector<double> ratios;
  for (std::uint64_t round = 1; round <= options.rounds; ++round) ratios.push_back(run_round(options, round));
  std::sort(ratios.begin(), ratios.end());
  std::printf("# median wall ratio %.3f of %zu rounds\n", ratios[ratios.size() / 2], ratios.size());
  return 0;
}

int usage() {
  std::fprintf(
      stderr,
      "usage: colony-service-bench job [--cells N] [--threads N] [--seed N] [--rounds N] [--quick 1] [--colonyd PATH]\n"
      "       colony-service-bench parts [--divisions N]\n"
      "       colony-service-bench estimate [--full 1] [--colonyd PATH]\n");
  return 2;
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() % 2 == 0) return usage();
  Options options;
  options.colonyd = (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "colonyd").string();
  for (std::size_t i = 2; i < arguments.size(); i += 2) {
    const std::string &name = arguments[i - 1], &value = arguments[i];
    if (name == "--colonyd") {
      options.colonyd = value;
      continue;
    }
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size() || number < 1) return usage();
    if (name == "--quick")
      options.quick = true;
    else if (name == "--full")
      options.full = true;
    else if (name == "--cells")
      options.cells = number;
    else if (name == "--seed")
      options.seed = number;
    else if (name == "--rounds")
      options.rounds = number;
    else if (name == "--divisions")
      options.divisions = number;
    else if (name == "--threads" && number <= 256)
      options.threads = static_cast<int>(number);
    else
      return usage();
  }
  if (arguments[0] == "job") return run_job(options);
  if (arguments[0] == "parts") return run_parts(options.divisions);
  if (arguments[0] == "estimate") return run_estimate(options.colonyd, options.full);
  return usage();
}

}  // namespace
}  // namespace colony::bench

int main(int argc, char** argv) {
  try {
    return colony::bench::run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "colony-service-bench: %s\n", error.what());
    return 1;
  }
}
