// philox_kernel: several blocks of Philox4x32-10 at once. Integers: the same on every target.
// Threads: pure.
#pragma once

#include <array>
#include <cstdint>

namespace colony {

inline constexpr std::uint32_t kPhiloxBlocks = 16;

/// out[4 b .. 4 b + 3] = the block of `counter` with b added to its last word, which must not overflow.
void philox_blocks(const std::array<std::uint32_t, 4>& counter, const std::array<std::uint32_t, 2>& key, std::uint32_t* out);

}  // namespace colony
