// pair_kernel: how much of a candidate pair's two bodies lies inside their neighbours: what the search for free space spends its time on.
// Method:  points are given once a search in the unit frame of each body (u, v, w), where the body's own field, noise included, is
//          the same for every candidate: only the points inside it are kept. A candidate maps them to the dish by its affine frame;
//          those below the dish drop out; the rest ask the voxels how many neighbours cover them, and the sibling's noise-free field whether
//          it does: its noise moves a point in or out as often as not, and leaving it out loses nothing (engine/DESIGN.md); the winner is
//          scored with it.
//          Scoring goes through the points in stages and gives up once too many are shared (ShareLimit).
// Units:   um relative to the search's origin, single precision.
// Why the same bits everywhere: as overlap_kernel.hpp: + - * and compares in a fixed order per point; integers leave the kernel.
// Threads: pure but for what they add to the caller's CountWork.
// Source:  the paper, 4.1 and 4.3; the common points of all candidates and the voxels are ours (engine/DESIGN.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/random/sobol.hpp"
#include "engine/space/overlap_kernel.hpp"

namespace colony::kernel {

/// Points of the unit frame inside the noisy body, in the order of the Sobol sequence: each stage is a fair sample. Stage k ends before
/// stage_ends[k].
struct OwnPoints {
  std::vector<float> u, v, w;           // padded by kPadding
  std::vector<std::uint32_t> stage_ends;
  std::vector<std::uint8_t> flags;      // scratch of select_own_points
  std::size_t size() const { return stage_ends.empty() ? 0 : stage_ends.back(); }
};

/// Sizes of the stages but the last, which takes what is left. Multiples of 16, the most lanes of any target.
inline constexpr std::array<std::uint32_t, 2> kStageSizes = {32, 32};

/// A candidate body: p = axes (u, v, w) + centre.
struct CandidateBody {
  float axes[9];                        // row-major
  float centre[3];
  float reach;                          // no point of it is further from the origin in the plane
  FloatBody field;                      // the same body as its sibling's neighbour
};

/// What is fixed while a generation is scored.
struct SearchScene {
  std::array<OwnPoints, 2> own;
  float dish_z = 0.0F;                       // the plane z = 0
  bool has_wall = false;
  float wall_x = 0.0F, wall_y = 0.0F;        // the dish's centre
  float wall_radius2 = 0.0F;
  const std::uint8_t* counts = nullptr;      // of covering neighbours: VoxelCounts
  float voxels_x = 0.0F;                     // cubes along x and along y; a whole number
  float empty_cube = 0.0F;                   // index of a count that is always 0
  float voxels_per_um = 0.0F;
  float voxel_shift[3] = {0.0F, 0.0F, 0.0F}; // p voxels_per_um + voxel_shift, rounded to nearest, is the cube of p
};

struct PairScore {
  std::array<std::uint32_t, 2> hits = {0, 0};     // points of the body above the dish, as far as they were looked at
  std::array<std::uint32_t, 2> shared = {0, 0};   // of those, summed over the neighbours that hold them, the sibling included
  std::array<std::uint32_t, 2> sibling = {0, 0};  // of those, inside the sibling
  bool dropped = false;                           // given up: the counts are those of a prefix
  bool beyond_wall = false;                       // a hit lies beyond the dish's wall
};

/// most_shared[h]: a body with more than this many shared among its first h hits is given up. Empty: nobody is.
using ShareLimit = std::span<const std::uint32_t>;

PairScore score_pair(const SearchScene& scene, const std::array<CandidateBody, 2>& pair, ShareLimit most_shared, CountWork& work);

/// The twin: every point on its own, nobody given up. The same counts to the last bit.
PairScore score_pair_reference(const SearchScene& scene, const std::array<CandidateBody, 2>& pair);

/// Fills flags[0..n) with 1 where the point is inside `body`, else 0.
void flag_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, std::uint8_t* flags,
                 CountWork* work = nullptr);

/// The points of `unit_points` (in [0, 1)^3, mapped on the cube of half edge `noisy_scale`) inside a body with this noise, in stages.
/// `field`: any body with that noise; only its noise is read.
void select_own_points(const FloatBody& field, float noisy_scale, const PointSet& unit_points, OwnPoints& out,
                       CountWork* work = nullptr);

}  // namespace colony::kernel
