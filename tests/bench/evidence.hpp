// evidence: measured tables behind the model's and the engine's choices, as Markdown; colony-evidence prints them.
// Random:  fixed seeds: the same version prints the same tables, but for times.
// Threads: tables run kEvidenceThreads colonies at a time; what a seed gives stands in its own slot.
#pragma once

#include <atomic>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "engine/model/params.hpp"
#include "tests/support/stats.hpp"

namespace colony::bench {

inline constexpr int kEvidenceThreads = 2;

struct EvidenceSize {
  bool full = false;
  int of(int reduced, int whole) const { return full ? whole : reduced; }
};

/// Calls work(k) for k in [0, count), several at a time; work must write to its own slot only.
inline void for_each_slot(int count, const std::function<void(int)>& work) {
  std::atomic<int> next = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < kEvidenceThreads; ++t) {
    threads.emplace_back([&] {
      for (int k = next++; k < count; k = next++) work(k);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

/// "1.234 +- 0.056"
inline std::string text_of(const testing::Mean& mean, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f +- %.*f", digits, mean.value, digits, mean.se);
  return text;
}

void print_volume_error(const EvidenceSize& size);  // a
void print_searches(const EvidenceSize& size);      // b to f, j: on real attempts
void print_colony_terms(const EvidenceSize& size);  // c, d, f, h, j: what they earn a colony
void print_contact(const EvidenceSize& size);       // g, i
void print_reference(const EvidenceSize& size);     // k
void print_figure2(const EvidenceSize& size);       // l: also of photographs, where COLONY_DATA names a folder of them

}  // namespace colony::bench
