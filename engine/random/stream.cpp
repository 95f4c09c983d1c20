#include "engine/random/stream.hpp"

#include <cmath>

#include <Random123/philox.h>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

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

std::uint32_t Stream::next_u32() {
  if (used_ == 4) {
    block_ = philox4x32_10(counter_, key_);
    ++counter_[3];
    CHECK(counter_[3] != 0);
    used_ = 0;
  }
  return block_[static_cast<std::size_t>(used_++)];
}

std::uint64_t Stream::next_u64() {
  const std::uint64_t low = next_u32();
  return low | (static_cast<std::uint64_t>(next_u32()) << 32);
}

double Stream::uniform() { return static_cast<double>(next_u64() >> 11) * 0x1.0p-53; }

double Stream::uniform(const Interval& interval) { return interval.low + (interval.high - interval.low) * uniform(); }

std::uint32_t Stream::below(std::uint32_t n) {
  CHECK(n >= 1);
  // Lemire's multiply-and-reject: values of `low` under (2^32 mod n) would make some results likelier than others.
  const std::uint32_t threshold = (0U - n) % n;
  for (;;) {
    const std::uint64_t product = static_cast<std::uint64_t>(next_u32()) * n;
    if (static_cast<std::uint32_t>(product) >= threshold) return static_cast<std::uint32_t>(product >> 32);
  }
}

double Stream::normal() {
  const double radius = std::sqrt(-2.0 * maths::log(1.0 - uniform()));  // 1 - u is never 0
  return radius * maths::sincos(2.0 * maths::kPi * uniform()).cos;
}

}  // namespace colony
