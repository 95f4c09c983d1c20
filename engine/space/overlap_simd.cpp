// The vector kernels. Compiled once per target; see overlap_kernel.hpp for why every target gives the same bits.
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/space/overlap_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/space/field_inl.hpp"
#include "engine/space/overlap_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {

// To a register first: compressing straight to memory is slow on some CPUs (Zen 4: over 100 cycles). Writes a whole vector.
template <class M>
HWY_INLINE std::size_t compress_store(V values, M mask, D d, float* to) {
  hn::StoreU(hn::Compress(values, mask), d, to);
  return hn::CountTrue(d, mask);
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
                              const float* HWY_RESTRICT z, std::size_t n, BandBuffer& band, Outputs& out, CountWork* work) {
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
    const V smooth = smooth_field(u, v, w);
    const auto real = hn::FirstN(d, n - i);  // lanes past n hold padding
    const auto near = hn::And(hn::Ge(smooth, below), real);
    if (hn::AllFalse(d, near)) continue;
    const auto inside = hn::And(hn::Gt(smooth, above), real);
    const auto undecided = hn::AndNot(inside, near);
    if constexpr (kSelect) {
      compress_store(px, inside, d, out.x + out.n);
      compress_store(py, inside, d, out.y + out.n);
      out.n += compress_store(pz, inside, d, out.z + out.n);
    } else {
      count += hn::CountTrue(d, inside);
    }
    if (hn::AllFalse(d, undecided)) continue;
    if constexpr (kSelect) {
      compress_store(px, undecided, d, band.x.data() + band_count);
      compress_store(py, undecided, d, band.y.data() + band_count);
      compress_store(pz, undecided, d, band.z.data() + band_count);
    }
    compress_store(u, undecided, d, band_u + band_count);
    compress_store(v, undecided, d, band_v + band_count);
    compress_store(w, undecided, d, band_w + band_count);
    band_count += compress_store(smooth, undecided, d, band_smooth + band_count);
  }
  if (work != nullptr) {
    work->field_count += n;
    work->noise_count += band_count;
  }
  for (std::size_t i = 0; i < band_count; i += lanes) {
    const V u = hn::LoadU(d, band_u + i);
    const V v = hn::LoadU(d, band_v + i);
    const V w = hn::LoadU(d, band_w + i);
    const V field = hn::Add(hn::LoadU(d, band_smooth + i), noise(b, u, v, w));
    const auto inside = hn::And(hn::Ge(field, hn::Zero(d)), hn::FirstN(d, band_count - i));
    if constexpr (kSelect) {
      compress_store(hn::LoadU(d, band.x.data() + i), inside, d, out.x + out.n);
      compress_store(hn::LoadU(d, band.y.data() + i), inside, d, out.y + out.n);
      out.n += compress_store(hn::LoadU(d, band.z.data() + i), inside, d, out.z + out.n);
    } else {
      count += hn::CountTrue(d, inside);
    }
  }
  return static_cast<std::uint32_t>(kSelect ? out.n : count);
}

std::uint32_t count_kernel(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band,
                           CountWork* work) {
  Outputs none{nullptr, nullptr, nullptr, 0};
  return scan<false>(body, x, y, z, n, band, none, work);
}

std::uint32_t select_kernel(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n,
                            BandBuffer& band, float* out_x, float* out_y, float* out_z, CountWork* work) {
  Outputs out{out_x, out_y, out_z, 0};
  return scan<true>(body, x, y, z, n, band, out, work);
}

// Without copying: where the points of a vector lie close together (tiled_sobol), most vectors need no noise.
HWY_INLINE hn::Mask<D> inside_of(const FloatBody& b, V x, V y, V z, hn::Mask<D> real, CountWork& work) {
  const D d;
  const auto asked = hn::And(real, in_reach(b, x, y));
  if (hn::AllFalse(d, asked)) return asked;
  work.field_count += hn::CountTrue(d, asked);
  const V u = row(b.m, b.t[0], x, y, z);
  const V v = row(b.m + 3, b.t[1], x, y, z);
  const V w = row(b.m + 6, b.t[2], x, y, z);
  const V smooth = smooth_field(u, v, w);
  const auto near = hn::And(asked, hn::Ge(smooth, constant(-b.band)));
  if (hn::AllFalse(d, near)) return near;
  const auto inside = hn::And(near, hn::Gt(smooth, constant(b.band)));
  const auto undecided = hn::AndNot(inside, near);
  if (hn::AllFalse(d, undecided)) return inside;
  work.noise_count += hn::CountTrue(d, undecided);
  const V field = hn::Add(smooth, noise(b, u, v, w));
  return hn::Or(inside, hn::And(undecided, hn::Ge(field, hn::Zero(d))));
}

void count_each_kernel(std::span<const FloatBody> bodies, const float* HWY_RESTRICT x, const float* HWY_RESTRICT y, const float* HWY_RESTRICT z,
                       std::size_t n, std::uint32_t* HWY_RESTRICT counts, CountWork& work) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t j = 0; j < bodies.size(); ++j) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; i += lanes) {
      const auto real = hn::FirstN(d, n - i);  // lanes past n hold padding
      count += hn::CountTrue(d, inside_of(bodies[j], hn::LoadU(d, x + i), hn::LoadU(d, y + i), hn::LoadU(d, z + i), real, work));
    }
    counts[j] = static_cast<std::uint32_t>(count);
  }
}

const char* target_kernel() { return hwy::TargetName(HWY_TARGET); }

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(count_kernel);
HWY_EXPORT(select_kernel);
HWY_EXPORT(count_each_kernel);
HWY_EXPORT(target_kernel);

std::uint32_t count_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band,
                           CountWork* work) {
  band.hold(n);
  return HWY_DYNAMIC_DISPATCH(count_kernel)(body, x, y, z, n, band, work);
}

std::uint32_t select_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band,
                            float* out_x, float* out_y, float* out_z, CountWork* work) {
  band.hold(n);
  return HWY_DYNAMIC_DISPATCH(select_kernel)(body, x, y, z, n, band, out_x, out_y, out_z, work);
}

void count_each(std::span<const FloatBody> bodies, const float* x, const float* y, const float* z, std::size_t n, std::uint32_t* counts,
                CountWork& work) {
  HWY_DYNAMIC_DISPATCH(count_each_kernel)(bodies, x, y, z, n, counts, work);
}

const char* vector_target() { return HWY_DYNAMIC_DISPATCH(target_kernel)(); }

}  // namespace colony::kernel
#endif
