// What deciding takes from the heap, counted: nothing in a search, and around it only what looking at sleepers takes.
// Method:  the program's own operator new and delete count; everything is decided once before, so that buffers have their sizes.
//          Sanitizers see these as any other program's (they end in malloc).
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "engine/growth/surroundings.hpp"
#include "engine/sim/decide.hpp"
#include "engine/sim/decide_move.hpp"
#include "tests/support/runs.hpp"

namespace {

std::uint64_t allocation_count = 0;  // one thread

void* counted(std::size_t bytes, std::size_t alignment) {
  ++allocation_count;
  // aligned_alloc wants a multiple of the alignment.
  void* const at = alignment <= alignof(std::max_align_t) ? std::malloc(bytes > 0 ? bytes : 1)
                                                          : std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (at == nullptr) throw std::bad_alloc();
  return at;
}

}  // namespace

// The other forms of the standard library call these. Not inlined: GCC 12 would see free() of what an operator new that it did not inline gave.
[[gnu::noinline]] void* operator new(std::size_t bytes) { return counted(bytes, 1); }
[[gnu::noinline]] void* operator new[](std::size_t bytes) { return counted(bytes, 1); }
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment) { return counted(bytes, static_cast<std::size_t>(alignment)); }
[[gnu::noinline]] void* operator new[](std::size_t bytes, std::align_val_t alignment) { return counted(bytes, static_cast<std::size_t>(alignment)); }
[[gnu::noinline]] void operator delete(void* at) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete[](void* at) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete(void* at, std::size_t) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete[](void* at, std::size_t) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete(void* at, std::align_val_t) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete[](void* at, std::align_val_t) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete(void* at, std::size_t, std::align_val_t) noexcept { std::free(at); }
[[gnu::noinline]] void operator delete[](void* at, std::size_t, std::align_val_t) noexcept { std::free(at); }

