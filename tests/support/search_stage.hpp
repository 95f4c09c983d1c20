// search_stage: what a search prepares before it scores candidates, laid open: voxels, points, the scene of the kernel.
// voxel_test.cpp holds it against what find_space itself prepares, so the two cannot drift apart.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "engine/growth/candidate.hpp"
#include "engine/space/pair_kernel.hpp"
#include "engine/space/voxels.hpp"
#include "tests/support/bodies.hpp"

namespace colony::testing {

struct SearchStage {
  Params params;
  PairFrame frame;
  GeneTables genes;
  VoxelCounts voxels;
  kernel::SearchScene scene;
  std::array<kernel::CandidateBody, 2> pair;

  explicit SearchStage(const Params& for_params) : params(for_params), genes(params), voxels(params) {}

  /// Empty voxels about the frame's pivot; own points from `unit_points`.
  void open(const PairFrame& for_frame, const PointSet& unit_points, std::optional<double> wall_radius_um) {
    frame = for_frame;
    const Vec3& c = frame.pivot_um;
    voxels.centre_on(c);
    scene.counts = voxels.counts();
    scene.voxels_x = static_cast<float>(voxels.nx());
    scene.empty_cube = static_cast<float>(voxels.empty_cube());
    scene.voxels_per_um = static_cast<float>(1.0 / voxels.edge_um());
    const Vec3 shift = (c - voxels.corner_um()) / voxels.edge_um() - Vec3(0.5, 0.5, 0.5 - kVoxelLift);
    for (int i = 0; i < 3; ++i) scene.voxel_shift[i] = static_cast<float>(shift[i]);
    scene.dish_z = static_cast<float>(-c.z());
    scene.has_wall = wall_radius_um.has_value();
    scene.wall_x = static_cast<float>(-c.x());
    scene.wall_y = static_cast<float>(-c.y());
    scene.wall_radius2 = wall_radius_um ? static_cast<float>(*wall_radius_um * *wall_radius_um) : 0.0F;
    for (std::size_t k = 0; k < 2; ++k) {
      const Body noise_of({Vec3::Zero(), Vec3::Ones(), Vec3::Zero(), frame.noise_offsets[k]}, params.noise);
      pair[k].field = kernel::FloatBody(noise_of, Vec3::Zero());
      kernel::select_own_points(pair[k].field, static_cast<float>(noise_of.noisy_scale()), unit_points, scene.own[k]);
    }
  }

  void add(const Body& body) {
    VoxelRaster raster;
    make_raster(body, voxels.edge_um(), raster);
    voxels.add(raster);
  }

  const std::array<kernel::CandidateBody, 2>& place(const Chromosome& chromosome) {
    genes.decode(chromosome, frame, pair);
    return pair;
  }
};

/// A pivot anywhere on a large dish, as high as a nucleus may stand; any direction the layers allow; any noise.
inline PairFrame any_frame(const Params& params, Stream& stream, double spread_um = 1e4) {
  PairFrame frame;
  const double z = stream.uniform({0.1, 0.5 * body_top_max_um(params)});
  const double x = stream.uniform({-spread_um, spread_um});
  frame.pivot_um = Vec3(x, stream.uniform({-spread_um, spread_um}), z);
  if (params.layers == Layers::kMulti) {
    frame.direction = unit_vector(stream);
  } else {
    const auto [s, c] = maths::sincos(2.0 * maths::kPi * stream.uniform());
    frame.direction = Vec3(c, s, 0.0);
  }
  for (Vec3& offset : frame.noise_offsets) {
    for (int i = 0; i < 3; ++i) offset[i] = noise_period(params.noise) * stream.uniform();
  }
  return frame;
}

}  // namespace colony::testing
