#include "engine/random/stream.hpp"

#include <algorithm>
#include <cmath>

#include <Random123/philox.h>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"
#include "engine/random/philox_kernel.hpp"

namespace colony {

std::array<std::uint32_t, 4> philox4x32_10(const std::array<std::uint32_t, 4>& counter,
                                           const std::array<std::uint32_t, 2>& key) {
  const r123::Philox4x32::ctr_type c = {{counter[0], counter[1], counter[2], counter[3]}};
  const r123::Philox4x32::key_type k = {{key[0], key[1]}};
  const r123::Philox4x32::ctr_type out = r123::Philox4x32()(c, k);
  return {out.v[0], out.v[1], out.v[2], out.v[3]};
}

Stream::Stream(Seed seed, CellId cell, std::uint32_t ordinal, Purpose purpose, std::uint32_t lane)
    : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
      counter_{cell.value, ordinal, (static_cast<std::uint32_t>(purpose) << 24) | lane, 0} {
  CHECK(seed <= kSeedMax);
  CHECK(lane < (1U << 24));
}

void Stream::refill() {
  // Most streams give a few words. Those that go on, a search's, use hundreds.
  const std::uint32_t blocks = held_ == 0 ? 1 : kPhiloxBlocks;
  CHECK(counter_[3] < 0xffffffffU - blocks);
  if (blocks == 1) {
    const std::array<std::uint32_t, 4> block = philox4x32_10(counter_, key_);
    std::copy(block.begin(), block.end(), words_.begin());
  } else {
    philox_blocks(counter_, key_, words_.data());
  }
  counter_[3] += blocks;
  used_ = 0;
  held_ = static_cast<int>(4 * blocks);
}

double Stream::uniform(const Interval& interval) { return interval.low + (interval.high - interval.low) * uniform(); }

std::uint64_t Stream::below_rarely(std::uint32_t n, std::uint64_t product) {
  CHECK(n >= 1);
  const std::uint32_t threshold = (0U - n) % n;
  while (static_cast<std::uint32_t>(product) < threshold) product = static_cast<std::uint64_t>(next_u32()) * n;
  return product;
}

double Stream::normal() {
  const double radius = std::sqrt(-2.0 * maths::log(1.0 - uniform()));  // 1 - u is never 0
  return radius * maths::sincos(2.0 * maths::kPi * uniform()).cos;
}

}  // namespace colony
