// sobol: low-discrepancy points for volumes and for the comparison search.
// Method:  Sobol's LP-tau sequence with Joe and Kuo's direction numbers, the origin included; hashed Owen scrambling.
// Units:   [0, 1), 32 bits a coordinate.
// Shapes:  n a power of two in [1, 65536] for point sets; dimension 1..kSobolDimensions.
// Errors:  CHECKs n and dimension.        Threads: pure.
// Source:  Joe & Kuo 2008 (new-joe-kuo-6.21201); Burley 2020, "Practical hash-based Owen scrambling", with Laine-Karras' hash.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/types.hpp"
#include "engine/random/stream.hpp"

namespace colony {

inline constexpr int kSobolDimensions = 21;
inline constexpr std::uint32_t kSobolPointsMax = 65536;   // of a point set

/// Coordinate `dimension` (from 0) of point `index` (from 0, the origin), as a 32-bit fraction. Not scrambled, not Gray-coded:
/// the first 2^m points are the same set in either order.
std::uint32_t sobol_u32(std::uint32_t index, int dimension);

/// Owen's nested uniform scrambling of a 32-bit fraction, addressed by `seed`.
std::uint32_t owen_scramble(std::uint32_t value, std::uint32_t seed);

/// n points of the unit cube as three arrays, scrambled by three seeds; single precision (24 bits), each in [0, 1).
/// Single precision because that is what the overlap kernel works in.
struct PointSet {
  std::vector<float> x, y, z;    // longer than `count`: kernels read and write whole vectors
  std::size_t count = 0;
  std::size_t size() const { return count; }
};

/// Unscrambled in 32 bits, computed once for the largest n and shared; scrambled into `out`.
void scrambled_sobol(std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out);

/// The same points tile by tile: each run of 16 holds the points of one elementary interval of x and y, so that they lie close together
/// in the unit cube, scrambled or not, and a vector of them is mostly of one opinion about a body.
void tiled_sobol(std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out);
/// Their x and y alone; z is 0.
void tiled_sobol_plane(std::uint32_t n, const std::array<std::uint32_t, 3>& seeds, PointSet& out);

/// The same with the next three words of `stream` as seeds.
PointSet scrambled_sobol(std::uint32_t n, Stream& stream);

}  // namespace colony
