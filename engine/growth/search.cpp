#include "engine/growth/search.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "engine/base/check.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

constexpr std::uint32_t kCorrectorLane = 1000;  // past the last generation of a predictor
constexpr int kLowBits = 3;                     // of a gene, which the corrector flips

PointSet points_for(const SearchTask& task, Purpose purpose, std::int64_t n, std::uint32_t lane = 0) {
  Stream stream(task.seed, task.cell_id, task.ordinal, purpose, lane);
  return scrambled_sobol(static_cast<std::uint32_t>(n), stream);
}

/// Scores candidate pairs of one search.
class Scorer {
 public:
  Scorer(const Colony& colony, const Params& params, const SearchTask& task) : colony_(colony), params_(params), task_(task) {
    const double reach = search_reach_um(params);
    const Vec3& c = task.frame.pivot_um;
    // Everything a candidate can touch: all z, because bodies stand on the dish.
    const Box area = {Vec3(c.x() - reach, c.y() - reach, 0.0), Vec3(c.x() + reach, c.y() + reach, 2.0 * reach)};
    colony.cells_meeting(area, ids_);
    std::erase(ids_, task.cell_id);
    for (const CellId id : ids_) bodies_.push_back(&colony.body(id));
    if (params.contact.neighbour_retained_min > 0.0) {
      retained_points_ = points_for(task, Purpose::kRetained, params.search.points, 0);
    }
  }

  /// From here on neighbours are judged on fresh points too, as the winner is.
  void refresh() {
    if (params_.contact.neighbour_retained_min > 0.0) {
      retained_points_ = points_for(task_, Purpose::kRetained, params_.search.points_final, 1);
    }
  }

  /// Whether the pair scored last reaches beyond the dish's wall.
  bool crosses_wall() const { return crosses_wall_; }

  double score(const Pair& pair, const PointSet& points) {
    const std::array<Body, 2> bodies = {Body(pair.bodies[0], params_.noise), Body(pair.bodies[1], params_.noise)};
    double fitness = 1.0;
    crosses_wall_ = false;
    for (std::size_t k = 0; k < 2; ++k) {
      neighbours_.clear();
      const Box own = bodies[k].box();
      for (const Body* other : bodies_) {
        if (meets(other->box(), own)) neighbours_.push_back(other);
      }
      neighbours_.push_back(&bodies[1 - k]);
      count_overlaps(bodies[k], neighbours_, params_.dish.radius_um, points, scratch_, counts_);
      fitness = std::min(fitness, counts_.fitness());
      crosses_wall_ = crosses_wall_ || counts_.outside_wall_count > 0;
    }
    if (fitness > 0.0 && params_.contact.neighbour_retained_min > 0.0 && !neighbours_keep_enough(bodies)) return 0.0;
    return fitness;
  }

 private:
  bool neighbours_keep_enough(const std::array<Body, 2>& bodies) {
    const std::array<const Body*, 2> added = {&bodies[0], &bodies[1]};
    for (std::size_t j = 0; j < ids_.size(); ++j) {
      const Box& box = bodies_[j]->box();
      if (!meets(box, bodies[0].box()) && !meets(box, bodies[1].box())) continue;
      const double share =
          retained_share(colony_, params_.contact.rule, ids_[j], task_.cell_id, added, retained_points_);
      if (share >= params_.contact.neighbour_retained_min) continue;
      // A neighbour pressed below the minimum before refuses only pairs that press it further.
      const double before = retained_share(colony_, params_.contact.rule, ids_[j], std::nullopt, {}, retained_points_);
      if (share < before) return false;
    }
    return true;
  }

  const Colony& colony_;
  const Params& params_;
  const SearchTask& task_;
  std::vector<CellId> ids_;                 // ascending
  std::vector<const Body*> bodies_;         // of ids_
  std::vector<const Body*> neighbours_;     // of the body being scored
  PointSet retained_points_;
  OverlapScratch scratch_;
  OverlapCounts counts_;
  bool crosses_wall_ = false;
};

struct Candidate {
  Chromosome chromosome;
  double fitness = 0.0;
};

class Search {
 public:
  Search(const Colony& colony, const Params& params, const SearchTask& task, StopFlag stop)
      : params_(params), task_(task), stop_(stop), scorer_(colony, params, task),
        points_(points_for(task, Purpose::kSearchPoints, params.search.points)),
        population_size_(static_cast<std::size_t>(params.search.population)),
        best_{Chromosome(static_cast<int>(params.search.bits))} {}

  SearchResult run() {
    if (params_.search.optimiser == Optimiser::kGenetic) {
      predict();
      if (best_.fitness < params_.contact.fitness_good && params_.search.corrector_generations > 0) correct();
    } else {
      sample();
    }
    SearchResult result;
    result.pair = decode(best_.chromosome, task_.frame, params_);
    result.search_fitness = best_.fitness;
    scorer_.refresh();
    result.fitness = scorer_.score(result.pair, points_for(task_, Purpose::kFinalPoints, params_.search.points_final));
    result.crosses_wall = scorer_.crosses_wall();
    result.evaluation_count = evaluation_count_;
    result.corrected = corrected_;
    return result;
  }

 private:
  Stream stream(std::uint32_t lane) const { return Stream(task_.seed, task_.cell_id, task_.ordinal, Purpose::kSearch, lane); }
  int bits() const { return static_cast<int>(params_.search.bits); }
  bool good() const { return best_.fitness >= params_.contact.fitness_good; }

