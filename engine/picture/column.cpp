#include "engine/picture/column.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace colony {
namespace {

// The two ratios of Gardner's series: second amplitude and second frequency.
constexpr double kAmplitudeRatio = 1.17;
constexpr double kFrequencyRatio = 1.35;

constexpr double kPi = 3.14159265358979323846;
constexpr double kToNearest = 6755399441055744.0;  // 1.5 x 2^52: adding it rounds to an integer, held in the low bits

/// sin x for |x| < 1e4, within 1e-9: reduced by multiples of pi, Taylor series to x^13 on |r| <= pi/2 (the next term is
/// 7e-10). No branch and no call, so that the sines of one field run side by side.
inline double sine(double x) {
  const double shifted = x * (1.0 / kPi) + kToNearest;
  const double r = x - (shifted - kToNearest) * kPi;
  const double r2 = r * r;
  double sum = 1.0 / 6227020800.0;
  sum = sum * r2 - 1.0 / 39916800.0;
  sum = sum * r2 + 1.0 / 362880.0;
  sum = sum * r2 - 1.0 / 5040.0;
  sum = sum * r2 + 1.0 / 120.0;
  sum = sum * r2 - 1.0 / 6.0;
  const std::uint64_t odd_multiple = std::bit_cast<std::uint64_t>(shifted) << 63;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(r + r * r2 * sum) ^ odd_multiple);
}

/// max |s| over an interval around a point where it is `middle`, if it changes by `change` at most.
double sine_bound(double middle, double change) { return std::min(1.0, std::abs(middle) + change); }

/// The root between `in` (f >= 0) and `out` (f < 0): two steps of false position, on a bracket of little more than the
/// step.
double refined_um(const Column& column, double in_um, double in, double out_um, double out) {
  const double guess_um = in_um + (out_um - in_um) * (in / (in - out));
  const double value = column.field(guess_um);
  if (value >= 0.0) return guess_um + (out_um - guess_um) * (value / (value - out));
  return in_um + (guess_um - in_um) * (in / (in - value));
}

}  // namespace

double Column::field(double z_um) const {
  const Vec3 at = noise_at(z_um);
  const double sine_u = sine(noise_.frequency * at.x());
  const double sine_v = sine(noise_.frequency * at.y());
  const double sine_w = sine(noise_.frequency * at.z());
  const double second = noise_.amplitude / kAmplitudeRatio;
  const double slower = noise_.frequency / kFrequencyRatio;
  const double gx = noise_.amplitude * sine_u + second * sine(slower * at.x() + noise_.phase * sine_w);
  const double gy = noise_.amplitude * sine_v + second * sine(slower * at.y() + noise_.phase * sine_u);
  const double gz = noise_.amplitude * sine_w + second * sine(slower * at.z() + noise_.phase * sine_v);
  return 1.0 - (unit_ + step_ * z_um).squaredNorm() + gx * gy * gz;
}

ColumnScan::ColumnScan(const Body& body)
    : body_(body), step_(body.to_unit().col(2)), step_squared_(step_.squaredNorm()), rate_(step_.cwiseAbs()) {
  const NoiseParams& noise = body.noise();
  const double second = noise.amplitude / kAmplitudeRatio;
  // Gx = a sin(q u) + (a/1.17) sin(q u/1.35 + h sin(q w)); Gy has its phase from u, Gz from v.
  const auto slope = [&](double own, double phase) {
    return noise.amplitude * noise.frequency * own +
           second * noise.frequency * (own / kFrequencyRatio + std::abs(noise.phase) * phase);
  };
  factor_slope_ = Vec3(slope(rate_.x(), rate_.z()), slope(rate_.y(), rate_.x()), slope(rate_.z(), rate_.y()));
}

