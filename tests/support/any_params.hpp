// any_params: parameters of the model from the whole of their ranges, the ends among them.
#pragma once

#include <algorithm>

#include "engine/growth/chromosome.hpp"
#include "engine/model/params.hpp"
#include "engine/random/stream.hpp"

namespace colony::testing {

/// Cell, noise and search parameters as validation allows them (but for the nucleus, which is of no meaning to a search).
inline Params any_params(Stream& stream) {
  const auto pick = [&](double low, double high) {
    const std::uint32_t which = stream.below(4);
    return which == 0 ? low : which == 1 ? high : stream.uniform({low, high});
  };
  const auto interval = [&](double low, double high) {
    const double a = pick(low, high);
    const double b = pick(low, high);
    return Interval{std::min(a, b), std::max(a, b)};
  };
  Params p;
  p.cell.pair_volume_um3 = interval(50, 100'000);
  p.cell.smaller_share = interval(0.2, 0.5);
  p.cell.elongation = interval(1, 3);
  p.cell.flatness = interval(0.2, 1);
  p.noise = {pick(0, 0.40), pick(2, 8), pick(0, 6.28)};
  p.search.coding = stream.below(2) == 0 ? Coding::kGray : Coding::kBinary;
  p.search.bits = 4 + stream.below(13);
  p.search.turn_max_deg = pick(0, 90);
  p.search.distance = interval(0.3, 1.5);
  p.search.sideways = pick(0, 0.5);
  p.search.tilt_max_deg = pick(0, 20);
  return p;
}

/// Random, with about half of the genes at an end of their range.
inline Chromosome any_chromosome(const Params& params, Stream& stream) {
  Chromosome chromosome = random_chromosome(gene_count_of(params.layers), static_cast<int>(params.search.bits), stream);
  for (int gene = 0; gene < chromosome.gene_count(); ++gene) {
    const std::uint32_t which = stream.below(4);
    if (which < 2) chromosome.set_code(gene, code_of(which, chromosome.bits(), params.search.coding));
  }
  return chromosome;
}

}  // namespace colony::testing
