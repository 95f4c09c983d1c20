// The scrambling of point sets, in vectors. Integers but for an exact conversion: the same on every target.
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/random/sobol_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/random/sobol_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void scramble_kernel(const std::uint32_t* HWY_RESTRICT reversed, std::size_t n, std::uint32_t seed, float* HWY_RESTRICT out) {
  const hn::ScalableTag<std::uint32_t> d;
  const hn::Rebind<float, decltype(d)> floats;
  const hn::Rebind<std::int32_t, decltype(d)> integers;
  const auto constant = [&](std::uint32_t value) { return hn::Set(d, value); };
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < n; i += lanes) {
    auto x = hn::LoadU(d, reversed + i);
    x = hn::Add(x, constant(seed));
    x = hn::Xor(x, hn::Mul(x, constant(kLaineKarras[0])));
    x = hn::Xor(x, hn::Mul(x, constant(kLaineKarras[1])));
    x = hn::Xor(x, hn::Mul(x, constant(kLaineKarras[2])));
    x = hn::Xor(x, hn::Mul(x, constant(kLaineKarras[3])));
    const auto swap = [&](auto value, auto right, auto left, std::uint32_t mask) {
      return hn::Or(hn::And(right(value), constant(mask)), left(hn::And(value, constant(mask))));
    };
    x = swap(x, [](auto v) { return hn::ShiftRight<1>(v); }, [](auto v) { return hn::ShiftLeft<1>(v); }, 0x55555555U);
    x = swap(x, [](auto v) { return hn::ShiftRight<2>(v); }, [](auto v) { return hn::ShiftLeft<2>(v); }, 0x33333333U);
    x = swap(x, [](auto v) { return hn::ShiftRight<4>(v); }, [](auto v) { return hn::ShiftLeft<4>(v); }, 0x0f0f0f0fU);
    x = swap(x, [](auto v) { return hn::ShiftRight<8>(v); }, [](auto v) { return hn::ShiftLeft<8>(v); }, 0x00ff00ffU);
    x = hn::Or(hn::ShiftRight<16>(x), hn::ShiftLeft<16>(x));
    // 24 bits: exact, below 1.
    const auto fraction = hn::ConvertTo(floats, hn::BitCast(integers, hn::ShiftRight<8>(x)));
    hn::StoreU(hn::Mul(fraction, hn::Set(floats, 0x1.0p-24F)), floats, out + i);
  }
}

}  // namespace colony::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony {

HWY_EXPORT(scramble_kernel);

void scramble_column(const std::uint32_t* reversed, std::size_t n, std::uint32_t seed, float* out) {
  HWY_DYNAMIC_DISPATCH(scramble_kernel)(reversed, n, seed, out);
}

}  // namespace colony
#endif
