// field_inl: the field of one body over vectors of points; included once per vector target by the kernels' .cpp files.
// Method:  the operations of the plain C++ twin (overlap_kernel.cpp) in the same order: a point's value does not depend on the width.
// Threads: pure.
#if defined(COLONY_FIELD_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef COLONY_FIELD_INL_HPP
#undef COLONY_FIELD_INL_HPP
#else
#define COLONY_FIELD_INL_HPP
#endif

#include <hwy/highway.h>

#include "engine/space/overlap_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

HWY_INLINE V constant(float value) { return hn::Set(D(), value); }

HWY_INLINE V sine(V x) {
  const D d;
  const hn::RebindToSigned<D> integers;
  // Adding 1.5 * 2^23 rounds to the nearest integer, whose lowest bit is then the sum's.
  const V shifted = hn::Add(hn::Mul(x, constant(0.318309886F)), constant(12582912.0F));
  const V k = hn::Sub(shifted, constant(12582912.0F));
  const V r = hn::Sub(x, hn::Mul(k, constant(3.14159265F)));
  const V r2 = hn::Mul(r, r);
  V sum = hn::Add(hn::Mul(constant(-1.84901083e-4F), r2), constant(8.31230105e-3F));
  sum = hn::Sub(hn::Mul(sum, r2), constant(1.66656764e-1F));
  const V s = hn::Add(r, hn::Mul(hn::Mul(r, r2), sum));
  return hn::Xor(s, hn::BitCast(d, hn::ShiftLeft<31>(hn::BitCast(integers, shifted))));  // odd k: the sign bit
}

HWY_INLINE V noise(const FloatBody& b, V u, V v, V w) {
  const V frequency = constant(b.frequency);
  const V slower = constant(b.slower_frequency);
  const V amplitude = constant(b.amplitude);
  const V second = constant(b.second_amplitude);
  const V phase = constant(b.phase);
  const V sx = sine(hn::Add(hn::Mul(frequency, u), constant(b.q1[0])));
  const V sy = sine(hn::Add(hn::Mul(frequency, v), constant(b.q1[1])));
  const V sz = sine(hn::Add(hn::Mul(frequency, w), constant(b.q1[2])));
  const V tx = sine(hn::Add(hn::Add(hn::Mul(slower, u), constant(b.q2[0])), hn::Mul(phase, sz)));
  const V ty = sine(hn::Add(hn::Add(hn::Mul(slower, v), constant(b.q2[1])), hn::Mul(phase, sx)));
  const V tz = sine(hn::Add(hn::Add(hn::Mul(slower, w), constant(b.q2[2])), hn::Mul(phase, sy)));
  const V gx = hn::Add(hn::Mul(amplitude, sx), hn::Mul(second, tx));
  const V gy = hn::Add(hn::Mul(amplitude, sy), hn::Mul(second, ty));
  const V gz = hn::Add(hn::Mul(amplitude, sz), hn::Mul(second, tz));
  return hn::Mul(hn::Mul(gx, gy), gz);
}

HWY_INLINE V row(const float* m, float shift, V x, V y, V z) {
  const V xy = hn::Add(hn::Mul(constant(m[0]), x), hn::Mul(constant(m[1]), y));
  return hn::Add(hn::Add(xy, hn::Mul(constant(m[2]), z)), constant(shift));
}

HWY_INLINE V smooth_field(V u, V v, V w) {
  return hn::Sub(hn::Sub(hn::Sub(constant(1.0F), hn::Mul(u, u)), hn::Mul(v, v)), hn::Mul(w, w));
}

// Points that lie between the body's low and high along x and y: the others are outside, and cheaper to see than by the field.
HWY_INLINE hn::Mask<D> in_reach(const FloatBody& b, V x, V y) {
  const auto along_x = hn::And(hn::Ge(x, constant(b.low[0])), hn::Le(x, constant(b.high[0])));
  return hn::And(along_x, hn::And(hn::Ge(y, constant(b.low[1])), hn::Le(y, constant(b.high[1]))));
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
