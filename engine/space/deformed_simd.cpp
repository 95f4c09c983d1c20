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

constexpr float kFar = 3e38F;  // squares of distances are below

// Where f~ >= 0, of the points asked for (for others the answer says nothing). A point outside the body itself needs no neighbour.
HWY_INLINE hn::Mask<D> in_deformed(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, V x, V y, V z, hn::Mask<D> asked,
                                   CountWork& work) {
  const D d;
  const V zero = hn::Zero(d);
  const V u = row(body.m, body.t[0], x, y, z);
  const V v = row(body.m + 3, body.t[1], x, y, z);
  const V w = row(body.m + 6, body.t[2], x, y, z);
  const V smooth = smooth_field(u, v, w);
  const auto sure = hn::And(asked, hn::Gt(smooth, constant(body.band)));
  const auto undecided = hn::AndNot(sure, hn::And(asked, hn::Ge(smooth, constant(-body.band))));
  auto inside = sure;
  V field = smooth;
  if (!hn::AllFalse(d, undecided)) {
    work.noise_count += hn::CountTrue(d, undecided);
    field = hn::Add(smooth, noise(body, u, v, w));
    inside = hn::Or(sure, hn::And(undecided, hn::Ge(field, zero)));
  }
  if (hn::AllFalse(d, inside)) return inside;
  V taken = zero;
  for (const FloatBody& other : neighbours) {
    const auto reached = hn::And(inside, in_reach(other, x, y));
    if (hn::AllFalse(d, reached)) continue;
    work.field_count += hn::CountTrue(d, reached);
    const V ou = row(other.m, other.t[0], x, y, z);
    const V ov = row(other.m + 3, other.t[1], x, y, z);
    const V ow = row(other.m + 6, other.t[2], x, y, z);
    const V other_smooth = smooth_field(ou, ov, ow);
    const auto near = hn::And(reached, hn::Ge(other_smooth, constant(-other.band)));
    if (hn::AllFalse(d, near)) continue;
    work.noise_count += hn::CountTrue(d, near);
    const V other_field = hn::Add(other_smooth, noise(other, ou, ov, ow));
    const V takes = hn::IfThenElseZero(hn::And(near, hn::Gt(other_field, zero)), other_field);
    taken = largest_only ? hn::IfThenElse(hn::Gt(takes, taken), takes, taken) : hn::Add(taken, takes);
  }
  const auto touched = hn::And(inside, hn::Gt(taken, zero));
  if (hn::AllFalse(d, touched)) return inside;
  if (hn::AllFalse(d, undecided)) {
    work.noise_count += hn::CountTrue(d, touched);
    field = hn::Add(smooth, noise(body, u, v, w));
  }
  return hn::And(inside, hn::Ge(hn::Sub(field, taken), zero));  // with nothing taken from a sure one this holds too
}

// Of multiples of 2^-24 in [0, 1): in whole numbers, so that the order cannot matter.
class ExactSum {
 public:
  HWY_INLINE ExactSum() : sum_(hn::Zero(integers_)) {}  // written out: an implicit one is not compiled for the target
  HWY_INLINE void add(V values) {
    sum_ = hn::Add(sum_, hn::ConvertTo(integers_, hn::Mul(values, constant(16777216.0F))));
    if (++held_ == 128) empty();  // 128 (2^24 - 1) < 2^31
  }
  double total() {
    empty();
    return static_cast<double>(total_) * 0x1.0p-24;
  }

 private:
  void empty() {
    HWY_ALIGN std::int32_t lanes[HWY_MAX_BYTES / sizeof(std::int32_t)];
    hn::Store(sum_, integers_, lanes);
    for (std::size_t lane = 0; lane < hn::Lanes(integers_); ++lane) total_ += lanes[lane];
    sum_ = hn::Zero(integers_);
    held_ = 0;
  }
  static constexpr hn::RebindToSigned<D> integers_{};
  hn::Vec<hn::RebindToSigned<D>> sum_;
  std::int64_t total_ = 0;
  int held_ = 0;
};

