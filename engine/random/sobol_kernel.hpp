// sobol_kernel: the vectors behind scrambled_sobol.
// Shapes:  arrays of n, readable and writable kScramblePadding beyond their n.
// Threads: pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace colony {

inline constexpr std::size_t kScramblePadding = 64;   // as the kernels that read point sets ask (space/overlap_kernel.hpp)

/// Multipliers of Laine and Karras' hash as given by Burley 2020.
inline constexpr std::array<std::uint32_t, 4> kLaineKarras = {0x6c50b47cU, 0xb82f1e52U, 0xc7afe638U, 0x8d22f6e6U};

/// out[i] = the scrambled fraction, 24 bits, of a Sobol number whose 32 bits are reversed[i] in reversed order.
void scramble_column(const std::uint32_t* reversed, std::size_t n, std::uint32_t seed, float* out);

}  // namespace colony
