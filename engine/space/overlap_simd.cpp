// The vector kernels. Compiled once per target; see overlap_kernel.hpp for why every target gives the same bits.
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/space/overlap_simd.cpp"
#include <hwy/foreach_target.h>
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
  const V turns = hn::Mul(x, constant(0.318309886F));
  // |turns| <= 100 / pi: the conversion is in range.
  const auto k = hn::ConvertTo(integers, hn::Add(turns, hn::CopySign(constant(0.5F), turns)));
  const V kf = hn::ConvertTo(d, k);
  const V r = hn::Sub(hn::Sub(x, hn::Mul(kf, constant(3.140625F))), hn::Mul(kf, constant(9.67653589793e-4F)));
  const V r2 = hn::Mul(r, r);
  V sum = constant(-2.50521084e-8F);
  sum = hn::Add(hn::Mul(sum, r2), constant(2.75573192e-6F));
  sum = hn::Sub(hn::Mul(sum, r2), constant(1.98412698e-4F));
  sum = hn::Add(hn::Mul(sum, r2), constant(8.33333333e-3F));
  sum = hn::Sub(hn::Mul(sum, r2), constant(1.66666667e-1F));
  const V s = hn::Add(r, hn::Mul(hn::Mul(r, r2), sum));
  return hn::Xor(s, hn::BitCast(d, hn::ShiftLeft<31>(k)));  // odd k: the sign bit
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

// Outputs are written in vectors: each array has kPadding to spare.
struct Outputs {
  float* x;
  float* y;
  float* z;
  std::size_t n;
};

template <bool kSelect>
HWY_INLINE std::uint32_t scan(const FloatBody& b, const float* HWY_RESTRICT x, const float* HWY_RESTRICT y,
                              const float* HWY_RESTRICT z, std::size_t n, BandBuffer& band, Outputs& out) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const V above = constant(b.band);
  const V below = constant(-b.band);
  float* const band_u = band.u.data();
  float* const band_v = band.v.data();
  float* const band_w = band.w.data();
  float* const band_smooth = band.smooth.data();
  std::size_t band_count = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, x + i);
    const V py = hn::LoadU(d, y + i);
    const V pz = hn::LoadU(d, z + i);
    const V u = row(b.m, b.t[0], px, py, pz);
    const V v = row(b.m + 3, b.t[1], px, py, pz);
    const V w = row(b.m + 6, b.t[2], px, py, pz);
    const V smooth =
        hn::Sub(hn::Sub(hn::Sub(constant(1.0F), hn::Mul(u, u)), hn::Mul(v, v)), hn::Mul(w, w));
    const auto real = hn::FirstN(d, n - i);  // lanes past n hold padding
    const auto near = hn::And(hn::Ge(smooth, below), real);
    if (hn::AllFalse(d, near)) continue;
    const auto inside = hn::And(hn::Gt(smooth, above), real);
    const auto undecided = hn::AndNot(inside, near);
    if constexpr (kSelect) {
      hn::CompressStore(px, inside, d, out.x + out.n);
      hn::CompressStore(py, inside, d, out.y + out.n);
      out.n += hn::CompressStore(pz, inside, d, out.z + out.n);
    } else {
      count += hn::CountTrue(d, inside);
    }
    if (hn::AllFalse(d, undecided)) continue;
    if constexpr (kSelect) {
      hn::CompressStore(px, undecided, d, band.x.data() + band_count);
      hn::CompressStore(py, undecided, d, band.y.data() + band_count);
      hn::CompressStore(pz, undecided, d, band.z.data() + band_count);
    }
    hn::CompressStore(u, undecided, d, band_u + band_count);
    hn::CompressStore(v, undecided, d, band_v + band_count);
    hn::CompressStore(w, undecided, d, band_w + band_count);
    band_count += hn::CompressStore(smooth, undecided, d, band_smooth + band_count);
  }
  for (std::size_t i = 0; i < band_count; i += lanes) {
    const V u = hn::LoadU(d, band_u + i);
    const V v = hn::LoadU(d, band_v + i);
    const V w = hn::LoadU(d, band_w + i);
    const V field = hn::Add(hn::LoadU(d, band_smooth + i), noise(b, u, v, w));
    const auto inside = hn::And(hn::Ge(field, hn::Zero(d)), hn::FirstN(d, band_count - i));
    if constexpr (kSelect) {
      hn::CompressStore(hn::LoadU(d, band.x.data() + i), inside, d, out.x + out.n);
      hn::CompressStore(hn::LoadU(d, band.y.data() + i), inside, d, out.y + out.n);
      out.n += hn::CompressStore(hn::LoadU(d, band.z.data() + i), inside, d, out.z + out.n);
    } else {
      count += hn::CountTrue(d, inside);
    }
  }
  return static_cast<std::uint32_t>(kSelect ? out.n : count);
}

std::uint32_t count_kernel(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band) {
  Outputs none{nullptr, nullptr, nullptr, 0};
  return scan<false>(body, x, y, z, n, band, none);
}

std::uint32_t select_kernel(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n,
                            BandBuffer& band, float* out_x, float* out_y, float* out_z) {
  Outputs out{out_x, out_y, out_z, 0};
  return scan<true>(body, x, y, z, n, band, out);
}

const char* target_kernel() { return hwy::TargetName(HWY_TARGET); }

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(count_kernel);
HWY_EXPORT(select_kernel);
HWY_EXPORT(target_kernel);

std::uint32_t count_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band) {
  band.hold(n);
  return HWY_DYNAMIC_DISPATCH(count_kernel)(body, x, y, z, n, band);
}

std::uint32_t select_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band,
                            float* out_x, float* out_y, float* out_z) {
  band.hold(n);
  return HWY_DYNAMIC_DISPATCH(select_kernel)(body, x, y, z, n, band, out_x, out_y, out_z);
}

const char* vector_target() { return HWY_DYNAMIC_DISPATCH(target_kernel)(); }

}  // namespace colony::kernel
#endif
