// maths: the few transcendental functions the engine uses, built from + - * / sqrt alone.
// Why:     the C library's sin, log, pow and so on differ in the last bits between CPUs and versions; these do not.
// Errors:  CHECKed argument ranges. Accuracy: a few units in the last place (tests/unit/maths_test.cpp), not correctly rounded.
// Threads: pure.
#pragma once

namespace colony::maths {

inline constexpr double kPi = 3.14159265358979323846;

struct SinCos {
  double sin = 0.0;
  double cos = 0.0;
};

/// |angle_rad| <= 1e5.
SinCos sincos(double angle_rad);
/// sincos(angle_rad).sin, the same bits, without the other half.
double sine(double angle_rad);
/// x > 0.
double log(double x);
/// |x| <= 700.
double exp(double x);
/// Any finite x.
double cbrt(double x);
/// x in [-1, 1]; result in [0, pi].
double acos(double x);
/// The standard normal distribution function; absolute error below 1e-7 (Abramowitz & Stegun 26.2.17).
double normal_cdf(double z);

}  // namespace colony::maths
