#include "engine/growth/scorer.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "engine/base/check.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

constexpr double kDropDeviations = 2.0;               // see race_to()
constexpr std::size_t kPointsWorthThreads = 65'536;   // of a generation: 100 us

std::array<std::uint32_t, 3> seeds_for(const SearchTask& task, Purpose purpose, std::uint32_t lane) {
  Stream stream(task.seed, task.cell_id, task.ordinal, purpose, lane);
  return {stream.next_u32(), stream.next_u32(), stream.next_u32()};
}

double share_left(std::uint32_t hits, std::uint32_t shared) {
  return shared >= hits ? 0.0 : static_cast<double>(hits - shared) / static_cast<double>(hits);
}

}  // namespace

void search_points(const Params& params, const std::array<std::uint32_t, 3>& seeds, PointSet& out) {
  const auto points = static_cast<std::uint32_t>(params.search.points);
  scrambled_sobol(std::min(2 * points, kSobolPointsMax), seeds, out);
  out.count = std::min(points + points / 2, kSobolPointsMax);
}

PointSet search_points(const Params& params, Stream& stream) {
  const std::array<std::uint32_t, 3> seeds = {stream.next_u32(), stream.next_u32(), stream.next_u32()};
  PointSet points;
  search_points(params, seeds, points);
  return points;
}

Scorer::Scorer(const Colony& colony, const Params& params, const SearchTask& task, Workspace& workspace)
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
    const double x = std::max({box.low.x() - c.x(), c.x() - box.high.x(), 0.0});
    const double y = std::max({box.low.y() - c.y(), c.y() - box.high.y(), 0.0});
    ws_.by_gap.push_back({static_cast<float>(std::sqrt(x * x + y * y)), id, &body});
  }
  std::sort(ws_.by_gap.begin(), ws_.by_gap.end(), [](const auto& a, const auto& b) { return std::tie(a.gap_um, a.id) < std::tie(b.gap_um, b.id); });
  kernel::SearchScene& scene = ws_.scene;
  ws_.voxels.centre_on(c);
  scene.counts = ws_.voxels.counts();
  scene.voxels_x = static_cast<float>(ws_.voxels.nx());
  scene.empty_cube = static_cast<float>(ws_.voxels.empty_cube());
  scene.voxels_per_um = static_cast<float>(1.0 / ws_.voxels.edge_um());
  const Vec3 shift = (c - ws_.voxels.corner_um()) / ws_.voxels.edge_um() - Vec3(0.5, 0.5, 0.5 - kVoxelLift);
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
  search_points(params, seeds_for(task, Purpose::kSearchPoints, 0), ws_.points);
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

void Scorer::race_to(double best) {
  const std::size_t n = std::max(ws_.scene.own[0].size(), ws_.scene.own[1].size());
  for (std::size_t h = ws_.roots.size(); h <= n; ++h) ws_.roots.push_back(std::sqrt(static_cast<double>(h)));
  ws_.most_shared.resize(n + 1);
  const double share = 1.0 - best;
  const double deviation = kDropDeviations * std::sqrt(best * (1.0 - best));
  for (std::size_t h = 0; h <= n; ++h) {
    ws_.most_shared[h] = static_cast<std::uint32_t>(static_cast<double>(h) * share + deviation * ws_.roots[h] + 0.5);
  }
  racing_ = best > 0.0;
}

void Scorer::score_all(std::vector<Candidate>& candidates) {
  std::size_t count = 0;
  for (const Candidate& candidate : candidates) count += candidate.fitness < 0.0 ? 1 : 0;
  if (ws_.threads == 1 || !is_worth_threads(count)) {
    for (Candidate& candidate : candidates) {
      if (candidate.fitness < 0.0) candidate.fitness = score(candidate.chromosome, ws_.candidate, ws_.overlap.work);
    }
    return;
  }
  // The voxels are filled first, for all of them: then scoring changes nothing but its own slot, and a slot's value does not depend on who
  // scores it or when. Isolated: a thread that waits here must not begin another event.
  for (const Candidate& candidate : candidates) {
    ws_.genes.decode(candidate.chromosome, task_.frame, ws_.candidate);
    cover(std::max(ws_.candidate[0].reach, ws_.candidate[1].reach));
  }
  ws_.work_of.assign(candidates.size(), {});
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
      if (!(candidates[i].fitness < 0.0)) return;
      std::array<kernel::CandidateBody, 2> bodies = ws_.candidate;
      candidates[i].fitness = score(candidates[i].chromosome, bodies, ws_.work_of[i]);
    });
  });
  for (const kernel::CountWork& work : ws_.work_of) ws_.overlap.work += work;
}

