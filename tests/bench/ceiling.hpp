// ceiling: what the machine can do: separate multiplications and additions on vectors, nothing else, in the same binary
// and for the same vector targets as the kernels that are held against it.
#pragma once

#include <cstddef>

namespace colony::bench {

/// `rounds` times 16 operations (8 multiplications, 8 additions, in 8 independent chains) on every lane of one vector;
/// returns how many lanes. The result is kept alive in `sink`.
std::size_t multiply_add(std::size_t rounds, float* sink);

/// Operations of one evaluation a point (field_inl.hpp, counted by hand): three rows of 6 and the squares, 6; with
/// noise six sines of 15, their arguments, 18, and the product, 11, more.
inline constexpr double kSmoothOperations = 24.0;
inline constexpr double kNoisyOperations = 24.0 + 119.0;

}  // namespace colony::bench