namespace colony {
namespace {

constexpr Seed kSeed = 5;

template <class Function>
std::uint64_t allocations_of(const Function& function) {
  const std::uint64_t before = allocation_count;
  function();
  return allocation_count - before;
}

struct alignas(64) Wide {
  int a = 0;
};
std::vector<std::vector<Wide>> kept;  // seen from everywhere: what it allocates, a compiler may not leave out

// The counter must be alive: what is known to allocate does.
TEST(Allocation, IsCounted) {
  EXPECT_EQ(allocations_of([] { kept.emplace_back(3); }), 2U);  // the list, and three over-aligned elements
  EXPECT_EQ(allocations_of([] {}), 0U);
  const Colony colony = testing::run(testing::spec_of(3, 20)).colony();
  Workspace fresh((Params()));
  EXPECT_GT(allocations_of([&] { decide_division(colony, Params(), kSeed, CellId{1}, 0.0, fresh); }), 20U);
}

// Colonies as they grow, with cells inside, at the rim and, in the dish, at the wall.
struct Scene {
  std::string name;
  Params params;
  Colony colony;
};

std::vector<Scene> scenes() {
  std::vector<Scene> all;
  const auto add = [&](const std::string& name, const Params& params, std::uint64_t cells) {
    all.push_back({name, params, testing::run(testing::spec_of(3, cells, params)).colony()});
    for (const Cell& cell : all.back().colony.cells()) ASSERT_TRUE(cell.nearest_membrane_um || cell.settle_due_h);
  };
  Params dish;
  dish.founders.count = 8;
  dish.founders.radius_um = 40.0;
  dish.dish.radius_um = 55.0;
  add("paper", Params(), 120);
  add("young-colony", *preset("young-colony"), 80);
  add("tumour", *preset("tumour"), 120);
  add("dish", dish, 60);
  return all;
}

std::vector<CellId> settled_cells(const Colony& colony) {
  std::vector<CellId> ids;
  for (const Cell& cell : colony.cells()) {
    if (cell.nearest_membrane_um) ids.push_back(cell.id);
  }
  return ids;
}

// Searches of every cell, whatever becomes of them, of sizes far apart: any allocation for a candidate, a point or a generation shows.
TEST(Allocation, ASearchTakesNothingWhateverItsSize) {
  const std::vector<std::pair<const char*, SearchParams>> sizes = [] {
    std::vector<std::pair<const char*, SearchParams>> all;
    SearchParams s;
    all.push_back({"default", s});
    s.give_up_margin = std::nullopt;
    all.push_back({"never given up", s});
    s.generations = 40;
    s.corrector_generations = 20;
    all.push_back({"four times the generations", s});
    s = {};
    s.population = 100;
    all.push_back({"three times the population", s});
    s = {};
    s.points = 2048;
    s.points_final = 16'384;
    all.push_back({"eight times the points", s});
    s = {};
    s.selection = Selection::kRoulette;
    s.coding = Coding::kBinary;
    all.push_back({"roulette, binary", s});
    s.optimiser = Optimiser::kSobol;
    all.push_back({"Sobol", s});
    s.optimiser = Optimiser::kRandom;
    all.push_back({"random", s});
    return all;
  }();
  for (const Scene& scene : scenes()) {
    for (const auto& [name, search] : sizes) {
      SCOPED_TRACE(scene.name + ", " + name);
      Params params = scene.params;
      params.search = search;
      ASSERT_TRUE(validate(params).empty());
      Workspace workspace(params);
      std::uint64_t candidates = 0, warming = 0, taken = 0;
      for (const bool warm : {false, true}) {
        for (const CellId id : settled_cells(scene.colony)) {
          const std::uint64_t before = allocation_count;
          const SearchTask task = search_task(scene.colony, params, kSeed, id, workspace);
          candidates += find_space(scene.colony, params, task, workspace).evaluation_count;
          (warm ? taken : warming) += allocation_count - before;
        }
      }
      EXPECT_EQ(taken, 0U);
      EXPECT_GT(warming, 0U);
      EXPECT_GT(candidates, 2'000U);
    }
  }
}

// Around the search: a failure asks once what is free about the cell, a division asks it of the sleepers it may wake. Exactly those take
// memory, a handful of times.
TEST(Allocation, ADivisionAttemptTakesWhatLookingAtSleepersTakes) {
  for (const Scene& scene : scenes()) {
    const Params& params = scene.params;
    const Colony& colony = scene.colony;
    Workspace workspace(params);
    std::uint64_t divided = 0, inhibited = 0, most = 0;
    for (const bool warm : {false, true}) {
      for (const CellId id : settled_cells(colony)) {
        Decision decision;
        const std::uint64_t taken = allocations_of([&] { decision = decide_division(colony, params, kSeed, id, 1000.0, workspace); });
        if (!warm) continue;
        std::uint64_t expected = 0;
        if (const auto* event = std::get_if<Divided>(&decision.body)) {
          ++divided;
          const std::array<Body, 2> bodies = {Body(geometry_of(event->cells[0]), params.noise), Body(geometry_of(event->cells[1]), params.noise)};
          expected = allocations_of([&] { wake_sleepers(colony, params, kSeed, 1000.0, {id, bodies}); });
        } else if (std::holds_alternative<Inhibited>(decision.body)) {
          ++inhibited;
          const Cell& cell = colony.cell(id);
          expected = allocations_of([&] { free_share(colony, params, kSeed, cell, cell.ordinal + 1, {}); });
        }
        EXPECT_EQ(taken, expected) << scene.name << ", cell " << id.value;
        most = std::max(most, taken);
      }
    }
    std::printf("figure: allocations, %s: %llu divisions, %llu failures, at most %llu an attempt\n", scene.name.c_str(),
                static_cast<unsigned long long>(divided), static_cast<unsigned long long>(inhibited), static_cast<unsigned long long>(most));
    EXPECT_GT(divided, 3U) << scene.name;
    EXPECT_GT(inhibited, 3U) << scene.name;
    EXPECT_LE(most, 40U) << scene.name;
  }
}

TEST(Allocation, SettlingTakesNothing) {
  for (const Scene& scene : scenes()) {
    Workspace workspace(scene.params);
    std::uint64_t taken = 0;
    for (const bool warm : {false, true}) {
      for (const Cell& cell : scene.colony.cells()) {
        const std::uint64_t count = allocations_of([&] { decide_settling(scene.colony, scene.params, kSeed, cell.id, workspace); });
        if (warm) taken += count;
      }
    }
    EXPECT_EQ(taken, 0U) << scene.name;
  }
}

// A move judges its place without memory. What it takes: its direction if it is guided (the bodies about, 256 points), and the sleepers.
TEST(Allocation, AMoveTakesAHandfulWhateverItsPoints) {
  const Scene scene = scenes()[1];
  ASSERT_GT(scene.params.motility.rate_per_h, 0.0);
  for (const double bias : {0.0, 1.0}) {
    std::vector<std::vector<std::uint64_t>> taken_with;
    std::uint64_t most = 0;
    int made = 0;
    for (const int points_final : {4096, 32'768}) {
      Params params = scene.params;
      params.motility.bias = bias;
      params.search.points_final = points_final;
      ASSERT_TRUE(validate(params).empty());
      Workspace workspace(params);
      std::vector<std::uint64_t>& taken = taken_with.emplace_back();
      for (const bool warm : {false, true}) {
        for (const Cell& cell : scene.colony.cells()) {
          Decision decision;
          const std::uint64_t count = allocations_of([&] { decision = decide_move(scene.colony, params, kSeed, cell.id, 1000.0, workspace); });
          if (!warm) continue;
          const auto& event = std::get<Moved>(decision.body);
          const bool moved = event.cell.centre_um != cell.centre_um;
          made += moved ? 1 : 0;
          most = std::max(most, count);
          taken.push_back(count);
          const bool asleep = cell.activity == Activity::kPassive && !cell.due_h;
          if (bias == 0.0 && !moved && !asleep) {
            EXPECT_EQ(count, 0U) << cell.id.value;
          }
        }
      }
    }
    std::printf("figure: allocations, moves with bias %.0f: %d made, at most %llu each\n", bias, made, static_cast<unsigned long long>(most));
    EXPECT_GT(made, 10);
    EXPECT_LE(most, 80U);
    int differ = 0;  // a place that one sample finds just free and the other not
    for (std::size_t i = 0; i < taken_with[0].size(); ++i) differ += taken_with[0][i] != taken_with[1][i] ? 1 : 0;
    EXPECT_LE(differ, 3);
  }
}

}  // namespace
}  // namespace colony
