// Choices in terms of the colonies that come of them, and this engine against the one of results version 1.
#include <cmath>

#include "tests/bench/colony_means.hpp"
#include "tests/bench/evidence.hpp"

namespace colony::bench {
namespace {

struct Variant {
  const char* name;
  void (*change)(Params&);
};
constexpr Variant kVariants[] = {
    {"paper", [](Params&) {}},
    {"random search", [](Params& p) { p.search.optimiser = Optimiser::kRandom; }},
    {"Sobol search", [](Params& p) { p.search.optimiser = Optimiser::kSobol; }},
    {"roulette", [](Params& p) { p.search.selection = Selection::kRoulette; }},
    {"binary", [](Params& p) { p.search.coding = Coding::kBinary; }},
    {"no corrector", [](Params& p) { p.search.corrector_generations = 0; }},
    {"never given up", [](Params& p) { p.search.give_up_margin.reset(); }},
    {"512 points", [](Params& p) { p.search.points = 512; }},
    {"1,024 points", [](Params& p) { p.search.points = 1024; }},
    {"wake always", [](Params& p) { p.wake.rule = WakeRule::kAlways; }},
    {"contact rule max", [](Params& p) { p.contact.rule = ContactRule::kMax; }},
};

std::vector<ColonyMeans> grow(int seed_count, const Params& params) {
  std::vector<ColonyMeans> colonies(static_cast<std::size_t>(seed_count));
  for_each_slot(seed_count,
                [&](int k) { colonies[static_cast<std::size_t>(k)] = colony_means(static_cast<Seed>(1 + k), params); });
  return colonies;
}

testing::Mean mean_over(const std::vector<ColonyMeans>& colonies,
                        const std::function<double(const ColonyMeans&)>& value) {
  std::vector<double> values;
  for (const ColonyMeans& colony : colonies) values.push_back(value(colony));
  return testing::mean_of(values);
}

// The engine of results version 1 (commit ea23149, the last before the search was rewritten), preset paper, seeds 1 to
// 123, by colony_means() of this tree compiled against that one's library: [time][quantity] as kMeanTimes_h and
// kQuantityNames.
constexpr int kReferenceSeeds = 123;
constexpr testing::Mean kReference[kMeanTimes_h.size()][kQuantityCount] = {
    {{49.5772, 0.4987}, {475.226, 3.292}, {0.419744, 0.005033}, {106.558, 0.4227}},
    {{173.992, 1.409}, {450.526, 1.568}, {0.217195, 0.002945}, {98.9538, 0.1854}},
    {{381.48, 2.489}, {443.752, 0.9048}, {0.153783, 0.001449}, {96.5538, 0.1047}},
};

}  // namespace

void print_colony_terms(const EvidenceSize& size) {
  const int seed_count = size.of(8, 40);
  std::printf("\nWhat choices earn a colony: preset paper otherwise, %d seeds, to 300 h\n\n", seed_count);
  std::printf(
      "| variant | cells at 100 h | at 200 h | at 300 h | searches per division | mean volume at 300 h, um3 | area per "
      "cell, um2 |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Variant& variant : kVariants) {
    Params params;
    variant.change(params);
    const std::vector<ColonyMeans> colonies = grow(seed_count, params);
    const auto at = [&](std::size_t time, std::size_t quantity) {
      return mean_over(colonies, [&](const ColonyMeans& c) { return c.values[time][quantity]; });
    };
    const testing::Mean searches = mean_over(colonies, [](const ColonyMeans& c) {
      return static_cast<double>(c.divided_count + c.inhibited_count) / static_cast<double>(c.divided_count);
    });
    std::printf("| %s | %s | %s | %s | %s | %s | %s |\n", variant.name, text_of(at(0, 0), 1).c_str(),
                text_of(at(1, 0), 1).c_str(), text_of(at(2, 0), 1).c_str(), text_of(searches, 2).c_str(),
                text_of(at(2, 1), 0).c_str(), text_of(at(2, 3), 1).c_str());
    std::fflush(stdout);
  }
}

void print_reference(const EvidenceSize& size) {
  const int seed_count = size.of(20, 200);
  const std::vector<ColonyMeans> colonies = grow(seed_count, Params());
  std::printf(
      "\nThis engine (%d seeds) against results version 1 (%d seeds), preset paper; z = difference over its standard "
      "error\n\n",
      seed_count, kReferenceSeeds);
  std::printf(
      "| h | quantity | version 1 | this engine | difference | in %% | z |\n| --- | --- | --- | --- | --- | --- | --- "
      "|\n");
  for (std::size_t time = 0; time < kMeanTimes_h.size(); ++time) {
    for (std::size_t quantity = 0; quantity < kQuantityCount; ++quantity) {
      const testing::Mean& before = kReference[time][quantity];
      const testing::Mean now = mean_over(colonies, [&](const ColonyMeans& c) { return c.values[time][quantity]; });
      const testing::Mean difference = {now.value - before.value, std::sqrt(now.se * now.se + before.se * before.se)};
      const int digits = quantity == 2 ? 4 : 2;
      std::printf("| %.0f | %s | %s | %s | %s | %.1f | %.1f |\n", kMeanTimes_h[time], kQuantityNames[quantity],
                  text_of(before, digits).c_str(), text_of(now, digits).c_str(), text_of(difference, digits).c_str(),
                  100.0 * difference.value / before.value, difference.value / difference.se);
    }
  }
}

}  // namespace colony::bench
