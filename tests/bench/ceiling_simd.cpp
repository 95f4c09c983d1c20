#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/ceiling_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "tests/bench/ceiling.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t multiply_add_kernel(std::size_t rounds, float* sink) {
  const hn::ScalableTag<float> d;
  const auto factor = hn::Set(d, sink[0]);  // read, so that the compiler cannot know it
  const auto summand = hn::Set(d, sink[1]);
  auto a = factor, b = summand, c = factor, e = summand, f = factor, g = summand, h = factor, i = summand;
  for (std::size_t k = 0; k < rounds; ++k) {
    a = hn::Add(hn::Mul(a, factor), summand);
    b = hn::Add(hn::Mul(b, factor), summand);
    c = hn::Add(hn::Mul(c, factor), summand);
    e = hn::Add(hn::Mul(e, factor), summand);
    f = hn::Add(hn::Mul(f, factor), summand);
    g = hn::Add(hn::Mul(g, factor), summand);
    h = hn::Add(hn::Mul(h, factor), summand);
    i = hn::Add(hn::Mul(i, factor), summand);
  }
  const auto sum = hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, e)), hn::Add(hn::Add(f, g), hn::Add(h, i)));
  sink[2] = hn::GetLane(sum);
  return hn::Lanes(d);
}

}  // namespace colony::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::bench {

HWY_EXPORT(multiply_add_kernel);

std::size_t multiply_add(std::size_t rounds, float* sink) {
  return HWY_DYNAMIC_DISPATCH(multiply_add_kernel)(rounds, sink);
}

}  // namespace colony::bench
#endif
