// Searches compared on real attempts: every variant is asked the very task that the simulator asked, in the colony as it was.
#include <ctime>

#include "engine/growth/search.hpp"
#include "tests/bench/attempts.hpp"
#include "tests/bench/evidence.hpp"

namespace colony::bench {
namespace {

struct Variant {
  const char* name;
  void (*change)(Params&);
};

// The default first: the others are compared with it, attempt by attempt. `whole`: no search is given up nor ends
// early, so that all spend the same number of candidates.
constexpr Variant kWhole[] = {
    {"genetic (tournament, Gray, corrector)", [](Params&) {}},
    {"random", [](Params& p) { p.search.optimiser = Optimiser::kRandom; }},
    {"Sobol", [](Params& p) { p.search.optimiser = Optimiser::kSobol; }},
    {"roulette instead of tournament", [](Params& p) { p.search.selection = Selection::kRoulette; }},
    {"binary instead of Gray", [](Params& p) { p.search.coding = Coding::kBinary; }},
    {"no corrector, 4 generations more",
     [](Params& p) {
       p.search.generations += p.search.corrector_generations;
       p.search.corrector_generations = 0;
     }},
    {"no corrector", [](Params& p) { p.search.corrector_generations = 0; }},
};
constexpr Variant kAsUsed[] = {
    {"default", [](Params&) {}},
    {"never given up", [](Params& p) { p.search.give_up_margin.reset(); }},
    {"64 points", [](Params& p) { p.search.points = 64; }},
    {"128 points", [](Params& p) { p.search.points = 128; }},
    {"512 points", [](Params& p) { p.search.points = 512; }},
    {"1,024 points", [](Params& p) { p.search.points = 1024; }},
    {"4,096 points", [](Params& p) { p.search.points = 4096; }},
};

struct Sample {
  std::vector<double> fitness, accepted, bias, candidates, evaluations, cpu_us;
};

double cpu_now_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

void print_variants(const char* title, std::span<const Variant> variants, bool whole, const EvidenceSize& size) {
  const int seed_count = size.of(4, 24);
  std::vector<std::vector<Sample>> by_seed(static_cast<std::size_t>(seed_count), std::vector<Sample>(variants.size()));
  for_each_slot(seed_count, [&](int k) {
    RunSpec spec;
    spec.seed = static_cast<Seed>(5001 + k);
    spec.until.time_h = 250.0;
    std::vector<Params> params;
    std::vector<Workspace> workspaces;
    for (const Variant& variant : variants) {
      Params changed = spec.params;
      if (whole) {
        changed.search.give_up_margin.reset();
        changed.contact.fitness_good = 1.0;
      }
      variant.change(changed);
      params.push_back(changed);
      workspaces.emplace_back(changed);
    }
    int number = 0;
    for_each_attempt(
        spec,
        [&](const Colony& colony, const SearchTask& asked) {
          if (++number % 3 != 0) return;
          SearchTask task = asked;
          task.ordinal += 1'000'000;  // other draws than those that made this history
          for (std::size_t v = 0; v < variants.size(); ++v) {
            Workspace& workspace = workspaces[v];
            workspace.overlap.work = {};
            const double before_us = cpu_now_us();
            const SearchResult found = find_space(colony, params[v], task, workspace);
            Sample& sample = by_seed[static_cast<std::size_t>(k)][v];
            sample.cpu_us.push_back(cpu_now_us() - before_us);
            sample.fitness.push_back(found.fitness);
            sample.accepted.push_back(found.fitness >= spec.params.contact.fitness_min ? 1.0 : 0.0);
            sample.bias.push_back(found.search_fitness - found.fitness);
            sample.candidates.push_back(found.evaluation_count);
            sample.evaluations.push_back(static_cast<double>(workspace.overlap.work.field_count));
          }
        },
        [](const Event&) {});
  });
  std::vector<Sample> all(variants.size());
  const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const std::vector<Sample>& samples : by_seed) {
    for (std::size_t v = 0; v < variants.size(); ++v) {
      append(all[v].fitness, samples[v].fitness);
      append(all[v].accepted, samples[v].accepted);
      append(all[v].bias, samples[v].bias);
      append(all[v].candidates, samples[v].candidates);
      append(all[v].evaluations, samples[v].evaluations);
      append(all[v].cpu_us, samples[v].cpu_us);
    }
  }
  std::printf(
      "\n%s: %zu attempts of %d colonies to 250 h; fitness on 4,096 fresh points; differences attempt by attempt\n\n",
      title, all[0].fitness.size(), seed_count);
  std::printf(
      "| search | fitness | less the first | accepted, %% | less the first | lost on fresh points | candidates | "
      "evaluations | CPU us |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (std::size_t v = 0; v < variants.size(); ++v) {
    std::vector<double> fitness, accepted;
    for (std::size_t i = 0; i < all[v].fitness.size(); ++i) {
      fitness.push_back(all[v].fitness[i] - all[0].fitness[i]);
      accepted.push_back(100.0 * (all[v].accepted[i] - all[0].accepted[i]));
    }
    std::printf("| %s | %.4f | %s | %.1f | %s | %.3f | %.0f | %.0f | %.0f |\n", variants[v].name,
                testing::mean_of(all[v].fitness).value, v == 0 ? "" : text_of(testing::mean_of(fitness), 4).c_str(),
                100.0 * testing::mean_of(all[v].accepted).value,
                v == 0 ? "" : text_of(testing::mean_of(accepted), 1).c_str(), testing::mean_of(all[v].bias).value,
                testing::mean_of(all[v].candidates).value, testing::mean_of(all[v].evaluations).value,
                testing::mean_of(all[v].cpu_us).value);
  }
}

}  // namespace

void print_searches(const EvidenceSize& size) {
  print_variants("Searches with equal candidates (none given up, none ends early)", kWhole, true, size);
  print_variants("Points of the search, and giving up", kAsUsed, false, size);
}

}  // namespace colony::bench
