// Preparation of searches, and the plain C++ twin of the vector kernels (pair_simd.cpp).
#include "engine/space/pair_kernel.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"

namespace colony::kernel {
namespace {

void pad(std::vector<float>& values, std::size_t n) {
  if (values.size() < n + kPadding) values.resize(n + kPadding);
}

}  // namespace

void select_own_points(const FloatBody& field, float noisy_scale, const PointSet& unit_points, OwnPoints& out,
                       CountWork* work) {
  const std::size_t n = unit_points.size();
  FloatBody unit = field;
  for (int i = 0; i < 9; ++i) unit.m[i] = i % 4 == 0 ? 1.0F : 0.0F;
  for (float& shift : unit.t) shift = 0.0F;
  for (std::vector<float>* column : {&out.u, &out.v, &out.w}) pad(*column, n);
  const float width = 2.0F * noisy_scale;
  for (std::size_t i = 0; i < n; ++i) {
    out.u[i] = unit_points.x[i] * width - noisy_scale;
    out.v[i] = unit_points.y[i] * width - noisy_scale;
    out.w[i] = unit_points.z[i] * width - noisy_scale;
  }
  out.flags.resize(n + kPadding);
  flag_inside(unit, out.u.data(), out.v.data(), out.w.data(), n, out.flags.data(), work);
  std::uint32_t inside = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (out.flags[i] == 0) continue;
    out.u[inside] = out.u[i];
    out.v[inside] = out.v[i];
    out.w[inside] = out.w[i];
    ++inside;
  }
  out.stage_ends.clear();
  std::uint32_t end = 0;
  for (const std::uint32_t size : kStageSizes) out.stage_ends.push_back(end = std::min(inside, end + size));
  out.stage_ends.push_back(inside);
}

PairScore score_pair_reference(const SearchScene& scene, const std::array<CandidateBody, 2>& pair) {
  PairScore score;
  for (std::size_t k = 0; k < 2; ++k) {
    const OwnPoints& own = scene.own[k];
    const CandidateBody& body = pair[k];
    const auto coordinate = [&](int axis, std::size_t i) {
      const float* a = body.axes + 3 * axis;
      return ((a[0] * own.u[i] + a[1] * own.v[i]) + a[2] * own.w[i]) + body.centre[axis];
    };
    for (std::size_t i = 0; i < own.size(); ++i) {
      const float x = coordinate(0, i);
      const float y = coordinate(1, i);
      const float z = coordinate(2, i);
      if (!(z >= scene.dish_z)) continue;
      ++score.hits[k];
      const float wx = x - scene.wall_x;
      const float wy = y - scene.wall_y;
      if (scene.has_wall && wx * wx + wy * wy > scene.wall_radius2) score.beyond_wall = true;
      if (smooth_reference(pair[1 - k].field, x, y, z) >= 0.0F) {
        ++score.sibling[k];
        ++score.shared[k];
      }
      const auto cube = [&](float p, int axis) {
        return ((p * scene.voxels_per_um + scene.voxel_shift[axis]) + 12582912.0F) - 12582912.0F;
      };
      score.shared[k] += scene.counts[static_cast<std::size_t>((cube(z, 2) * scene.voxels_x + cube(y, 1)) * scene.voxels_x + cube(x, 0))];
    }
  }
  return score;
}

}  // namespace colony::kernel
