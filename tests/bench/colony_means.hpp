// colony_means: what a lone colony is like at fixed times, over seeds: the figures by which two engines are held
// against each other. Written against what the engine has had since results version 1, so that it compiles against that
// engine too (tests/bench/evidence_reference.cpp says how its figures were made).
// Units:   h, um2, um3.        Threads: pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include "engine/analysis/series.hpp"
#include "engine/sim/simulator.hpp"

namespace colony::bench {

inline constexpr std::array<double, 3> kMeanTimes_h = {100.0, 200.0, 300.0};
inline constexpr std::array<const char*, 4> kQuantityNames = {"cells", "mean volume, um3", "active share",
                                                              "area per cell, um2"};
inline constexpr std::size_t kQuantityCount = kQuantityNames.size();

/// values[time][quantity] of one colony, and what its history took up to the last time.
struct ColonyMeans {
  std::array<std::array<double, kQuantityCount>, kMeanTimes_h.size()> values{};
  std::uint64_t divided_count = 0, inhibited_count = 0;
};

inline ColonyMeans colony_means(Seed seed, const Params& params) {
  RunSpec spec;
  spec.seed = seed;
  spec.params = params;
  spec.until.time_h = kMeanTimes_h.back();
  Simulator simulator(spec);
  ColonyMeans means;
  std::size_t next = 0;
  const auto measure_until = [&](double time_h) {
    for (; next < kMeanTimes_h.size() && kMeanTimes_h[next] <= time_h; ++next) {
      const SeriesRow row = measure_series(simulator.colony(), kMeanTimes_h[next]);
      const auto n = static_cast<double>(row.cell_count);
      means.values[next] = {n, row.volume_mean_um3, static_cast<double>(row.active_count) / n, row.area_um2 / n};
    }
  };
  // A colony is as its last event left it, so it must be measured before an event past the time is applied: ask the agenda.
  while (true) {
    if (simulator.colony().last_seq() > 0 && !simulator.agenda().empty())
      measure_until(simulator.agenda().first().due_h);
    const std::optional<Event> event = simulator.step();
    if (!event) break;
    if (std::holds_alternative<Divided>(event->body)) ++means.divided_count;
    if (std::holds_alternative<Inhibited>(event->body)) ++means.inhibited_count;
  }
  measure_until(kMeanTimes_h.back());
  return means;
}

}  // namespace colony::bench