DeformedSums sum_deformed_kernel(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const PointColumns& points,
                                 const PointColumns& summed, std::size_t n, CountWork& work) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  DeformedSums sums;
  ExactSum sum_x, sum_y, sum_z;
  work.field_count += n;
  for (std::size_t i = 0; i < n; i += lanes) {
    const auto inside = in_deformed(body, neighbours, largest_only, hn::LoadU(d, points.x + i), hn::LoadU(d, points.y + i), hn::LoadU(d, points.z + i),
                                    hn::FirstN(d, n - i), work);
    if (hn::AllFalse(d, inside)) continue;
    sums.count += static_cast<std::uint32_t>(hn::CountTrue(d, inside));
    sum_x.add(hn::IfThenElseZero(inside, hn::LoadU(d, summed.x + i)));
    sum_y.add(hn::IfThenElseZero(inside, hn::LoadU(d, summed.y + i)));
    sum_z.add(hn::IfThenElseZero(inside, hn::LoadU(d, summed.z + i)));
  }
  sums.sum[0] = sum_x.total();
  sums.sum[1] = sum_y.total();
  sums.sum[2] = sum_z.total();
  return sums;
}

std::size_t nearest_outside_kernel(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const PointColumns& points,
                                   std::size_t n, CountWork& work) {
  std::size_t nearest = n;
  float least = 0.0F;
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  V bound = hn::Inf(d);
  HWY_ALIGN float values[HWY_MAX_BYTES / sizeof(float)];
  const auto keep_least = [&](hn::Mask<D> outside, V distance2, std::size_t first) {
    hn::Store(hn::IfThenElse(outside, distance2, hn::Inf(d)), d, values);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::size_t i = first + lane;
      if (!(values[lane] <= (nearest == n ? kFar : least)) || (nearest != n && values[lane] == least && i > nearest)) continue;
      nearest = i;
      least = values[lane];
    }
    if (nearest != n) bound = constant(least);
  };
  // First those that lie outside the body itself whatever the noise: a bound that spares most of the others.
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, points.x + i);
    const V py = hn::LoadU(d, points.y + i);
    const V pz = hn::LoadU(d, points.z + i);
    const V distance2 = hn::Add(hn::Add(hn::Mul(px, px), hn::Mul(py, py)), hn::Mul(pz, pz));
    const auto nearer = hn::And(hn::Lt(distance2, bound), hn::FirstN(d, n - i));
    if (hn::AllFalse(d, nearer)) continue;
    work.field_count += hn::CountTrue(d, nearer);
    const V u = row(body.m, body.t[0], px, py, pz);
    const V v = row(body.m + 3, body.t[1], px, py, pz);
    const V w = row(body.m + 6, body.t[2], px, py, pz);
    const auto outside = hn::And(nearer, hn::Lt(smooth_field(u, v, w), constant(-body.band)));
    if (!hn::AllFalse(d, outside)) keep_least(outside, distance2, i);
  }
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, points.x + i);
    const V py = hn::LoadU(d, points.y + i);
    const V pz = hn::LoadU(d, points.z + i);
    const V distance2 = hn::Add(hn::Add(hn::Mul(px, px), hn::Mul(py, py)), hn::Mul(pz, pz));
    const auto nearer = hn::And(hn::Le(distance2, bound), hn::FirstN(d, n - i));
    if (hn::AllFalse(d, nearer)) continue;
    work.field_count += hn::CountTrue(d, nearer);
    const auto outside = hn::AndNot(in_deformed(body, neighbours, largest_only, px, py, pz, nearer, work), nearer);
    if (!hn::AllFalse(d, outside)) keep_least(outside, distance2, i);
  }
  return nearest;
}