double Scorer::score_finally(const Pair& pair, bool& crosses_wall, bool& supported) {
  const std::array<std::uint32_t, 3> seeds = seeds_for(task_, Purpose::kFinalPoints, 0);
  const auto final_count = static_cast<std::uint32_t>(params_.search.points_final);
  const std::array<Body, 2> bodies = {Body(pair.bodies[0], params_.noise), Body(pair.bodies[1], params_.noise)};
  if (params_.division.inhibition && final_count > kLookPoints) {
    scrambled_sobol(kLookPoints, seeds, ws_.final_points);
    const double fitness = fitness_of(bodies, crosses_wall);
    if (fitness < params_.contact.fitness_min - kLookMargin) return fitness;
  }
  tiled_sobol(final_count, seeds, ws_.final_points);
  const double fitness = fitness_of(bodies, crosses_wall);
  supported = params_.layers == Layers::kMono || is_supported(footings_, kSupportPercent);
  if (!supported) return 0.0;
  if (fitness > 0.0 && params_.contact.neighbour_retained_min > 0.0) {
    // Neighbours are judged on fresh points too.
    tiled_sobol(static_cast<std::uint32_t>(params_.search.points_final), seeds_for(task_, Purpose::kRetained, 1), ws_.retained_points);
    if (!neighbours_keep_enough(bodies)) return 0.0;
  }
  return fitness;
}

double Scorer::fitness_of(const std::array<Body, 2>& bodies, bool& crosses_wall) {
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
    const std::vector<std::uint32_t>& shared = ws_.counts.shared_counts;  // the sibling's first
    const auto most = std::max_element(shared.begin() + 1, shared.end());
    footings_[k] = {reaches_dish(bodies[k]), ws_.counts.hit_count, most == shared.end() ? 0 : *most, shared.front()};
  }
  return fitness;
}

bool Scorer::is_worth_threads(std::size_t candidate_count) const {
  return candidate_count > 1 && (params_.contact.neighbour_retained_min > 0.0 ||
                                 candidate_count * static_cast<std::size_t>(params_.search.points) >= kPointsWorthThreads);
}

double Scorer::score(const Chromosome& chromosome, std::array<kernel::CandidateBody, 2>& candidate, kernel::CountWork& work) {
  ws_.genes.decode(chromosome, task_.frame, candidate);
  const kernel::ShareLimit limit = racing_ ? kernel::ShareLimit(ws_.most_shared) : kernel::ShareLimit();
  cover(std::max(candidate[0].reach, candidate[1].reach));
  const kernel::PairScore score = kernel::score_pair(ws_.scene, candidate, limit, work);
  if (score.beyond_wall) return 0.0;
  double fitness = 1.0;
  for (std::size_t k = 0; k < 2; ++k) {
    if (score.hits[k] == 0 && score.dropped) continue;  // not looked at
    fitness = std::min(fitness, share_left(score.hits[k], score.shared[k]));
  }
  if (score.dropped || !(fitness > 0.0)) return fitness;
  if (params_.layers == Layers::kMulti &&
      !is_supported({footing(score, candidate, 0), footing(score, candidate, 1)}, kSupportPercentInSearch)) {
    return 0.0;
  }
  if (!(params_.contact.neighbour_retained_min > 0.0)) return fitness;
  const Pair pair = decode(chromosome, task_.frame, params_);
  const std::array<Body, 2> bodies = {Body(pair.bodies[0], params_.noise), Body(pair.bodies[1], params_.noise)};
  return neighbours_keep_enough(bodies) ? fitness : 0.0;
}

Footing Scorer::footing(const kernel::PairScore& score, const std::array<kernel::CandidateBody, 2>& candidate, std::size_t k) const {
  const float* up = candidate[k].axes + 6;
  const float height = candidate[k].centre[2] - ws_.scene.dish_z;
  const bool on_dish = height <= std::sqrt((up[0] * up[0] + up[1] * up[1]) + up[2] * up[2]);
  return {on_dish, score.hits[k], score.shared[k] - score.sibling[k], score.sibling[k]};
}

void Scorer::cover(float reach_um) {
  // A cube may be covered whose far half lies beyond the body: an edge more, so that what a candidate meets never depends on which
  // candidates came before it. The rest of the margin is for rounding.
  reach_um += static_cast<float>(ws_.voxels.edge_um());
  for (; covered_ < ws_.by_gap.size() && ws_.by_gap[covered_].gap_um <= 1.0001F * reach_um + 0.001F; ++covered_) {
    const Workspace::Neighbour& other = ws_.by_gap[covered_];
    ws_.voxels.add(ws_.rasters.of(other.id, *other.body, ws_.overlap.work));
  }
}

bool Scorer::neighbours_keep_enough(const std::array<Body, 2>& bodies) {
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

}  // namespace colony
