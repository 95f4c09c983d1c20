// The vector kernel of top_kernel.hpp. Compiled once per target; the numbers are the same on each. Sums of three are (a + b) + c.
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/picture/top_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/picture/top_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {

using D64 = hn::ScalableTag<double>;
using W = hn::Vec<D64>;
using M = hn::Mask<D64>;

HWY_INLINE W of(double value) { return hn::Set(D64(), value); }
HWY_INLINE W sum3(W a, W b, W c) { return hn::Add(hn::Add(a, b), c); }
HWY_INLINE W dot(const double* row, W x, W y, W z) { return sum3(hn::Mul(of(row[0]), x), hn::Mul(of(row[1]), y), hn::Mul(of(row[2]), z)); }
// As std::max and std::min choose, for the same arguments.
HWY_INLINE W larger(W a, W b) { return hn::IfThenElse(hn::Lt(a, b), b, a); }
HWY_INLINE W smaller(W a, W b) { return hn::IfThenElse(hn::Lt(b, a), b, a); }

HWY_INLINE W sine(W x) {
  const D64 d;
  const hn::RebindToUnsigned<D64> du;
  constexpr double kPi = 3.14159265358979323846;
  const W to_nearest = of(6755399441055744.0);
  const W shifted = hn::Add(hn::Mul(x, of(1.0 / kPi)), to_nearest);
  const W r = hn::Sub(x, hn::Mul(hn::Sub(shifted, to_nearest), of(kPi)));
  const W r2 = hn::Mul(r, r);
  W sum = of(1.0 / 6227020800.0);
  sum = hn::Sub(hn::Mul(sum, r2), of(1.0 / 39916800.0));
  sum = hn::Add(hn::Mul(sum, r2), of(1.0 / 362880.0));
  sum = hn::Sub(hn::Mul(sum, r2), of(1.0 / 5040.0));
  sum = hn::Add(hn::Mul(sum, r2), of(1.0 / 120.0));
  sum = hn::Sub(hn::Mul(sum, r2), of(1.0 / 6.0));
  const auto odd_multiple = hn::ShiftLeft<63>(hn::BitCast(du, shifted));
  const W value = hn::Add(r, hn::Mul(hn::Mul(r, r2), sum));
  return hn::BitCast(d, hn::Xor(hn::BitCast(du, value), odd_multiple));
}

HWY_INLINE W sine_bound(W middle, W change) { return smaller(of(1.0), hn::Add(hn::Abs(middle), change)); }

struct Columns {
  const TopBody& b;
  W unit[3];      // (u, v, w) at z = 0
  W noise_at[3];  // the place in the noise there
  double second, slower;

  W at(int axis, W z) const { return hn::Add(noise_at[axis], hn::Mul(of(b.step[axis]), z)); }

  W field(W z) const {
    const W x = at(0, z), y = at(1, z), w = at(2, z);
    const W sine_u = sine(hn::Mul(of(b.frequency), x)), sine_v = sine(hn::Mul(of(b.frequency), y)), sine_w = sine(hn::Mul(of(b.frequency), w));
    const auto factor = [&](W own, W place, W other) {
      const W inner = hn::Add(hn::Mul(of(slower), place), hn::Mul(of(b.phase), other));
      return hn::Add(hn::Mul(of(b.amplitude), own), hn::Mul(of(second), sine(inner)));
    };
    const W gx = factor(sine_u, x, sine_w), gy = factor(sine_v, y, sine_u), gz = factor(sine_w, w, sine_v);
    W squares[3];
    for (int axis = 0; axis < 3; ++axis) {
      const W place = hn::Add(unit[axis], hn::Mul(of(b.step[axis]), z));
      squares[axis] = hn::Mul(place, place);
    }
    return hn::Add(hn::Sub(of(1.0), sum3(squares[0], squares[1], squares[2])), hn::Mul(hn::Mul(gx, gy), gz));
  }

  void noise_limits(W low, W high, W& bound, W& slope_max) const {
    const W half = hn::Mul(of(0.5), hn::Sub(high, low));
    const W middle = hn::Add(low, half);
    const W x = at(0, middle), y = at(1, middle);
    const W scale = hn::Mul(of(b.frequency), half);
    const W change_x = hn::Mul(scale, of(b.rate[0])), change_y = hn::Mul(scale, of(b.rate[1]));
    const W sine_u = sine(hn::Mul(of(b.frequency), x)), sine_v = sine(hn::Mul(of(b.frequency), y));
    const W second_v = sine(hn::Add(hn::Mul(of(slower), y), hn::Mul(of(b.phase), sine_u)));
    const W gx = hn::Add(hn::Mul(of(b.amplitude), sine_bound(sine_u, change_x)), of(second));
    const W change_second = hn::Add(hn::Div(change_y, of(b.frequency_ratio)), hn::Mul(hn::Abs(of(b.phase)), change_x));
    const W gy = hn::Add(hn::Mul(of(b.amplitude), sine_bound(sine_v, change_y)), hn::Mul(of(second), sine_bound(second_v, change_second)));
    const W gz = of(b.amplitude + second);
    bound = hn::Mul(hn::Mul(gx, gy), gz);
    slope_max = hn::Add(hn::Add(hn::Mul(hn::Mul(of(b.factor_slope[0]), gy), gz), hn::Mul(hn::Mul(gx, of(b.factor_slope[1])), gz)),
                        hn::Mul(hn::Mul(gx, gy), of(b.factor_slope[2])));
  }
};

HWY_INLINE W tops(const TopBody& b, W x_um, W y_um, W floor) {
  const D64 d;
  const W zero = hn::Zero(d);
  Columns columns{b, {zero, zero, zero}, {zero, zero, zero}, b.amplitude / b.amplitude_ratio, b.frequency / b.frequency_ratio};
  const W dx = hn::Sub(x_um, of(b.centre_um[0])), dy = hn::Sub(y_um, of(b.centre_um[1])), dz = of(-b.centre_um[2]);
  for (int axis = 0; axis < 3; ++axis) {
    columns.unit[axis] = dot(b.to_unit + 3 * axis, dx, dy, dz);
    columns.noise_at[axis] = hn::Add(columns.unit[axis], of(b.noise_offset[axis]));
  }
  const W* unit = columns.unit;
  const W step2 = of(b.step_squared);
  const W slope = sum3(hn::Mul(unit[0], of(b.step[0])), hn::Mul(unit[1], of(b.step[1])), hn::Mul(unit[2], of(b.step[2])));
  const W squared = sum3(hn::Mul(unit[0], unit[0]), hn::Mul(unit[1], unit[1]), hn::Mul(unit[2], unit[2]));
  const W peak = hn::Add(hn::Sub(of(1.0), squared), hn::Div(hn::Mul(slope, slope), step2));
  const W widest = of(b.noise_bound);
  M alive = hn::Ge(hn::Add(peak, widest), zero);
  if (hn::AllFalse(d, alive)) return floor;
  const W middle = hn::Div(hn::Neg(slope), step2);
  // Of lanes that are not alive the root is no number, and not looked at.
  const auto reach = [&](W level) { return hn::Sqrt(hn::Div(hn::Sub(peak, level), step2)); };
  const auto end_for = [&](W bound) {
    return hn::IfThenElse(hn::Gt(peak, bound), hn::Add(middle, reach(bound)), hn::Sub(middle, reach(hn::Neg(bound))));
  };
  W start = hn::Add(middle, reach(hn::Neg(widest)));
  alive = hn::And(alive, hn::Gt(start, floor));
  if (hn::AllFalse(d, alive)) return floor;
  const W low = larger(end_for(widest), floor);
  W bound = zero, slope_max = zero;
  columns.noise_limits(low, start, bound, slope_max);
  bound = smaller(bound, widest);
  alive = hn::And(alive, hn::Ge(hn::Add(peak, bound), zero));
  start = hn::Add(middle, reach(hn::Neg(bound)));
  alive = hn::And(alive, hn::Gt(start, floor));
  if (hn::AllFalse(d, alive)) return floor;
  const W end = larger(end_for(bound), low);
  slope_max = hn::Add(hn::Mul(hn::Mul(of(2.0), step2), hn::Sub(start, middle)), slope_max);

  W z = start, field = columns.field(z);
  W result = hn::IfThenElse(alive, hn::IfThenElse(hn::Gt(peak, bound), end, floor), floor);
  const M tangent = hn::And(alive, hn::Ge(field, zero));
  result = hn::IfThenElse(tangent, z, result);
  M searching = hn::AndNot(tangent, alive);
  // The bracket of each lane that found one.
  W in_z = zero, in_field = zero, out_z = zero, out_field = of(-1.0);
  M found = hn::Gt(zero, zero);
  for (;;) {
    searching = hn::And(searching, hn::Gt(z, end));
    if (hn::AllFalse(d, searching)) break;
    const W next = larger(hn::Sub(z, larger(hn::Div(hn::Neg(field), slope_max), of(b.step_min_um))), end);
    const W value = columns.field(next);
    const M hit = hn::And(searching, hn::Ge(value, zero));
    in_z = hn::IfThenElse(hit, next, in_z);
    in_field = hn::IfThenElse(hit, value, in_field);
    out_z = hn::IfThenElse(hit, z, out_z);
    out_field = hn::IfThenElse(hit, field, out_field);
    found = hn::Or(found, hit);
    searching = hn::AndNot(hit, searching);
    z = hn::IfThenElse(searching, next, z);
    field = hn::IfThenElse(searching, value, field);
  }
  if (hn::AllFalse(d, found)) return result;
  const auto between = [](W from, W to, W from_field, W to_field) {
    return hn::Add(from, hn::Mul(hn::Sub(to, from), hn::Div(from_field, hn::Sub(from_field, to_field))));
  };
  const W guess = between(in_z, out_z, in_field, out_field);
  const W value = columns.field(guess);
  const W refined = hn::IfThenElse(hn::Ge(value, zero), between(guess, out_z, value, out_field), between(in_z, guess, in_field, value));
  return hn::IfThenElse(found, refined, result);
}

}  // namespace

void column_tops_kernel(const TopBody& body, const double* HWY_RESTRICT x_um, double y_um, const double* HWY_RESTRICT floor_um, std::size_t n,
                        double* HWY_RESTRICT top_um) {
  const D64 d;
  for (std::size_t first = 0; first < n; first += hn::Lanes(d)) {
    hn::StoreU(tops(body, hn::LoadU(d, x_um + first), of(y_um), hn::LoadU(d, floor_um + first)), d, top_um + first);
  }
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(column_tops_kernel);

void column_tops(const TopBody& body, const double* x_um, double y_um, const double* floor_um, std::size_t n, double* top_um) {
  HWY_DYNAMIC_DISPATCH(column_tops_kernel)(body, x_um, y_um, floor_um, n, top_um);
}

}  // namespace colony::kernel
#endif