// In place: a vector is written no further than it was read.
std::size_t keep_in_ball_kernel(float radius, float low_z, float* x, float* y, float* z, std::size_t n) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const V one = constant(1.0F);
  const V two = constant(2.0F);
  const V r = constant(radius);
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::Sub(hn::Mul(two, hn::LoadU(d, x + i)), one);
    const V py = hn::Sub(hn::Mul(two, hn::LoadU(d, y + i)), one);
    const V pz = hn::Sub(hn::Mul(two, hn::LoadU(d, z + i)), one);
    const V squares = hn::Add(hn::Add(hn::Mul(px, px), hn::Mul(py, py)), hn::Mul(pz, pz));
    const V at_z = hn::Mul(r, pz);
    const auto kept = hn::And(hn::FirstN(d, n - i), hn::And(hn::Le(squares, one), hn::Ge(at_z, constant(low_z))));
    hn::StoreU(hn::Compress(hn::Mul(r, px), kept), d, x + count);
    hn::StoreU(hn::Compress(hn::Mul(r, py), kept), d, y + count);
    hn::StoreU(hn::Compress(at_z, kept), d, z + count);
    count += hn::CountTrue(d, kept);
  }
  return count;
}

// Terms of z that are 0 add 0: leaving them out gives the same bits.
template <bool kFlat>
HWY_INLINE std::size_t count_open(std::span<const Cover> covers, const float* HWY_RESTRICT x, const float* HWY_RESTRICT y, const float* HWY_RESTRICT z,
                                  std::size_t n) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, x + i);
    const V py = hn::LoadU(d, y + i);
    auto open = hn::FirstN(d, n - i);
    for (const Cover& cover : covers) {
      const V dx = hn::Sub(px, constant(cover.centre[0]));
      const V dy = hn::Sub(py, constant(cover.centre[1]));
      V squares = hn::Add(hn::Mul(constant(cover.xx), hn::Mul(dx, dx)), hn::Mul(constant(cover.yy), hn::Mul(dy, dy)));
      V products = hn::Mul(constant(cover.xy), hn::Mul(dx, dy));
      if constexpr (!kFlat) {
        const V dz = hn::Sub(hn::LoadU(d, z + i), constant(cover.centre[2]));
        squares = hn::Add(squares, hn::Mul(constant(cover.zz), hn::Mul(dz, dz)));
        products = hn::Add(hn::Add(products, hn::Mul(constant(cover.xz), hn::Mul(dx, dz))), hn::Mul(constant(cover.yz), hn::Mul(dy, dz)));
      }
      open = hn::And(open, hn::Gt(hn::Add(squares, hn::Add(products, products)), constant(1.0F)));
      if (hn::AllFalse(d, open)) break;
    }
    count += hn::CountTrue(d, open);
  }
  return count;
}

std::uint32_t count_uncovered_kernel(std::span<const Cover> covers, const float* x, const float* y, const float* z, std::size_t n) {
  bool flat = true;
  for (const Cover& cover : covers) flat = flat && cover.zz == 0.0F && cover.xz == 0.0F && cover.yz == 0.0F;
  return static_cast<std::uint32_t>(flat ? count_open<true>(covers, x, y, z, n) : count_open<false>(covers, x, y, z, n));
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(sum_deformed_kernel);
HWY_EXPORT(nearest_outside_kernel);
HWY_EXPORT(keep_in_ball_kernel);
HWY_EXPORT(count_uncovered_kernel);

DeformedSums sum_deformed(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const PointColumns& points,
                          const PointColumns& summed, std::size_t n, CountWork* work) {
  CountWork unused;
  return HWY_DYNAMIC_DISPATCH(sum_deformed_kernel)(body, neighbours, largest_only, points, summed, n, work != nullptr ? *work : unused);
}

std::size_t nearest_outside(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, const PointColumns& points, std::size_t n,
                            CountWork* work) {
  CountWork unused;
  return HWY_DYNAMIC_DISPATCH(nearest_outside_kernel)(body, neighbours, largest_only, points, n, work != nullptr ? *work : unused);
}

std::size_t keep_in_ball(float radius, float low_z, float* x, float* y, float* z, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(keep_in_ball_kernel)(radius, low_z, x, y, z, n);
}

std::uint32_t count_uncovered(std::span<const Cover> covers, const float* x, const float* y, const float* z, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(count_uncovered_kernel)(covers, x, y, z, n);
}

}  // namespace colony::kernel
#endif
