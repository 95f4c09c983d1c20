#include "engine/growth/workspace.hpp"

#include <algorithm>

namespace colony {

Workspace::Workspace(const Params& params, int thread_count) : threads(thread_count), genes(params), voxels(params), rasters(voxels.edge_um()) {
  const int bits = static_cast<int>(params.search.bits);
  const int gene_count = gene_count_of(params.layers);
  const int length = gene_count * bits;
  mutation = BitFlips(length, params.search.mutation_rate.value_or(1.0 / length));
  const int low_length = gene_count * std::min(kCorrectorLowBits, bits);
  correction = BitFlips(low_length, 1.0 / low_length);
}

}  // namespace colony
