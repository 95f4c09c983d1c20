// The parts of the service one by one, on a history as long as wanted: a grown one, repeated under other cell ids, so that
// store and stream can be judged apart from the engine.
#include "tests/bench/service_parts.hpp"

#include <chrono>
#include <cstdio>
#include <string>
#include <sys/resource.h>
#include <vector>

#include "engine/analysis/series.hpp"
#include "engine/random/stream.hpp"
#include "engine/sim/simulator.hpp"
#include "server/api/streams.hpp"
#include "server/store/store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::bench {
namespace {

constexpr std::size_t kBatchEvents = 200;  // as the runner's
constexpr std::size_t kCellsMin = 1000;

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double cpu_s(int who) {
  rusage usage{};
  getrusage(who, &usage);
  return seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
}

/// CPU and wall time since its making, of this thread or of all others of the process.
class Meter {
 public:
  double own_s() const { return cpu_s(RUSAGE_THREAD) - own_; }
  double others_s() const { return cpu_s(RUSAGE_SELF) - all_ - own_s(); }
  double wall_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  const double own_ = cpu_s(RUSAGE_THREAD), all_ = cpu_s(RUSAGE_SELF);
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void print(const char* part, double cpu_s, double wall_s, std::uint64_t divisions, const std::string& more) {
  std::printf("%s,%.1f,%.1f,%s\n", part, 1e6 * cpu_s / static_cast<double>(divisions),
              1e6 * wall_s / static_cast<double>(divisions), more.c_str());
  std::fflush(stdout);
}

std::vector<Event> grow(std::size_t cells) {
  RunSpec spec;
  spec.params.division.generation_limit.reset();
  spec.until.cells = cells;
  Simulator simulator(spec);
  std::vector<Event> history;
  while (auto event = simulator.step()) {
    if (event->kind() != EventKind::kFinished) history.push_back(std::move(*event));
  }
  return history;
}

/// `event` as if it happened in a far larger colony of `cells` cells: to any of them.
Event elsewhere(Event event, std::uint64_t seq, double later_h, std::uint32_t cells, Stream& stream) {
  const auto any = [&] { return CellId{static_cast<std::uint32_t>(1.0 + stream.uniform({0.0, 1.0}) * (cells - 1.0))}; };
  event.seq = seq;
  event.time_h += later_h;
  event.cell_id = any();
  if (auto* divided = std::get_if<Divided>(&event.body)) {
    divided->cells[0].id = *event.cell_id;
    divided->cells[1].id = CellId{cells + 1};
    divided->cells[1].parent_id = event.cell_id;
    for (Woken& woken : divided->woken) woken.cell_id = any();
  }
  return event;
}

}  // namespace

int run_parts(std::uint64_t divisions) {
  const std::vector<Event> grown = grow(std::min<std::uint64_t>(kCellsMin, divisions));
  std::printf("part,cpu_us_per_division,wall_us_per_division,remarks\n");
  {
    const Params params;
    Colony colony(params);
    Meter applying;
    for (const Event& event : grown) colony.apply(event);
    const double apply_s = applying.own_s();
    Colony again(params);
    SeriesTracker tracker(again);
    Meter following;
    for (const Event& event : grown) {
      again.apply(event);
      tracker.follow(event, again);
    }
    print("apply", apply_s, apply_s, again.cells().size(), "of the engine, for comparison");
    print("series", following.own_s() - apply_s, following.own_s() - apply_s, again.cells().size(),
          "area " + std::to_string(tracker.row(0.0).area_um2));
  }

  const tests::TempDir dir;
  server::StoreConfig config;
  config.data_dir = dir.path();
  auto store = server::Store::open(config);
  if (!store) {
    std::fprintf(stderr, "%s\n", store.error().message.c_str());
    return 1;
  }
  server::NewJob job;
  job.name = "bench";
  job.spec_json = "{}";
  const auto created = (*store)->create_job(job, 1);
  const auto taken = (*store)->take_queued_job();
  if (!created || !taken || !*taken) return 1;
  const std::int64_t job_key = (*taken)->job_key;

  Stream stream(1, CellId{1}, 0, Purpose::kFounder);
  std::uint64_t seq = 0, divided = 0, woken = 0;
  double later_h = 0.0;
  double making_s = 0.0;
  Meter writing;
  server::EventBatch batch;
  batch.job_key = job_key;
  bool failed = false;
  const auto send = [&] {
    (*store)->append_events(std::exchange(batch, {}), [&](const Status& status) { failed = failed || !status; });
    batch.job_key = job_key;
  };
  while (divided < divisions) {
    for (std::size_t i = 1; i < grown.size() && divided < divisions; ++i) {
      const auto cells = static_cast<std::uint32_t>(divided + 1);
      batch.events.push_back(elsewhere(grown[i], ++seq, later_h, cells, stream));
      if (const auto* body = std::get_if<Divided>(&batch.events.back().body)) {
        ++divided;
        woken += body->woken.size();
      }
      if (batch.events.size() == kBatchEvents) send();
    }
    later_h += grown.back().time_h;
  }
  send();
  if (!(*store)->flush() || failed) return 1;
  making_s = writing.own_s();
  print("write", writing.others_s(), writing.wall_s(), divided,
        std::to_string(seq) + " events, " + std::to_string(woken) + " woken; the maker took " +
            std::to_string(making_s) + " s");

  Meter reading;
  server::EventFilter filter;
  std::vector<Event> page;
  std::uint64_t read = 0;
  do {
    auto events = (*store)->read_events(job_key, filter, server::api::kEventsPerRead);
    if (!events) return 1;
    page = std::move(*events);
    read += page.size();
    if (!page.empty()) filter.after = page.back().seq;
  } while (!page.empty());
  print("read", reading.own_s(), reading.wall_s(), divided, std::to_string(read) + " events");

  Meter asking;
  server::EventFilter of_cell;
  of_cell.cell_id = 1;
  const auto found = (*store)->read_events(job_key, of_cell, server::api::kEventsPerRead);
  if (!found) return 1;
  print("one_cell", asking.own_s(), asking.wall_s(), divided,
        std::to_string(found->size()) + " events of one cell in " + std::to_string(1e3 * asking.wall_s()) + " ms");

  std::string text;
  std::uint64_t bytes = 0;
  Meter encoding;
  std::uint64_t encoded_divisions = 0;
  for (const Event& event : grown) {
    text.clear();
    server::api::append_event_message(text, event);
    bytes += text.size();
    encoded_divisions += event.kind() == EventKind::kDivided ? 1 : 0;
  }
  print("encode", encoding.own_s(), encoding.wall_s(), encoded_divisions,
        std::to_string(static_cast<double>(bytes) / static_cast<double>(encoded_divisions)) + " bytes a division");
  return 0;
}

}  // namespace colony::bench
