// Philox4x32-10, a block a lane. Integers: the same on every target.
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/random/philox_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/random/philox_kernel.hpp"
#include "engine/random/stream.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void philox_kernel(const std::array<std::uint32_t, 4>& counter, const std::array<std::uint32_t, 2>& key, std::uint32_t* HWY_RESTRICT out) {
  for (std::uint32_t b = 0; b < kPhiloxBlocks; ++b) {
    const std::array<std::uint32_t, 4> block = philox4x32_10({counter[0], counter[1], counter[2], counter[3] + b}, key);
    for (std::uint32_t i = 0; i < 4; ++i) out[4 * b + i] = block[i];
  }
}

#else

// A word stands in the lower half of a lane of 64 bits; the upper half is anything: no product reads it.
void philox_kernel(const std::array<std::uint32_t, 4>& counter, const std::array<std::uint32_t, 2>& key, std::uint32_t* HWY_RESTRICT out) {
  const hn::ScalableTag<std::uint64_t> d;
  const hn::Repartition<std::uint32_t, decltype(d)> words;
  const auto product = [&](auto x, std::uint32_t multiplier) { return hn::MulEven(hn::BitCast(words, x), hn::Set(words, multiplier)); };
  const auto high = [&](auto x) { return hn::ShiftRight<32>(x); };
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  HWY_ALIGN std::uint64_t last[kPhiloxBlocks];
  for (std::uint32_t b = 0; b < kPhiloxBlocks; ++b) last[b] = counter[3] + b;
  for (std::uint32_t first = 0; first < kPhiloxBlocks; first += lanes) {
    auto c0 = hn::Set(d, counter[0]);
    auto c1 = hn::Set(d, counter[1]);
    auto c2 = hn::Set(d, counter[2]);
    auto c3 = hn::Load(d, last + first);
    std::uint32_t k0 = key[0];
    std::uint32_t k1 = key[1];
    for (int round = 0; round < 10; ++round) {
      const auto p0 = product(c0, 0xD2511F53U);
      const auto p1 = product(c2, 0xCD9E8D57U);
      c0 = hn::Xor(hn::Xor(high(p1), c1), hn::Set(d, std::uint64_t{k0}));
      c2 = hn::Xor(hn::Xor(high(p0), c3), hn::Set(d, std::uint64_t{k1}));
      c1 = p1;
      c3 = p0;
      k0 += 0x9E3779B9U;
      k1 += 0xBB67AE85U;
    }
    const auto low = hn::Set(d, std::uint64_t{0xffffffffU});
    const auto words01 = hn::Or(hn::And(c0, low), hn::ShiftLeft<32>(c1));
    const auto words23 = hn::Or(hn::And(c2, low), hn::ShiftLeft<32>(c3));
    HWY_ALIGN std::uint64_t pairs[2 * HWY_MAX_BYTES / sizeof(std::uint64_t)];
    hn::StoreInterleaved2(words01, words23, d, pairs);
    for (std::uint32_t i = 0; i < 2 * lanes; ++i) {
      out[4 * first + 2 * i] = static_cast<std::uint32_t>(pairs[i]);
      out[4 * first + 2 * i + 1] = static_cast<std::uint32_t>(pairs[i] >> 32);
    }
  }
}

#endif

}  // namespace colony::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony {

HWY_EXPORT(philox_kernel);

void philox_blocks(const std::array<std::uint32_t, 4>& counter, const std::array<std::uint32_t, 2>& key, std::uint32_t* out) {
  HWY_DYNAMIC_DISPATCH(philox_kernel)(counter, key, out);
}

}  // namespace colony
#endif