NoiseLimits ColumnScan::noise_limits(const Column& column, double low_um, double high_um) const {
  const NoiseParams& noise = body_.noise();
  const double half_um = 0.5 * (high_um - low_um);
  const Vec3 at = column.noise_at(low_um + half_um);
  const Vec3 change = noise.frequency * half_um * rate_;  // of q u, q v, q w
  const double second = noise.amplitude / kAmplitudeRatio;
  const double sine_u = sine(noise.frequency * at.x());
  const double sine_v = sine(noise.frequency * at.y());
  const double second_v = sine(noise.frequency / kFrequencyRatio * at.y() + noise.phase * sine_u);
  // Gz and the second term of Gx run with w, the direction of the column: their amplitudes are their bounds.
  const double gx = noise.amplitude * sine_bound(sine_u, change.x()) + second;
  const double gy = noise.amplitude * sine_bound(sine_v, change.y()) +
                    second * sine_bound(second_v, change.y() / kFrequencyRatio + std::abs(noise.phase) * change.x());
  const double gz = noise.amplitude + second;
  return {gx * gy * gz, factor_slope_.x() * gy * gz + gx * factor_slope_.y() * gz + gx * gy * factor_slope_.z()};
}

kernel::TopBody ColumnScan::prepared() const {
  kernel::TopBody out{};
  const NoiseParams& noise = body_.noise();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.to_unit[3 * i + j] = body_.to_unit()(i, j);
    out.centre_um[i] = body_.centre_um()[i];
    out.step[i] = step_[i];
    out.noise_offset[i] = body_.noise_offset()[i];
    out.rate[i] = rate_[i];
    out.factor_slope[i] = factor_slope_[i];
  }
  out.step_squared = step_squared_;
  out.amplitude = noise.amplitude;
  out.frequency = noise.frequency;
  out.phase = noise.phase;
  out.amplitude_ratio = kAmplitudeRatio;
  out.frequency_ratio = kFrequencyRatio;
  out.noise_bound = body_.noise_bound();
  out.step_min_um = kScanStepMin_um;
  return out;
}

double ColumnScan::top_um(double x_um, double y_um, double floor_um) const {
  // On the column the smooth field is the parabola peak - |step|^2 (z - middle)^2.
  const Column column(body_, step_, x_um, y_um);
  const double slope = column.unit().dot(step_);
  const double peak = 1.0 - column.unit().squaredNorm() + slope * slope / step_squared_;
  if (!(peak + body_.noise_bound() >= 0.0)) return floor_um;
  const double middle_um = -slope / step_squared_;
  const auto reach_um = [&](double level) { return std::sqrt((peak - level) / step_squared_); };
  // Above `start` f is below 0 for certain; below `end` there is nothing to look for: inside for certain, or below the
  // body.
  double start_um = middle_um + reach_um(-body_.noise_bound());
  if (!(start_um > floor_um)) return floor_um;
  const auto end_for = [&](double bound) {
    return peak > bound ? middle_um + reach_um(bound) : middle_um - reach_um(-bound);
  };
  const double low_um = std::max(end_for(body_.noise_bound()), floor_um);
  const NoiseLimits limits = noise_limits(column, low_um, start_um);
  const double bound = std::min(limits.bound, body_.noise_bound());
  // The narrower bound holds from `low` up only: a narrower band is cut out of the first one, never below it.
  if (!(peak + bound >= 0.0)) return floor_um;
  start_um = middle_um + reach_um(-bound);
  if (!(start_um > floor_um)) return floor_um;
  const double end_um = std::max(end_for(bound), low_um);
  const double slope_max = 2.0 * step_squared_ * (start_um - middle_um) + limits.slope_max_per_um;

  double z_um = start_um;
  double field = column.field(z_um);
  if (field >= 0.0) return z_um;  // tangent, within rounding
  while (z_um > end_um) {
    const double next_um = std::max(z_um - std::max(-field / slope_max, kScanStepMin_um), end_um);
    const double next = column.field(next_um);
    if (next >= 0.0) return refined_um(column, next_um, next, z_um, field);
    z_um = next_um;
    field = next;
  }
  // At the upper end of the certain inside, rounding may leave f a hair below zero.
  return peak > bound ? end_um : floor_um;
}

}  // namespace colony
