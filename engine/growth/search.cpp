#include "engine/growth/search.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/growth/scorer.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

constexpr std::uint32_t kCorrectorLane = 1000;  // past the last generation of a predictor
constexpr double kGiveUpMarginLast = 0.02;

class Search {
 public:
  Search(const Colony& colony, const Params& params, const SearchTask& task, Workspace& workspace, StopFlag stop)
      : params_(params), task_(task), stop_(stop), ws_(workspace), scorer_(colony, params, task, workspace),
        population_size_(static_cast<std::size_t>(params.search.population)), gene_count_(gene_count_of(params.layers)) {}

  SearchResult run() {
    if (params_.search.optimiser == Optimiser::kGenetic) {
      predict();
      if (!good() && !hopeless_ && params_.search.corrector_generations > 0) correct();
    } else {
      sample();
    }
    SearchResult result;
    result.pair = decode(best_.chromosome, task_.frame, params_);
    result.search_fitness = best_.fitness;
    result.fitness = scorer_.score_finally(result.pair, result.crosses_wall, result.supported);
    result.evaluation_count = evaluation_count_;
    result.corrected = corrected_;
    return result;
  }

 private:
  Stream stream(std::uint32_t lane) const { return Stream(task_.seed, task_.cell_id, task_.ordinal, Purpose::kSearch, lane); }
  int bits() const { return static_cast<int>(params_.search.bits); }
  bool good() const { return best_.fitness >= params_.contact.fitness_good; }

  // Scores candidates from `first` on, then takes the best of all; from then on nobody is scored further than it takes to see that
  // he cannot beat it. The best used for that is never one of the generation in flight, so the order of scoring cannot matter.
  void evaluate(std::vector<Candidate>& candidates, std::size_t first) {
    throw_if_stopped(stop_);
    evaluation_count_ += static_cast<std::uint32_t>(candidates.size() - first);
    scorer_.score_all(candidates);
    // The first with the highest fitness.
    std::size_t best = 0;
    for (std::size_t i = 1; i < candidates.size(); ++i) {
      if (candidates[i].fitness > candidates[best].fitness) best = i;
    }
    best_ = candidates[best];
    if (task_.racing) scorer_.race_to(best_.fitness);
  }

  void predict() {
    std::vector<Candidate>& population = ws_.population;
    std::vector<Candidate>& next = ws_.bred;
    population.clear();
    Stream first = stream(0);
    for (std::size_t i = 0; i < population_size_; ++i) population.push_back({random_chromosome(gene_count_, bits(), first), kUnscored});
    population[0].chromosome.set_code(kTurn, code_of(0.5, bits(), params_.search.coding));  // the unturned plane
    // With layers, both on the dish: where nobody else is near, one population in ten has no other supported pair to breed from.
    for (int gene = kFirstHeight; gene < gene_count_; ++gene) {
      population[0].chromosome.set_code(gene, code_of(0.0, bits(), params_.search.coding));
    }
    evaluate(population, 0);
    hopeless_ = is_hopeless(0);
    for (std::int64_t generation = 1; generation <= params_.search.generations && !good() && !hopeless_; ++generation) {
      Stream random = stream(static_cast<std::uint32_t>(generation));
      next.clear();
      next.push_back(best_);  // the best is kept, and not scored again
      while (next.size() < population_size_) breed(population, random, next.emplace_back());
      evaluate(next, 1);
      std::swap(population, next);
      hopeless_ = is_hopeless(generation);
    }
  }

  // Whether so low a best after this generation has practically never led to a division. The margin that a search may still win shrinks
  // linearly with the generations left, from give_up_margin to kGiveUpMarginLast at the end of the predictor (the corrector, and what a
  // winner loses on fresh points). Measured: engine/DESIGN.md. Without inhibition any best is accepted, so the search goes on.
  bool is_hopeless(std::int64_t generation) const {
    if (!params_.search.give_up_margin || !params_.division.inhibition) return false;
    const auto left = static_cast<double>(params_.search.generations - generation);
    const double range = std::max(*params_.search.give_up_margin - kGiveUpMarginLast, 0.0);
    const double share = left > 0.0 ? left / static_cast<double>(params_.search.generations) : 0.0;
    return best_.fitness < params_.contact.fitness_min - kGiveUpMarginLast - range * share;
  }

