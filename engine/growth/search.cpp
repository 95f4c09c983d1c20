#include "engine/growth/search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

constexpr std::uint32_t kCorrectorLane = 1000;  // past the last generation of a predictor
constexpr double kDropDeviations = 1.5;         // see race_to()

std::array<std::uint32_t, 3> seeds_for(const SearchTask& task, Purpose purpose, std::uint32_t lane) {
  Stream stream(task.seed, task.cell_id, task.ordinal, purpose, lane);
  return {stream.next_u32(), stream.next_u32(), stream.next_u32()};
}

constexpr double kGiveUpMarginLast = 0.02;

double share_left(std::uint32_t hits, std::uint32_t shared) {
  return shared >= hits ? 0.0 : static_cast<double>(hits - shared) / static_cast<double>(hits);
}

/// Scores candidate pairs of one search.
class Scorer {
 public:
  Scorer(const Colony& colony, const Params& params, const SearchTask& task, Workspace& workspace)
      : colony_(colony), params_(params), task_(task), ws_(workspace) {
    const double reach = search_reach_um(params);
    const Vec3& c = task.frame.pivot_um;
    // Everything a candidate can touch: all z, because bodies stand on the dish or little above it.
    const Box area = {Vec3(c.x() - reach, c.y() - reach, 0.0), Vec3(c.x() + reach, c.y() + reach, c.z() + 4.0 * reach)};
    colony.cells_meeting(area, ws_.ids);
    std::erase(ws_.ids, task.cell_id);
    ws_.bodies.clear();
    ws_.by_gap.clear();
    for (const CellId id : ws_.ids) {
      const Body& body = colony.body(id);
      ws_.bodies.push_back(&body);
      const Box& box = body.box();
      const double gap = std::max({box.low.x() - c.x(), c.x() - box.high.x(), box.low.y() - c.y(), c.y() - box.high.y()});
      ws_.by_gap.push_back({static_cast<float>(gap), id, &body});
    }
    std::sort(ws_.by_gap.begin(), ws_.by_gap.end(), [](const auto& a, const auto& b) { return std::tie(a.gap_um, a.id) < std::tie(b.gap_um, b.id); });
    kernel::SearchScene& scene = ws_.scene;
    ws_.voxels.centre_on(c);
    scene.counts = ws_.voxels.counts();
    scene.voxels_x = static_cast<float>(ws_.voxels.nx());
    scene.empty_cube = static_cast<float>(ws_.voxels.empty_cube());
    scene.voxels_per_um = static_cast<float>(1.0 / ws_.voxels.edge_um());
    const Vec3 shift = (c - ws_.voxels.corner_um()) / ws_.voxels.edge_um() - Vec3::Constant(0.5);
    for (int i = 0; i < 3; ++i) scene.voxel_shift[i] = static_cast<float>(shift[i]);
    scene.dish_z = static_cast<float>(-c.z());
    scene.has_wall = false;
    if (params.dish.radius_um) {
      const double radius = *params.dish.radius_um;
      scene.has_wall = std::sqrt(c.x() * c.x() + c.y() * c.y()) + std::sqrt(2.0) * reach > radius;
      scene.wall_x = static_cast<float>(-c.x());
      scene.wall_y = static_cast<float>(-c.y());
      scene.wall_radius2 = static_cast<float>(radius * radius);
    }
    // In the order of the sequence: every prefix is a fair sample.
    scrambled_sobol(static_cast<std::uint32_t>(params.search.points), seeds_for(task, Purpose::kSearchPoints, 0), ws_.points);
    for (std::size_t k = 0; k < 2; ++k) {
      // Only the noise of this body counts: its place and shape are the candidate's.
      const Body noise_of({Vec3::Zero(), Vec3::Ones(), Vec3::Zero(), task.frame.noise_offsets[k]}, params.noise);
      ws_.candidate[k].field = kernel::FloatBody(noise_of, Vec3::Zero());
      kernel::select_own_points(ws_.candidate[k].field, static_cast<float>(noise_of.noisy_scale()), ws_.points, scene.own[k],
                                &ws_.overlap.work);
    }
    if (params.contact.neighbour_retained_min > 0.0) {
      tiled_sobol(static_cast<std::uint32_t>(params.search.points), seeds_for(task, Purpose::kRetained, 0), ws_.retained_points);
    }
  }

  /// From here on a candidate is given up once it cannot beat `best` any more: after h hits, when more are shared than
  ///     h (1 - best) + kDropDeviations sqrt(h best (1 - best)) + 1/2.
  /// A candidate whose true fitness is `best` shares a binomial number with mean h (1 - best) (Sobol points vary less), so it is given
  /// up with probability below 7 % at each of the two looks; one that would be better by d is safer by d sqrt(h / best (1 - best)).
  void race_to(double best) {
    const std::size_t n = std::max(ws_.scene.own[0].size(), ws_.scene.own[1].size());
    ws_.most_shared.resize(n + 1);
    for (std::size_t h = 0; h <= n; ++h) {
      const auto hits = static_cast<double>(h);
      ws_.most_shared[h] =
          static_cast<std::uint32_t>(hits * (1.0 - best) + kDropDeviations * std::sqrt(hits * best * (1.0 - best)) + 0.5);
    }
    racing_ = best > 0.0;
  }