  void evaluate(Candidate& candidate) {
    throw_if_stopped(stop_);
    ++evaluation_count_;
    const auto [known, is_new] = scores_.try_emplace(candidate.chromosome, 0.0);
    if (is_new) known->second = scorer_.score(decode(candidate.chromosome, task_.frame, params_), points_);
    candidate.fitness = known->second;
  }

  // The first candidate of the population with the highest fitness.
  const Candidate& best_of(const std::vector<Candidate>& population) const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < population.size(); ++i) {
      if (population[i].fitness > population[best].fitness) best = i;
    }
    return population[best];
  }

  void predict() {
    std::vector<Candidate> population;
    Stream first = stream(0);
    for (std::size_t i = 0; i < population_size_; ++i) population.push_back({random_chromosome(bits(), first), 0.0});
    population[0].chromosome.set_code(kTurn, code_of(0.5, bits(), params_.search.coding));  // the unturned plane
    for (Candidate& candidate : population) evaluate(candidate);
    best_ = best_of(population);

    for (std::int64_t generation = 1; generation <= params_.search.generations && !good(); ++generation) {
      Stream random = stream(static_cast<std::uint32_t>(generation));
      std::vector<Candidate> next = {best_};  // the best is kept, and not scored again
      while (next.size() < population_size_) next.push_back({breed(population, random), 0.0});
      for (std::size_t i = 1; i < next.size(); ++i) evaluate(next[i]);
      population = std::move(next);
      best_ = best_of(population);
    }
  }

  Chromosome breed(const std::vector<Candidate>& population, Stream& random) const {
    const Candidate& a = select(population, random);
    const Candidate& b = select(population, random);
    Chromosome child = a.chromosome;
    if (random.uniform() < params_.search.crossover_rate) {
      const int cut = 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(child.length() - 1)));
      child = crossover(a.chromosome, b.chromosome, cut);
    }
    const double rate = params_.search.mutation_rate.value_or(1.0 / child.length());
    const auto threshold = static_cast<std::uint64_t>(rate * 4294967296.0);
    for (int bit = 0; bit < child.length(); ++bit) {
      if (random.next_u32() < threshold) child.flip(bit);
    }
    return child;
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
    const int low_bits = std::min(kLowBits, bits());
    const int low_bit_count = kGeneCount * low_bits;
    for (std::int64_t generation = 0; generation < params_.search.corrector_generations && !good(); ++generation) {
      Stream random = stream(kCorrectorLane + static_cast<std::uint32_t>(generation));
      std::vector<Candidate> variants = {best_};
      while (variants.size() < population_size_) {
        Chromosome variant = best_.chromosome;
        // Two low bits on average and one at least: with none it would be the best again.
        const int certain = static_cast<int>(random.below(static_cast<std::uint32_t>(low_bit_count)));
        for (int k = 0; k < low_bit_count; ++k) {
          if (random.below(static_cast<std::uint32_t>(low_bit_count)) != 0 && k != certain) continue;
          variant.flip((k / low_bits) * bits() + bits() - 1 - k % low_bits);
        }
        variants.push_back({variant, 0.0});
      }
      for (std::size_t i = 1; i < variants.size(); ++i) evaluate(variants[i]);
      best_ = best_of(variants);
    }
  }

  // Random or Sobol search with as many evaluations as predictor and corrector may use together.
  void sample() {
    const std::int64_t generations = params_.search.generations + params_.search.corrector_generations;
    std::array<std::uint32_t, kGeneCount> seeds{};
    Stream first = stream(0);
    for (std::uint32_t& seed : seeds) seed = first.next_u32();
    std::uint32_t index = 0;
    for (std::int64_t generation = 0; generation <= generations && !good(); ++generation) {
      Stream random = stream(static_cast<std::uint32_t>(generation) + 1);
      std::vector<Candidate> batch;
      if (generation > 0) batch.push_back(best_);
      const std::size_t scored_from = batch.size();
      while (batch.size() < population_size_) {
        Chromosome chromosome(bits());
        if (params_.search.optimiser == Optimiser::kRandom) {
          chromosome = random_chromosome(bits(), random);
        } else {
          for (int gene = 0; gene < kGeneCount; ++gene) {
            const std::uint32_t fraction = owen_scramble(sobol_u32(index, gene), seeds[static_cast<std::size_t>(gene)]);
            const std::uint32_t number = fraction >> (32 - bits());
            chromosome.set_code(gene, params_.search.coding == Coding::kGray ? gray_from_binary(number) : number);
          }
          ++index;
        }
        batch.push_back({chromosome, 0.0});
      }
      for (std::size_t i = scored_from; i < batch.size(); ++i) evaluate(batch[i]);
      best_ = best_of(batch);
    }
  }

  const Params& params_;
  const SearchTask& task_;
  const StopFlag stop_;
  Scorer scorer_;
  const PointSet points_;
  const std::size_t population_size_;
  Candidate best_;
  std::map<Chromosome, double> scores_;     // a converging population makes the same candidate again and again
  std::uint32_t evaluation_count_ = 0;
  bool corrected_ = false;
};

}  // namespace

SearchResult find_space(const Colony& colony, const Params& params, const SearchTask& task, StopFlag stop) {
  return Search(colony, params, task, stop).run();
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