  void breed(const std::vector<Candidate>& population, Stream& random, Candidate& child) const {
    const Candidate& a = select(population, random);
    const Candidate& b = select(population, random);
    child = a;
    if (random.uniform() < params_.search.crossover_rate) {
      const int cut = 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(child.chromosome.length() - 1)));
      child.chromosome = crossover(a.chromosome, b.chromosome, cut);
    }
    ws_.mutation.draw(random, [&](int bit) { child.chromosome.flip(bit); });
    // A child that is its parent again needs no new score: a converging population makes many.
    if (child.chromosome == b.chromosome) {
      child.fitness = b.fitness;
    } else if (child.chromosome != a.chromosome) {
      child.fitness = kUnscored;
    }
  }

  const Candidate& select(const std::vector<Candidate>& population, Stream& random) const {
    const auto n = static_cast<std::uint32_t>(population.size());
    if (params_.search.selection == Selection::kTournament) {
      const std::uint32_t i = random.below(n);
      const std::uint32_t j = random.below(n);
      const Candidate& a = population[std::min(i, j)];
      const Candidate& b = population[std::max(i, j)];
      return b.fitness > a.fitness ? b : a;
    }
    double total = 0.0;  // in index order
    for (const Candidate& candidate : population) total += candidate.fitness;
    if (!(total > 0.0)) return population[random.below(n)];
    double left = random.uniform() * total;
    for (const Candidate& candidate : population) {
      left -= candidate.fitness;
      if (left < 0.0) return candidate;
    }
    return population.back();
  }

  void correct() {
    corrected_ = true;
    const int low_bits = std::min(kCorrectorLowBits, bits());
    const auto low_bit_count = static_cast<std::uint32_t>(gene_count_ * low_bits);
    std::vector<Candidate>& variants = ws_.bred;
    for (std::int64_t generation = 0; generation < params_.search.corrector_generations && !good(); ++generation) {
      Stream random = stream(kCorrectorLane + static_cast<std::uint32_t>(generation));
      variants.clear();
      variants.push_back(best_);
      while (variants.size() < population_size_) {
        Candidate variant{best_.chromosome, kUnscored};
        // Two low bits on average and one at least: with none it would be the best again.
        const auto flip = [&](int k) { variant.chromosome.flip((k / low_bits) * bits() + bits() - 1 - k % low_bits); };
        const auto certain = static_cast<int>(random.below(low_bit_count));
        flip(certain);
        ws_.correction.draw(random, [&](int k) {
          if (k != certain) flip(k);
        });
        variants.push_back(variant);
      }
      evaluate(variants, 1);
    }
  }

  // Random or Sobol search with as many evaluations as predictor and corrector may use together.
  void sample() {
    const std::int64_t generations = params_.search.generations + params_.search.corrector_generations;
    std::array<std::uint32_t, kGeneCountMulti> seeds{};
    Stream first = stream(0);
    for (std::uint32_t& seed : seeds) seed = first.next_u32();
    std::uint32_t index = 0;
    std::vector<Candidate>& batch = ws_.bred;
    for (std::int64_t generation = 0; generation <= generations && !good(); ++generation) {
      Stream random = stream(static_cast<std::uint32_t>(generation) + 1);
      batch.clear();
      if (generation > 0) batch.push_back(best_);
      const std::size_t scored_from = batch.size();
      while (batch.size() < population_size_) {
        Chromosome chromosome(gene_count_, bits());
        if (params_.search.optimiser == Optimiser::kRandom) {
          chromosome = random_chromosome(gene_count_, bits(), random);
        } else {
          for (int gene = 0; gene < gene_count_; ++gene) {
            const std::uint32_t fraction = owen_scramble(sobol_u32(index, gene), seeds[static_cast<std::size_t>(gene)]);
            const std::uint32_t number = fraction >> (32 - bits());
            chromosome.set_code(gene, params_.search.coding == Coding::kGray ? gray_from_binary(number) : number);
          }
          ++index;
        }
        batch.push_back({chromosome, kUnscored});
      }
      evaluate(batch, scored_from);
    }
  }

  static constexpr double kUnscored = -1.0;

  const Params& params_;
  const SearchTask& task_;
  const StopFlag stop_;
  Workspace& ws_;
  Scorer scorer_;
  const std::size_t population_size_;
  const int gene_count_;
  Candidate best_;
  std::uint32_t evaluation_count_ = 0;
  bool corrected_ = false;
  bool hopeless_ = false;
};

}  // namespace

SearchResult find_space(const Colony& colony, const Params& params, const SearchTask& task, Workspace& workspace, StopFlag stop) {
  return Search(colony, params, task, workspace, stop).run();
}

SearchResult find_space(const Colony& colony, const Params& params, const SearchTask& task, StopFlag stop) {
  Workspace workspace(params);
  return find_space(colony, params, task, workspace, stop);
}

double retained_share(const Colony& colony, ContactRule rule, CellId cell_id, std::optional<CellId> excluded,
                      std::span<const Body* const> added, const PointSet& points) {
  const Body& body = colony.body(cell_id);
  std::vector<CellId> ids;
  colony.cells_meeting(body.box(), ids);
  std::vector<const Body*> neighbours;
  for (const CellId id : ids) {
    if (id != cell_id && !(excluded && id == *excluded)) neighbours.push_back(&colony.body(id));
  }
  for (const Body* other : added) {
    if (meets(other->box(), body.box())) neighbours.push_back(other);
  }
  const MassEstimate alone = deformed_mass(body, {}, rule, points);
  if (alone.hit_count == 0) return 1.0;
  const MassEstimate pressed = deformed_mass(body, neighbours, rule, points);
  return static_cast<double>(pressed.hit_count) / static_cast<double>(alone.hit_count);
}

}  // namespace colony