  /// On the points of the search. Below the best if it was given up.
  double score(const Chromosome& chromosome) {
    ws_.genes.decode(chromosome, task_.frame, ws_.candidate);
    const kernel::ShareLimit limit = racing_ ? kernel::ShareLimit(ws_.most_shared) : kernel::ShareLimit();
    cover(std::max(ws_.candidate[0].reach, ws_.candidate[1].reach));
    const kernel::PairScore score = kernel::score_pair(ws_.scene, ws_.candidate, limit, ws_.overlap.work);
    if (score.beyond_wall) return 0.0;
    double fitness = 1.0;
    for (std::size_t k = 0; k < 2; ++k) {
      if (score.hits[k] == 0 && score.dropped) continue;  // not looked at
      fitness = std::min(fitness, share_left(score.hits[k], score.shared[k]));
    }
    if (score.dropped || !(fitness > 0.0) || !(params_.contact.neighbour_retained_min > 0.0)) return fitness;
    const Pair pair = decode(chromosome, task_.frame, params_);
    const std::array<Body, 2> bodies = {Body(pair.bodies[0], params_.noise), Body(pair.bodies[1], params_.noise)};
    return neighbours_keep_enough(bodies) ? fitness : 0.0;
  }

  /// On the fresh points, by the definition.
  double score_finally(const Pair& pair, bool& crosses_wall) {
    tiled_sobol(static_cast<std::uint32_t>(params_.search.points_final), seeds_for(task_, Purpose::kFinalPoints, 0), ws_.final_points);
    const std::array<Body, 2> bodies = {Body(pair.bodies[0], params_.noise), Body(pair.bodies[1], params_.noise)};
    double fitness = 1.0;
    crosses_wall = false;
    for (std::size_t k = 0; k < 2; ++k) {
      ws_.near.clear();
      ws_.near.push_back(&bodies[1 - k]);
      const Box own = bodies[k].box();
      for (const Workspace::Neighbour& other : ws_.by_gap) {
        if (meets(other.body->box(), own)) ws_.near.push_back(other.body);
      }
      count_overlaps(bodies[k], ws_.near, params_.dish.radius_um, ws_.final_points, ws_.overlap, ws_.counts);
      fitness = std::min(fitness, ws_.counts.fitness());
      crosses_wall = crosses_wall || ws_.counts.outside_wall_count > 0;
    }
    if (fitness > 0.0 && params_.contact.neighbour_retained_min > 0.0) {
      // Neighbours are judged on fresh points too.
      tiled_sobol(static_cast<std::uint32_t>(params_.search.points_final), seeds_for(task_, Purpose::kRetained, 1), ws_.retained_points);
      if (!neighbours_keep_enough(bodies)) return 0.0;
    }
    return fitness;
  }

 private:
  // Puts into the voxels every neighbour that a body of this reach can meet.
  void cover(float reach_um) {
    // The margin is for rounding alone.
    for (; covered_ < ws_.by_gap.size() && ws_.by_gap[covered_].gap_um <= 1.0001F * reach_um + 0.001F; ++covered_) {
      const Workspace::Neighbour& other = ws_.by_gap[covered_];
      ws_.voxels.add(ws_.rasters.of(other.id, *other.body, ws_.overlap.work));
    }
  }

  bool neighbours_keep_enough(const std::array<Body, 2>& bodies) {
    const std::array<const Body*, 2> added = {&bodies[0], &bodies[1]};
    for (std::size_t j = 0; j < ws_.ids.size(); ++j) {
      const Box& box = ws_.bodies[j]->box();
      if (!meets(box, bodies[0].box()) && !meets(box, bodies[1].box())) continue;
      const double share = retained_share(colony_, params_.contact.rule, ws_.ids[j], task_.cell_id, added, ws_.retained_points);
      if (share >= params_.contact.neighbour_retained_min) continue;
      // A neighbour pressed below the minimum before refuses only pairs that press it further.
      const double before = retained_share(colony_, params_.contact.rule, ws_.ids[j], std::nullopt, {}, ws_.retained_points);
      if (share < before) return false;
    }
    return true;
  }

  const Colony& colony_;
  const Params& params_;
  const SearchTask& task_;
  Workspace& ws_;
  bool racing_ = false;
  std::size_t covered_ = 0;   // of by_gap: those in the voxels
};

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
    result.fitness = scorer_.score_finally(result.pair, result.crosses_wall);
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
    for (std::size_t i = first; i < candidates.size(); ++i) {
      ++evaluation_count_;
      if (candidates[i].fitness < 0.0) candidates[i].fitness = scorer_.score(candidates[i].chromosome);
    }
    // The first with the highest fitness.
    std::size_t best = 0;
    for (std::size_t i = 1; i < candidates.size(); ++i) {
      if (candidates[i].fitness > candidates[best].fitness) best = i;
    }
    best_ = candidates[best];
    scorer_.race_to(best_.fitness);
  }

  void predict() {
    std::vector<Candidate>& population = ws_.population;
    std::vector<Candidate>& next = ws_.bred;
    population.clear();
    Stream first = stream(0);
    for (std::size_t i = 0; i < population_size_; ++i) population.push_back({random_chromosome(gene_count_, bits(), first), kUnscored});
    population[0].chromosome.set_code(kTurn, code_of(0.5, bits(), params_.search.coding));  // the unturned plane
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
