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

/// flags[i] = 1 where f~ >= 0 at point i, else 0. All bodies are relative to the origin of the points. `largest_only`: rule `max`.
void flag_deformed(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const float* x, const float* y,
                   const float* z, std::size_t n, std::uint8_t* flags, CountWork* work = nullptr);
/// The twin of one point in plain C++, noise always evaluated.
bool is_in_deformed_reference(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, float x, float y, float z);

/// The index of the point with flag 0 nearest to the origin (ties: the lowest); n if every flag is 1.
std::size_t nearest_unflagged(const float* x, const float* y, const float* z, std::size_t n, const std::uint8_t* flags);

/// An ellipsoid or, with zeros for z, an elliptic cylinder: p is covered where (p - centre)^T Q (p - centre) <= 1.
struct Cover {
  float centre[3];
  float xx, yy, zz, xy, xz, yz;
};

/// How many of the n points no cover holds.
std::uint32_t count_uncovered(std::span<const Cover> covers, const float* x, const float* y, const float* z, std::size_t n);
bool is_covered_reference(const Cover& cover, float x, float y, float z);

}  // namespace colony::kernel
