#include "engine/base/maths.hpp"

#include <bit>
#include <cmath>
#include <cstdint>

#include "engine/base/check.hpp"

namespace colony::maths {
namespace {

// Taylor series on |r| <= pi/4; the first neglected term is below 1e-19.
double sin_series(double r) {
  const double r2 = r * r;
  double sum = 1.0 / 355687428096000.0;  // 1/17!
  sum = sum * r2 - 1.0 / 1307674368000.0;
  sum = sum * r2 + 1.0 / 6227020800.0;
  sum = sum * r2 - 1.0 / 39916800.0;
  sum = sum * r2 + 1.0 / 362880.0;
  sum = sum * r2 - 1.0 / 5040.0;
  sum = sum * r2 + 1.0 / 120.0;
  sum = sum * r2 - 1.0 / 6.0;
  return r + r * r2 * sum;
}

double cos_series(double r) {
  const double r2 = r * r;
  double sum = 1.0 / 20922789888000.0;  // 1/16!
  sum = sum * r2 - 1.0 / 87178291200.0;
  sum = sum * r2 + 1.0 / 479001600.0;
  sum = sum * r2 - 1.0 / 3628800.0;
  sum = sum * r2 + 1.0 / 40320.0;
  sum = sum * r2 - 1.0 / 720.0;
  sum = sum * r2 + 1.0 / 24.0;
  return 1.0 - 0.5 * r2 + r2 * r2 * sum;
}

// pi/2 in three parts of 33 bits, 33 bits and the rest: products with a small integer are exact (fdlibm's split).
constexpr double kHalfPiHigh = 1.57079632673412561417e+00;
constexpr double kHalfPiMiddle = 6.07710050630396597660e-11;
constexpr double kHalfPiLow = 2.02226624879595063154e-21;

// The nearest integer, without the C library's floor (SSE2 has none). |x| < 2^62.
double nearest(double x) { return static_cast<double>(static_cast<std::int64_t>(x < 0.0 ? x - 0.5 : x + 0.5)); }

constexpr double kLn2High = 6.93147180369123816490e-01;
constexpr double kLn2Low = 1.90821492927058770002e-10;

}  // namespace

namespace {

struct Reduced {
  double r = 0.0;             // within pi/4 of 0
  std::int64_t quadrant = 0;  // 0..3
};

Reduced reduce(double angle_rad) {
  CHECK(angle_rad >= -1e5 && angle_rad <= 1e5);
  const double quarter = nearest(angle_rad * (2.0 / kPi));
  const double r = ((angle_rad - quarter * kHalfPiHigh) - quarter * kHalfPiMiddle) - quarter * kHalfPiLow;
  return {r, static_cast<std::int64_t>(quarter) & 3};
}

}  // namespace

double sine(double angle_rad) {
  const Reduced reduced = reduce(angle_rad);
  const double value = (reduced.quadrant & 1) != 0 ? cos_series(reduced.r) : sin_series(reduced.r);
  return (reduced.quadrant & 2) != 0 ? -value : value;
}

SinCos sincos(double angle_rad) {
  const Reduced reduced = reduce(angle_rad);
  const double s = sin_series(reduced.r);
  const double c = cos_series(reduced.r);
  switch (reduced.quadrant) {
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}

double log(double x) {
  CHECK(x > 0.0 && x <= 1.7976931348623157e308);
  int shift = 0;
  if (x < 2.2250738585072014e-308) {  // subnormal: scale up by an exact power of two
    x *= 18014398509481984.0;         // 2^54
    shift = -54;
  }
  std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  int exponent = static_cast<int>(bits >> 52) - 1023 + shift;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
  if (m > 1.41421356237309504880) {
    m *= 0.5;
    exponent += 1;
  }
  // log m = 2 artanh(t), t = (m - 1)/(m + 1), |t| <= 0.1716: the series in t^2 to t^21.
  const double t = (m - 1.0) / (m + 1.0);
  const double t2 = t * t;
  double sum = 1.0 / 21.0;
  for (int k = 19; k >= 3; k -= 2) sum = sum * t2 + 1.0 / k;
  const double tail = 2.0 * t * t2 * sum;
  return exponent * kLn2High + (exponent * kLn2Low + (2.0 * t + tail));
}

double exp(double x) {
  CHECK(x >= -700.0 && x <= 700.0);
  const double k = nearest(x / (kLn2High + kLn2Low));
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1.0;
  for (int n = 18; n >= 1; --n) sum = 1.0 + sum * r / n;
  const auto exponent = static_cast<std::int64_t>(k) + 1023;
  return sum * std::bit_cast<double>(static_cast<std::uint64_t>(exponent) << 52);
}

double cbrt(double x) {
  CHECK(x >= -1.7976931348623157e308 && x <= 1.7976931348623157e308);
  if (x == 0.0) return 0.0;
  double a = x < 0.0 ? -x : x;
  double unscale = 1.0;
  if (a < 2.2250738585072014e-308) {  // subnormal: scale up by an exact power of eight, the root by that of two
    a *= 18014398509481984.0;         // 2^54
    unscale = 3.814697265625e-06;     // 2^-18
  }
  // x = m * 8^k with m in [1, 8): Newton's iteration converges from 1.5 in six rounds; two more settle the last bits.
  const int exponent = static_cast<int>(std::bit_cast<std::uint64_t>(a) >> 52) - 1023;
  const int k = exponent >= 0 ? exponent / 3 : -((-exponent + 2) / 3);
  const auto power_of_two = [](int e) { return std::bit_cast<double>(static_cast<std::uint64_t>(e + 1023) << 52); };
  const double m = a * power_of_two(-2 * k) * power_of_two(-k);  // two steps: 2^(-3k) alone may be subnormal
  double y = 1.5;
  for (int round = 0; round < 8; ++round) y = (2.0 * y + m / (y * y)) / 3.0;
  const double root = y * power_of_two(k) * unscale;
  return x < 0.0 ? -root : root;
}

double acos(double x) {
  CHECK(x >= -1.0 && x <= 1.0);
  if (x < 0.0) return kPi - acos(-x);
  // acos x = 2 asin(sqrt((1 - x)/2)): the argument is at most sqrt(1/2). The half-angle formula asin s = 2 asin(s') with
  // s' = s / sqrt(2 (1 + sqrt(1 - s^2))) is applied twice, so that the series in s'^2 <= 0.0381 is short.
  double s = std::sqrt((1.0 - x) * 0.5);
  for (int round = 0; round < 2; ++round) s = s / std::sqrt(2.0 * (1.0 + std::sqrt(1.0 - s * s)));
  const double s2 = s * s;
  // asin s = sum (2n)! / (4^n n!^2 (2n + 1)) s^(2n+1), by its ratio.
  double term = s;
  double sum = s;
  for (int n = 1; n <= 12; ++n) {
    term *= s2 * (2 * n - 1) / (2 * n);
    sum += term / (2 * n + 1);
  }
  return 8.0 * sum;
}

double normal_cdf(double z) {
  const double a = z < 0.0 ? -z : z;
  if (a > 37.0) return z < 0.0 ? 0.0 : 1.0;
  const double t = 1.0 / (1.0 + 0.2316419 * a);
  const double series =
      t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))));
  const double tail = 0.39894228040143267794 * exp(-0.5 * a * a) * series;
  return z < 0.0 ? tail : 1.0 - tail;
}

}  // namespace colony::maths
