#include "tests/bench/scenes.hpp"

#include <array>

namespace colony::bench {
namespace {

std::optional<RunSpec> spec_of(std::string_view preset_name, Seed seed, std::uint64_t cells) {
  std::optional<Params> params = preset(preset_name);
  if (!params) return std::nullopt;
  RunSpec spec;
  spec.seed = seed;
  spec.params = *params;
  spec.until.cells = cells;
  return spec;
}

std::optional<RunSpec> unlimited(std::uint64_t cells) {
  std::optional<RunSpec> spec = spec_of("paper", 1, cells);
  spec->params.division.generation_limit.reset();
  return spec;
}

// A dish is closed when nobody can divide any more: one cell to 107 um2 of it, 87 % of the plane under cells (100
// founders in a dish of 757 um: 16,715 cells after 420 h, 1.1 % active). The scenes end a little before that, at 115
// um2 a cell, where 3 % are active: the time grows beyond measure when the last gaps are waited for. Founders stand
// over the whole dish but for 50 um at the wall. A million cells want a radius of 6.05 mm.
std::optional<RunSpec> dish() {
  std::optional<RunSpec> spec = spec_of("paper", 1, 1'000'000);
  spec->params.founders.count = 5'000;
  spec->params.founders.radius_um = 6'000.0;
  spec->params.dish.radius_um = 6'050.0;
  return spec;
}

constexpr std::array<Scene, 9> kScenes = {{
    {"paper-180", "preset paper, seed 1, to 180 cells", [] { return spec_of("paper", 1, 180); }},
    {"paper-1k", "preset paper, seed 3 (many colonies end just below), to 1,000 cells",
     [] { return spec_of("paper", 3, 1'000); }},
    {"young-colony", "preset young-colony, seed 1, to 5,000 cells, no generation limit",
     [] {
       std::optional<RunSpec> spec = spec_of("young-colony", 1, 5'000);
       spec->params.division.generation_limit.reset();
       return spec;
     }},
    {"paper-10k", "preset paper, seed 1, no generation limit, to 10,000 cells", [] { return unlimited(10'000); }},
    {"tumour-20k", "preset tumour, seed 1, to 20,000 cells", [] { return spec_of("tumour", 1, 20'000); }},
    {"dish-20k", "dish-1m at a fiftieth of its area: 100 founders",
     [] {
       std::optional<RunSpec> spec = dish();
       spec->params.founders.count /= 50;
       spec->params.founders.radius_um = 805.0;
       spec->params.dish.radius_um = 855.0;
       spec->until.cells = 20'000;
       return spec;
     }},
    {"dish-100k", "dish-1m at a tenth of its area: 500 founders; too many cells for what is kept of neighbours",
     [] {
       std::optional<RunSpec> spec = dish();
       spec->params.founders.count /= 10;
       spec->params.founders.radius_um = 1'863.0;
       spec->params.dish.radius_um = 1'913.0;
       spec->until.cells = 100'000;
       return spec;
     }},
    {"paper-100k", "preset paper, seed 1, no generation limit, to 100,000 cells", [] { return unlimited(100'000); }},
    {"dish-1m", "preset paper, seed 1, 5,000 founders in a dish that becomes confluent, to 1,000,000 cells", dish},
}};

}  // namespace

std::span<const Scene> scenes() { return kScenes; }

}  // namespace colony::bench
