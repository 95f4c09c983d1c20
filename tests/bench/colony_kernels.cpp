// colony-kernels: what the pieces of a decision cost, on a real search of a colony of 300 cells, beside the machine's
// ceiling.
// Usage:  colony-kernels [Google Benchmark's options]. `per_item`: CPU time a point (or cube, pair, ...), see each label.
#include <benchmark/benchmark.h>
#include <cmath>

#include "engine/growth/search.hpp"
#include "engine/model/event.hpp"
#include "engine/space/deformed_kernel.hpp"
#include "engine/space/overlap.hpp"
#include "engine/space/pair_kernel.hpp"
#include "engine/space/voxel_kernel.hpp"
#include "tests/bench/ceiling.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/runs.hpp"

namespace colony {
namespace {

const testing::Run& grown() {
  static const testing::Run run = testing::run(testing::spec_of(1, 300));
  return run;
}

SearchTask task_at(CellId id) {
  SearchTask task;
  task.seed = 77;
  task.cell_id = id;
  task.frame.pivot_um = grown().colony().cell(id).nucleus_um;
  task.frame.direction = Vec3(1.0, 0.0, 0.0);
  task.frame.noise_offsets = {Vec3(1.0, 7.0, 3.0), Vec3(9.0, 2.0, 5.0)};
  return task;
}

/// A workspace as a search leaves it, ready to score pairs.
struct Searched {
  Params params;
  Workspace workspace{params};
  SearchTask task = task_at(CellId{150});
  std::vector<Chromosome> chromosomes;
  Searched() {
    find_space(grown().colony(), params, task, workspace);
    Stream stream(5, CellId{1}, 0, Purpose::kSearch);
    for (int k = 0; k < 64; ++k) chromosomes.push_back(random_chromosome(kGeneCountMono, 8, stream));
  }
};
Searched& searched() {
  static Searched one;
  return one;
}

void items(benchmark::State& state, double count, const char* what) {
  state.counters["per_item"] = benchmark::Counter(count, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.SetLabel(std::string(what) + ", " + kernel::vector_target());
}

void ceiling(benchmark::State& state, double operations) {
  float sink[3] = {0.999F, 0.001F, 0.0F};
  constexpr std::size_t kRounds = 4096;
  std::size_t lanes = 1;
  double done = 0.0;
  for (auto _ : state) {
    lanes = bench::multiply_add(kRounds, sink);
    benchmark::DoNotOptimize(sink[2]);
    done += 16.0 * static_cast<double>(kRounds * lanes);
  }
  items(state, done / operations, "evaluation equivalent");
}
BENCHMARK_CAPTURE(ceiling, smooth, bench::kSmoothOperations);
BENCHMARK_CAPTURE(ceiling, noisy, bench::kNoisyOperations);

/// Points of one body's field: all so deep inside that no noise is asked, or all in the noise band.
void field(benchmark::State& state, bool noisy) {
  const Body body = grown().colony().body(CellId{150});
  const kernel::FloatBody prepared(body, body.centre_um());
  const PointSet unit = testing::points(65536, 3);
  std::vector<float> x, y, z;
  for (std::size_t i = 0; i < unit.size() && x.size() < 4096; ++i) {
    const Vec3 q(3.0 * unit.x[i] - 1.5, 3.0 * unit.y[i] - 1.5, 3.0 * unit.z[i] - 1.5);  // in semiaxes
    const double smooth = 1.0 - q.squaredNorm();
    if (noisy ? std::abs(smooth) > 0.9 * body.noise_bound() : smooth < 1.1 * body.noise_bound()) continue;
    const Vec3 p = body.to_unit().inverse() * q;
    x.push_back(static_cast<float>(p.x()));
    y.push_back(static_cast<float>(p.y()));
    z.push_back(static_cast<float>(p.z()));
  }
  const std::size_t n = x.size();
  for (std::vector<float>* v : {&x, &y, &z}) v->resize(n + kernel::kPadding);
  kernel::CountWork work;
  std::uint32_t count = 0;
  for (auto _ : state) {
    kernel::count_each(std::span(&prepared, 1), x.data(), y.data(), z.data(), n, &count, work);
    benchmark::DoNotOptimize(count);
  }
  items(state, static_cast<double>(work.field_count), "evaluation");
}
BENCHMARK_CAPTURE(field, smooth, false);
BENCHMARK_CAPTURE(field, noisy, true);

void score_pair(benchmark::State& state) {
  Searched& s = searched();
  kernel::CountWork work;
  std::size_t k = 0;
  for (auto _ : state) {
    s.workspace.genes.decode(s.chromosomes[k++ % s.chromosomes.size()], s.task.frame, s.workspace.candidate);
    benchmark::DoNotOptimize(kernel::score_pair(s.workspace.scene, s.workspace.candidate, {}, work));
  }
  items(state, static_cast<double>(work.lookup_count), "point: look-up and sibling's field");
}
BENCHMARK(score_pair);

void decode(benchmark::State& state) {
  Searched& s = searched();
  std::size_t k = 0;
  for (auto _ : state) {
    s.workspace.genes.decode(s.chromosomes[k++ % s.chromosomes.size()], s.task.frame, s.workspace.candidate);
    benchmark::DoNotOptimize(s.workspace.candidate);
  }
  items(state, static_cast<double>(k), "pair");
}
BENCHMARK(decode);

void raster(benchmark::State& state) {
  kernel::CountWork work;
  VoxelRaster out;
  for (auto _ : state)
    make_raster(grown().colony().body(CellId{150}), searched().workspace.voxels.edge_um(), out, &work);
  items(state, static_cast<double>(work.field_count), "cube");
}
BENCHMARK(raster);

void add_rows(benchmark::State& state) {
  const Params params;
  VoxelCounts voxels(params);
  const Body& body = grown().colony().body(CellId{150});
  voxels.centre_on(body.centre_um());
  VoxelRaster made;
  make_raster(body, voxels.edge_um(), made);
  double cubes = 0.0;
  for (auto _ : state) {
    voxels.add(made);
    cubes += static_cast<double>(made.nx) * made.ny * made.nz;
  }
  items(state, cubes, "cube");
}
BENCHMARK(add_rows);

void select_inside(benchmark::State& state) {
  const Body& body = grown().colony().body(CellId{150});
  OverlapScratch scratch;
  OverlapCounts counts;
  const PointSet points = testing::points(4096, 1);
  for (auto _ : state) count_overlaps(body, {}, std::nullopt, points, scratch, counts);
  items(state, static_cast<double>(scratch.work.field_count), "point");
}
BENCHMARK(select_inside);

void sum_deformed(benchmark::State& state) {
  const Colony& colony = grown().colony();
  const std::vector<const Body*> near = testing::neighbours_of(colony, CellId{150});
  OverlapScratch scratch;
  PointSet points;
  tiled_sobol(4096, {1, 2, 3}, points);
  for (auto _ : state)
    benchmark::DoNotOptimize(deformed_mass(colony.body(CellId{150}), near, ContactRule::kSum, points, scratch));
  items(state, static_cast<double>(scratch.work.field_count), "evaluation");
}
BENCHMARK(sum_deformed);

void scramble(benchmark::State& state) {
  PointSet points;
  std::uint32_t k = 0;
  for (auto _ : state) scrambled_sobol(256, {++k, 2, 3}, points);
  items(state, 256.0 * k, "point");
}
BENCHMARK(scramble);

void philox(benchmark::State& state) {
  Stream stream(1, CellId{1}, 0, Purpose::kSearch);
  double count = 0.0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(stream.next_u32());
    ++count;
  }
  items(state, count, "word");
}
BENCHMARK(philox);

void digest_of_event(benchmark::State& state) {
  const Event* divided = nullptr;
  for (const Event& event : grown().events) divided = event.kind() == EventKind::kDivided ? &event : divided;
  double count = 0.0;
  Digest digest;
  for (auto _ : state) {
    digest = digest_after(digest, *divided);
    ++count;
  }
  benchmark::DoNotOptimize(digest);
  items(state, count, "division");
}
BENCHMARK(digest_of_event);

void cells_meeting(benchmark::State& state) {
  const Colony& colony = grown().colony();
  const double reach = search_reach_um(Params());
  const Vec3 c = colony.cell(CellId{150}).nucleus_um;
  std::vector<CellId> ids;
  double count = 0.0;
  for (auto _ : state) {
    colony.cells_meeting({c - Vec3::Constant(reach), c + Vec3::Constant(reach)}, ids);
    ++count;
  }
  items(state, count, "query of the search's reach");
}
BENCHMARK(cells_meeting);

void find_space_whole(benchmark::State& state) {
  Searched& s = searched();
  std::uint32_t k = 0;
  for (auto _ : state) {
    SearchTask task = task_at(CellId{1 + k % 300});
    task.ordinal = ++k;
    benchmark::DoNotOptimize(find_space(grown().colony(), s.params, task, s.workspace));
  }
  items(state, k, "search");
}
BENCHMARK(find_space_whole);

}  // namespace
}  // namespace colony

BENCHMARK_MAIN();
