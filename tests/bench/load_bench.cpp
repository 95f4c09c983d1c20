// colony-load-bench: what the service bears, with the generator on the same cores.
// Usage: colony-load-bench [show] [mix] [watch] [list] [--colonyd PATH] [--rounds N] [--watchers N] [--seconds S] [--jobs N]
//          show   GET of a job beside a bare Beast server: same connections, same size of answer, interleaved rounds.
//          mix    two growing colonies with and without 500 requests a second, in turns.
//          watch  1,000 readers of the events of a job that is held to 100 events a second.
//          list   pages of a list of 100,000 jobs.
//        None named: all four, some two minutes. Status 1 if a target of the four is missed; a watcher that is cut or misses an
//        event, and any answer but 200, are failures whatever the speed.
//        colony-load-bench --bare BYTES: the bare server.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/bench/colonyd_process.hpp"
#include "tests/bench/load_client.hpp"
#include "tests/bench/load_jobs.hpp"
#include "tests/bench/load_watch.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

constexpr std::size_t kConnections = 32;
constexpr double kMixRate_per_s = 500.0, kPacedRate_per_s = 100.0;

struct Options {
  std::set<std::string> parts;
  std::uint64_t rounds = 5, watchers = 1000, seconds = 15, jobs = 100'000;
  std::string self, colonyd;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void sleep_s(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

double cpu_s(const ColonydProcess& server) {
  double sum = 0.0;
  for (const auto& [name, seconds] : server.thread_cpu_s()) sum += seconds;
  return sum;
}

/// The path of a new job.
std::string submit(const ColonydProcess& server, const Json& until, std::uint64_t seed) {
  const Json spec = {{"name", "load"},
                     {"seed", seed},
                     {"labels", {{"plate", "7"}}},
                     {"until", until},
                     {"model", {{"division", {{"generation_limit", nullptr}}}}}};
  const auto job = Json::parse(server.request("POST", "/v1/jobs", spec.dump()));
  if (!job.contains("id")) throw std::runtime_error("the job is refused: " + job.dump());
  return "/v1/jobs/" + job["id"].get<std::string>();
}

Json show(const ColonydProcess& server, const std::string& path) {
  return Json::parse(server.request("GET", path, ""));
}

void reach(const ColonydProcess& server, const std::string& path, std::uint64_t seq, const std::string& state) {
  for (;;) {
    const Json job = show(server, path);
    if (job["last_seq"] >= seq && (state.empty() || job["state"] == state)) return;
    sleep_s(0.02);
  }
}

bool say(const char* what, bool is_right) {
  std::printf("%s: %s\n\n", what, is_right ? "held" : "MISSED");
  std::fflush(stdout);
  return is_right;
}

bool run_show(const Options& options) {
  ColonydProcess server(options.colonyd, {"--jobs.concurrent-max", "1", "--jobs.threads-per-job", "1"});
  const std::string path = submit(server, {{"cells", 50}}, 1);
  reach(server, path, 1, "succeeded");
  const std::size_t bytes = server.request("GET", path, "").size();
  ColonydProcess bare(options.self, {"--bare", std::to_string(bytes)});
  std::printf("# show: GET of a job of %zu bytes, %zu connections, one client thread; slices of 0.25 s in turns\n",
              bytes, kConnections);
  std::printf("round,server,answers_per_s,p50_ms,p99_ms,server_cpu_us,client_cpu_us\n");
  constexpr int kSlices = 6;
  std::vector<double> ratios, p99s, cpu_ratios;
  for (std::uint64_t round = 0; round < options.rounds; ++round) {
    Latencies sums[2];
    double cpu_us[2] = {0.0, 0.0};
    for (int slice = 0; slice < 2 * kSlices; ++slice) {
      const int which = slice % 2;
      const ColonydProcess& asked = which == 0 ? bare : server;
      const double before_s = cpu_s(asked);
      const Latencies answers = closed_loop(asked.port(), get_text(path), kConnections, 0.25);
      cpu_us[which] += 1e6 * (cpu_s(asked) - before_s);
      Latencies& sum = sums[which];
      sum.all_ms.insert(sum.all_ms.end(), answers.all_ms.begin(), answers.all_ms.end());
      sum.wall_s += answers.wall_s;
      sum.cpu_s += answers.cpu_s;
    }
    double each_us[2] = {0.0, 0.0};
    for (const int which : {0, 1}) {
      const Latencies& sum = sums[which];
      const auto count = static_cast<double>(sum.all_ms.size());
      std::printf("%llu,%s,%.0f,%.2f,%.2f,%.1f,%.1f\n", static_cast<unsigned long long>(round),
                  which == 0 ? "bare" : "colonyd", sum.per_s(), sum.quantile_ms(0.5), sum.quantile_ms(0.99),
                  cpu_us[which] / count, 1e6 * sum.cpu_s / count);
      each_us[which] = (cpu_us[which] + 1e6 * sum.cpu_s) / count;
    }
    ratios.push_back(sums[1].per_s() / sums[0].per_s());
    cpu_ratios.push_back(each_us[0] / each_us[1]);
    p99s.push_back(sums[1].quantile_ms(0.99));
    std::fflush(stdout);
  }
  std::printf("median ratio,%.3f,median p99_ms,%.2f,median ratio of CPU (bare / colonyd; with the client),%.3f\n",
              median(ratios), median(p99s), median(cpu_ratios));
  return say("show at least half of bare, p99 under 20 ms", median(ratios) >= 0.5 && median(p99s) < 20.0);
}

bool run_mix(const Options& options) {
  ColonydProcess server(options.colonyd, {"--jobs.concurrent-max", "2", "--jobs.threads-per-job", "1"});
  const std::string finished = submit(server, {{"cells", 200}}, 9);
  reach(server, finished, 1, "succeeded");
  const Json until = {{"cells", 1'000'000}};
  const std::vector<std::string> jobs = {submit(server, until, 1), submit(server, until, 2)};
  for (const auto& path : jobs) reach(server, path, 2000, "");
  // A dashboard: half shows, the rest in equal parts lists, a hundred events, growth curves; of growing jobs mostly.
  std::vector<std::string> texts;
  for (const std::string& path : {jobs[0], jobs[1], jobs[0], jobs[1], finished}) {
    for (int i = 0; i < 3; ++i) texts.push_back(get_text(path));
    texts.push_back(get_text("/v1/jobs"));
    texts.push_back(get_text(path + "/events?after=500&limit=100"));
    texts.push_back(get_text(path + "/series"));
  }
  const auto seqs = [&] {
    return show(server, jobs[0])["last_seq"].get<double>() + show(server, jobs[1])["last_seq"].get<double>();
  };
  std::printf("# mix: two growing colonies, %.0f requests a second in every second window\n", kMixRate_per_s);
  std::printf("window,answers_per_s,refused,events_per_s,p50_ms,p99_ms,runner_cpu_s,other_cpu_s,client_cpu_s\n");
  const std::uint64_t windows = 2 * options.rounds + 1;
  std::vector<double> speeds, p99s, load_s;
  std::uint64_t refused = 0;
  for (std::uint64_t window = 0; window < windows; ++window) {
    const bool is_loaded = window % 2 == 1;
    const auto threads_before = server.thread_cpu_s();
    const double before = seqs();
    const auto start = Clock::now();
    Latencies answers;
    if (is_loaded) {
      answers = open_loop(
          server.port(), [&](std::size_t i) -> const std::string& { return texts[i % texts.size()]; }, kMixRate_per_s,
          3.0);
    } else {
      sleep_s(3.0);
    }
    const double wall_s = seconds_since(start);
    speeds.push_back((seqs() - before) / wall_s);
    double runner_s = 0.0, other_s = 0.0;
    auto earlier = threads_before;
    for (const auto& [name, seconds] : server.thread_cpu_s())
      (name == "runner" ? runner_s : other_s) += seconds - earlier[name];
    std::printf("%llu,%.0f,%llu,%.0f,%.2f,%.2f,%.2f,%.2f,%.2f\n", static_cast<unsigned long long>(window),
                is_loaded ? answers.per_s() : 0.0, static_cast<unsigned long long>(answers.refused), speeds.back(),
                answers.quantile_ms(0.5), answers.quantile_ms(0.99), runner_s, other_s, answers.cpu_s);
    refused += answers.refused;
    if (is_loaded) load_s.push_back((other_s + answers.cpu_s) / wall_s);
    std::fflush(stdout);
    if (is_loaded) p99s.push_back(answers.quantile_ms(0.99));
  }
  std::vector<double> ratios;
  for (std::size_t i = 1; i + 1 < speeds.size(); i += 2)
    ratios.push_back(speeds[i] / (0.5 * (speeds[i - 1] + speeds[i + 1])));
  std::printf("median ratio,%.3f,median p99_ms,%.2f,refused,%llu,cores taken by service and client,%.2f\n",
              median(ratios), median(p99s), static_cast<unsigned long long>(refused), median(load_s));
  return say("mix leaves growing colonies 0.8 of their speed", median(ratios) >= 0.8 && refused == 0);
}

bool run_watch(const Options& options) {
  ColonydProcess server(options.colonyd,
                        {"--jobs.concurrent-max", "1", "--jobs.threads-per-job", "1", "--jobs.events-per-s-max",
                         std::to_string(static_cast<int>(kPacedRate_per_s))});
  const std::string path = submit(server, {{"cells", 1'000'000}}, 1);
  reach(server, path, 50, "");
  const std::uint64_t before_bytes = server.resident_bytes();
  double seqs_per_s = 0.0, server_share = 0.0;
  std::uint64_t open_bytes = 0, last_bytes = 0;
  const WatchReport report = watch(server.port(), path + "/events", options.watchers, [&] {
    open_bytes = server.resident_bytes();
    const auto start = Clock::now();
    const double cpu_before_s = cpu_s(server), seq_before = show(server, path)["last_seq"].get<double>();
    sleep_s(static_cast<double>(options.seconds));
    last_bytes = server.resident_bytes();
    seqs_per_s = (show(server, path)["last_seq"].get<double>() - seq_before) / seconds_since(start);
    server_share = (cpu_s(server) - cpu_before_s) / seconds_since(start);
    (void)server.request("POST", path + "/cancel", "");
  });
  const double each = static_cast<double>(std::max(open_bytes, last_bytes) - std::min(before_bytes, last_bytes)) /
                      static_cast<double>(options.watchers);
  Latencies spread;
  spread.all_ms = report.spread_ms;
  std::printf("# watch: %zu watchers for %llu s of a job at %.1f events/s\n", report.watchers,
              static_cast<unsigned long long>(options.seconds), seqs_per_s);
  std::printf(
      "refused,cut,with_gap,with_other_bytes,lagged,last_seq,messages,MB,spread_p50_ms,spread_p99_ms,bytes_a_watcher,"
      "server_cores,client_cpu_s\n");
  std::printf("%zu,%zu,%zu,%zu,%zu,%llu,%llu,%.1f,%.1f,%.1f,%.0f,%.2f,%.1f\n", report.refused, report.cut,
              report.with_gap, report.with_other_bytes, report.lagged, static_cast<unsigned long long>(report.last_seq),
              static_cast<unsigned long long>(report.messages), static_cast<double>(report.bytes) / 1e6,
              spread.quantile_ms(0.5), spread.quantile_ms(0.99), each, server_share, report.cpu_s);
  return say("every watcher has every event, under 64 kB each, at 0.9 of the pace or more",
             report.is_right() && each < 64'000.0 && seqs_per_s >= 0.9 * kPacedRate_per_s);
}

bool run_list(const Options& options) {
  const tests::TempDir data;
  const auto start = Clock::now();
  const auto pages = make_jobs(data.path(), options.jobs);
  std::printf("# list: %llu jobs, made in %.1f s\n", static_cast<unsigned long long>(options.jobs),
              seconds_since(start));
  ColonydProcess server(options.colonyd, {"--jobs.concurrent-max", "1"}, data.path());
  std::printf("page,bytes,items,answers,p10_ms,p50_ms,p99_ms,server_cpu_ms\n");
  bool is_right = true;
  for (const auto& [what, target] : pages) {
    const std::string body = server.request("GET", target, "");
    const Json answer = Json::parse(body);
    const double before_s = cpu_s(server);
    const Latencies answers = closed_loop(server.port(), get_text(target), 1, 0.8);
    const auto count = static_cast<double>(answers.all_ms.size());
    std::printf("%s,%zu,%zu,%zu,%.2f,%.2f,%.2f,%.2f\n", what.c_str(), body.size(),
                answer.contains("items") ? answer["items"].size() : 0, answers.all_ms.size(), answers.quantile_ms(0.1),
                answers.quantile_ms(0.5), answers.quantile_ms(0.99), 1e3 * (cpu_s(server) - before_s) / count);
    std::fflush(stdout);
    is_right = is_right && answers.quantile_ms(0.5) < 20.0;
  }
  return say("every page in under 20 ms (median)", is_right);
}

Options read(int argc, char** argv) {
  Options options;
  options.self = std::filesystem::canonical("/proc/self/exe").string();
  options.colonyd = (std::filesystem::path(options.self).parent_path() / "colonyd").string();
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (!name.starts_with("--")) {
      if (name != "show" && name != "mix" && name != "watch" && name != "list")
        throw std::invalid_argument("unknown part " + name);
      options.parts.insert(name);
      continue;
    }
    if (++i >= argc) throw std::invalid_argument(name + " needs a value");
    const std::string value = argv[i];
    std::uint64_t* const number = name == "--rounds"     ? &options.rounds
                                  : name == "--watchers" ? &options.watchers
                                  : name == "--seconds"  ? &options.seconds
                                  : name == "--jobs"     ? &options.jobs
                                                         : nullptr;
    if (name == "--colonyd") {
      options.colonyd = value;
    } else if (number == nullptr) {
      throw std::invalid_argument("unknown option " + name);
    } else {
      const auto end = std::from_chars(value.data(), value.data() + value.size(), *number);
      if (end.ec != std::errc() || end.ptr != value.data() + value.size() || *number == 0) {
        throw std::invalid_argument(name + ": " + value + " is not a number above 0");
      }
    }
  }
  if (options.parts.empty()) options.parts = {"show", "mix", "watch", "list"};
  return options;
}

// Of a bare server started as a ColonydProcess, whose other arguments it does not heed.
int bare_bytes(int argc, char** argv) {
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::strcmp(argv[i], "--bare") == 0) return std::atoi(argv[i + 1]);
  }
  return -1;
}

int run(int argc, char** argv) {
  if (const int bytes = bare_bytes(argc, argv); bytes >= 0) return serve_bare(static_cast<std::size_t>(bytes));
  // A thousand connections at both ends; the servers inherit it.
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  const Options options = read(argc, argv);
  bool is_right = true;
  if (options.parts.contains("show")) is_right = run_show(options) && is_right;
  if (options.parts.contains("mix")) is_right = run_mix(options) && is_right;
  if (options.parts.contains("watch")) is_right = run_watch(options) && is_right;
  if (options.parts.contains("list")) is_right = run_list(options) && is_right;
  return is_right ? 0 : 1;
}

}  // namespace
}  // namespace colony::bench

int main(int argc, char** argv) {
  try {
    return colony::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "colony-load-bench: %s\n", error.what());
    return 2;
  }
}
