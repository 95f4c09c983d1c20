// The vector kernels of deformed_kernel.hpp. Compiled once per target; the numbers are the same on each (overlap_kernel.hpp says why).
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/space/deformed_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/space/deformed_kernel.hpp"
#include "engine/space/field_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {

template <class M>
HWY_INLINE void store_flags(M mask, std::size_t count, std::uint8_t* flags) {
  std::uint8_t bits[8 + 8];  // StoreMaskBits may write 8
  hn::StoreMaskBits(D(), mask, bits);
  for (std::size_t lane = 0; lane < count; ++lane) flags[lane] = (bits[lane >> 3] >> (lane & 7)) & 1;
}

void flag_deformed_kernel(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const float* HWY_RESTRICT x,
                          const float* HWY_RESTRICT y, const float* HWY_RESTRICT z, std::size_t n, std::uint8_t* HWY_RESTRICT flags,
                          CountWork& work) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const V zero = hn::Zero(d);
  work.field_count += n;
  for (std::size_t i = 0; i < n; i += lanes) {
    const std::size_t count = n - i < lanes ? n - i : lanes;
    const V px = hn::LoadU(d, x + i);
    const V py = hn::LoadU(d, y + i);
    const V pz = hn::LoadU(d, z + i);
    const V u = row(body.m, body.t[0], px, py, pz);
    const V v = row(body.m + 3, body.t[1], px, py, pz);
    const V w = row(body.m + 6, body.t[2], px, py, pz);
    const V smooth = smooth_field(u, v, w);
    const auto maybe = hn::Ge(smooth, constant(-body.band));
    if (hn::AllFalse(d, maybe)) {
      store_flags(maybe, count, flags + i);
      continue;
    }
    work.field_count += count * neighbours.size();
    V taken = zero;
    for (const FloatBody& other : neighbours) {
      const V ou = row(other.m, other.t[0], px, py, pz);
      const V ov = row(other.m + 3, other.t[1], px, py, pz);
      const V ow = row(other.m + 6, other.t[2], px, py, pz);
      const V other_smooth = smooth_field(ou, ov, ow);
      const auto near = hn::And(maybe, hn::Ge(other_smooth, constant(-other.band)));
      if (hn::AllFalse(d, near)) continue;
      work.noise_count += hn::CountTrue(d, near);
      const V field = hn::Add(other_smooth, noise(other, ou, ov, ow));
      const V takes = hn::IfThenElseZero(hn::And(near, hn::Gt(field, zero)), field);
      taken = largest_only ? hn::IfThenElse(hn::Gt(takes, taken), takes, taken) : hn::Add(taken, takes);
    }
    const auto alone = hn::Not(hn::Gt(taken, zero));
    auto inside = hn::And(alone, hn::Gt(smooth, constant(body.band)));
    const auto undecided = hn::AndNot(inside, maybe);
    if (!hn::AllFalse(d, undecided)) {
      work.noise_count += hn::CountTrue(d, undecided);
      const V field = hn::Sub(hn::Add(smooth, noise(body, u, v, w)), taken);
      inside = hn::And(maybe, hn::Or(inside, hn::Ge(field, zero)));
    }
    store_flags(inside, count, flags + i);
  }
}

std::size_t nearest_unflagged_kernel(const float* HWY_RESTRICT x, const float* HWY_RESTRICT y, const float* HWY_RESTRICT z, std::size_t n,
                                     const std::uint8_t* HWY_RESTRICT flags) {
  std::size_t nearest = n;
  float least = 0.0F;
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  V bound = hn::Inf(d);
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, x + i);
    const V py = hn::LoadU(d, y + i);
    const V pz = hn::LoadU(d, z + i);
    const V distance2 = hn::Add(hn::Add(hn::Mul(px, px), hn::Mul(py, py)), hn::Mul(pz, pz));
    if (hn::AllFalse(d, hn::Lt(distance2, bound))) continue;
    HWY_ALIGN float values[HWY_MAX_BYTES / sizeof(float)];
    hn::Store(distance2, d, values);
    const std::size_t count = n - i < lanes ? n - i : lanes;
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (flags[i + lane] != 0 || (nearest != n && !(values[lane] < least))) continue;
      nearest = i + lane;
      least = values[lane];
    }
    if (nearest != n) bound = constant(least);
  }
  return nearest;
}

std::uint32_t count_uncovered_kernel(std::span<const Cover> covers, const float* HWY_RESTRICT x, const float* HWY_RESTRICT y,
                                     const float* HWY_RESTRICT z, std::size_t n) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, x + i);
    const V py = hn::LoadU(d, y + i);
    const V pz = hn::LoadU(d, z + i);
    auto open = hn::FirstN(d, n - i);
    for (const Cover& cover : covers) {
      const V dx = hn::Sub(px, constant(cover.centre[0]));
      const V dy = hn::Sub(py, constant(cover.centre[1]));
      const V dz = hn::Sub(pz, constant(cover.centre[2]));
      const V squares = hn::Add(hn::Add(hn::Mul(constant(cover.xx), hn::Mul(dx, dx)), hn::Mul(constant(cover.yy), hn::Mul(dy, dy))),
                                hn::Mul(constant(cover.zz), hn::Mul(dz, dz)));
      const V products = hn::Add(hn::Add(hn::Mul(constant(cover.xy), hn::Mul(dx, dy)), hn::Mul(constant(cover.xz), hn::Mul(dx, dz))),
                                 hn::Mul(constant(cover.yz), hn::Mul(dy, dz)));
      open = hn::And(open, hn::Gt(hn::Add(squares, hn::Add(products, products)), constant(1.0F)));
      if (hn::AllFalse(d, open)) break;
    }
    count += hn::CountTrue(d, open);
  }
  return static_cast<std::uint32_t>(count);
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(flag_deformed_kernel);
HWY_EXPORT(nearest_unflagged_kernel);
HWY_EXPORT(count_uncovered_kernel);

void flag_deformed(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const float* x, const float* y,
                   const float* z, std::size_t n, std::uint8_t* flags, CountWork* work) {
  CountWork unused;
  HWY_DYNAMIC_DISPATCH(flag_deformed_kernel)(body, neighbours, largest_only, x, y, z, n, flags, work != nullptr ? *work : unused);
}

std::size_t nearest_unflagged(const float* x, const float* y, const float* z, std::size_t n, const std::uint8_t* flags) {
  return HWY_DYNAMIC_DISPATCH(nearest_unflagged_kernel)(x, y, z, n, flags);
}

std::uint32_t count_uncovered(std::span<const Cover> covers, const float* x, const float* y, const float* z, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(count_uncovered_kernel)(covers, x, y, z, n);
}

}  // namespace colony::kernel
#endif
