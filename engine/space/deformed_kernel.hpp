// deformed_kernel: where the deformed body f~ = f - sum max(0, f_j) (or less the largest) is not negative, and which points no body covers.
// Method:  single precision relative to an origin near the points; noise only where it can decide.
// Why the same bits everywhere: as overlap_kernel.hpp; the sum over neighbours runs in their order for every point.
// Shapes:  arrays of n, readable (finite values) kPadding beyond n.
// Threads: pure but for the caller's CountWork.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/space/overlap_kernel.hpp"

namespace colony::kernel {

struct PointColumns {
  const float* x;
  const float* y;
  const float* z;
};
struct DeformedSums {
  std::uint32_t count = 0;               // points where f~ >= 0
  double sum[3] = {0.0, 0.0, 0.0};       // over those, of what was to be summed
};

/// How many of n points have f~ >= 0, and the sums over those of `summed`: multiples of 2^-24 in [0, 1), so that the sums are exact. All bodies are
/// relative to the origin of the points. `largest_only`: rule `max`.
DeformedSums sum_deformed(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const PointColumns& points,
                          const PointColumns& summed, std::size_t n, CountWork* work = nullptr);
/// The twin of one point in plain C++, noise always evaluated.
bool is_in_deformed_reference(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, float x, float y, float z);

/// The index of the point nearest to the origin where f~ < 0 (ties: the lowest); n if there is none. Points further away than one already found
/// are not asked.
std::size_t nearest_outside(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const PointColumns& points, std::size_t n,
                            CountWork* work = nullptr);

/// An ellipsoid or, with zeros for z, an elliptic cylinder: p is covered where (p - centre)^T Q (p - centre) <= 1.
struct Cover {
  float centre[3];
  float xx, yy, zz, xy, xz, yz;
};

/// Maps points of the unit cube on the cube of half edge `radius` about the origin and keeps those in its ball at or above `low_z`, in their order;
/// returns how many. (z constant at 1/2: the disc of the square.)
std::size_t keep_in_ball(float radius, float low_z, float* x, float* y, float* z, std::size_t n);

/// How many of the n points no cover holds.
std::uint32_t count_uncovered(std::span<const Cover> covers, const float* x, const float* y, const float* z, std::size_t n);
bool is_covered_reference(const Cover& cover, float x, float y, float z);

}  // namespace colony::kernel
