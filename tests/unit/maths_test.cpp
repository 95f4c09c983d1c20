// The engine's own functions against the C library's in long double (64-bit mantissa), with stated bounds in units in
// the last place.
#include "engine/base/maths.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "tests/support/bodies.hpp"

namespace colony {
namespace {

constexpr int kDraws = 50'000;

double ulps(double got, long double expected) {
  const auto rounded = static_cast<double>(expected);
  const double next = std::nextafter(std::abs(rounded), std::numeric_limits<double>::infinity());
  const long double ulp = static_cast<long double>(next) - static_cast<long double>(std::abs(rounded));
  return static_cast<double>(std::abs(static_cast<long double>(got) - expected) / ulp);
}

template <class Ours, class Exact, class Draw>
double worst_ulps(Ours&& ours, Exact&& exact, Draw&& draw) {
  Stream stream = testing::case_stream(1);
  double worst = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = draw(stream);
    worst = std::max(worst, ulps(ours(x), exact(static_cast<long double>(x))));
  }
  return worst;
}

TEST(Maths, SineAndCosineAreWithinTwoUlpAndThreeAtTheEndOfTheRange) {
  for (const double range : {0.1, 1.0, 10.0, 1e3, 1e5}) {
    const double bound = range > 1e3 ? 3.0 : 2.0;  // the reduction adds its own rounding
    const auto draw = [&](Stream& s) { return s.uniform({-range, range}); };
    EXPECT_LE(worst_ulps([](double x) { return maths::sincos(x).sin; }, [](long double x) { return sinl(x); }, draw),
              bound)
        << range;
    EXPECT_LE(worst_ulps([](double x) { return maths::sincos(x).cos; }, [](long double x) { return cosl(x); }, draw),
              bound)
        << range;
  }
}

TEST(Maths, SineAndCosineAreExactAtZeroAndCloseAtMultiplesOfHalfPi) {
  EXPECT_EQ(maths::sincos(0.0).sin, 0.0);
  EXPECT_EQ(maths::sincos(0.0).cos, 1.0);
  for (int k = -1000; k <= 1000; ++k) {
    if (k == 0) continue;
    const double x = k * (maths::kPi / 2.0);
    const auto [s, c] = maths::sincos(x);
    EXPECT_LE(ulps(s, sinl(static_cast<long double>(x))), 2.0) << k;
    EXPECT_LE(ulps(c, cosl(static_cast<long double>(x))), 2.0) << k;
  }
}

TEST(Maths, LogarithmIsWithinTwoUlp) {
  const auto ours = [](double x) { return maths::log(x); };
  const auto exact = [](long double x) { return logl(x); };
  EXPECT_LE(worst_ulps(ours, exact,
                       [](Stream& s) { return std::ldexp(1.0 + s.uniform(), static_cast<int>(s.below(2000)) - 1000); }),
            2.0);
  EXPECT_LE(worst_ulps(ours, exact, [](Stream& s) { return 0.5 + s.uniform(); }), 2.0);  // cancellation near 1
  EXPECT_LE(worst_ulps(ours, exact, [](Stream& s) { return 1.0 + (s.uniform() - 0.5) * 1e-6; }), 2.0);
  EXPECT_LE(
      worst_ulps(ours, exact,
                 [](Stream& s) { return (1.0 + static_cast<double>(s.below(1U << 30))) * 4.9406564584124654e-324; }),
      2.0);
  EXPECT_EQ(maths::log(1.0), 0.0);
}

TEST(Maths, ExponentialIsWithinTwoUlp) {
  const auto ours = [](double x) { return maths::exp(x); };
  const auto exact = [](long double x) { return expl(x); };
  for (const double range : {1e-3, 1.0, 30.0, 700.0}) {
    EXPECT_LE(worst_ulps(ours, exact, [&](Stream& s) { return s.uniform({-range, range}); }), 2.0) << range;
  }
  EXPECT_EQ(maths::exp(0.0), 1.0);
}

TEST(Maths, CubeRootIsWithinTwoUlpAndExactOnCubes) {
  const auto ours = [](double x) { return maths::cbrt(x); };
  const auto exact = [](long double x) { return cbrtl(x); };
  EXPECT_LE(worst_ulps(ours, exact, [](Stream& s) { return s.uniform({-1000.0, 1000.0}); }), 2.0);
  EXPECT_LE(worst_ulps(ours, exact,
                       [](Stream& s) { return std::ldexp(1.0 + s.uniform(), static_cast<int>(s.below(2040)) - 1020); }),
            2.0);
  EXPECT_LE(
      worst_ulps(ours, exact,
                 [](Stream& s) { return (1.0 + static_cast<double>(s.below(1U << 30))) * 4.9406564584124654e-324; }),
      2.0);
  for (int k = -100; k <= 100; ++k) EXPECT_EQ(maths::cbrt(static_cast<double>(k) * k * k), k);
}

TEST(Maths, ArcCosineIsWithinSixUlpAlsoNearPlusAndMinusOne) {
  const auto ours = [](double x) { return maths::acos(x); };
  const auto exact = [](long double x) { return acosl(x); };
  EXPECT_LE(worst_ulps(ours, exact, [](Stream& s) { return s.uniform({-1.0, 1.0}); }), 6.0);
  EXPECT_LE(worst_ulps(ours, exact, [](Stream& s) { return 1.0 - 1e-9 * s.uniform(); }), 6.0);
  EXPECT_LE(worst_ulps(ours, exact, [](Stream& s) { return -1.0 + 1e-9 * s.uniform(); }), 6.0);
  EXPECT_EQ(maths::acos(1.0), 0.0);
  EXPECT_EQ(maths::acos(-1.0), maths::kPi);
}

TEST(Maths, NormalDistributionFunctionIsWithin1e7AndSymmetric) {
  for (double z = -40.0; z <= 40.0; z += 0.01) {
    const auto exact = static_cast<double>(0.5L * erfcl(-static_cast<long double>(z) / sqrtl(2.0L)));
    EXPECT_NEAR(maths::normal_cdf(z), exact, 1e-7) << z;
    EXPECT_NEAR(maths::normal_cdf(z) + maths::normal_cdf(-z), 1.0, 1e-15) << z;
  }
}

TEST(Maths, ArgumentsOutsideTheDomainFailACheck) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double x : {nan, inf, -inf, 1.00001e5, -1.00001e5}) EXPECT_THROW(maths::sincos(x), CheckFailure) << x;
  for (const double x : {nan, inf, -inf, 0.0, -1.0}) EXPECT_THROW(maths::log(x), CheckFailure) << x;
  for (const double x : {nan, inf, -inf, 700.001, -700.001}) EXPECT_THROW(maths::exp(x), CheckFailure) << x;
  for (const double x : {nan, inf, -inf}) EXPECT_THROW(maths::cbrt(x), CheckFailure) << x;
  for (const double x : {nan, inf, 1.0000001, -1.0000001}) EXPECT_THROW(maths::acos(x), CheckFailure) << x;
}

TEST(Check, FailureNamesConditionPlaceAndContextsFromOuterToInner) {
  const FailureContext outer("job 7");
  const FailureContext inner("seq 12");
  try {
    CHECK(1 + 1 == 3);
    FAIL() << "the check passed";
  } catch (const CheckFailure& failure) {
    const std::string text = failure.what();
    EXPECT_NE(text.find("1 + 1 == 3"), std::string::npos) << text;
    EXPECT_NE(text.find("; job 7; seq 12"), std::string::npos) << text;
  }
}

TEST(Maths, SineIsTheSineOfSincosToTheLastBit) {
  for (int i = -20'000; i <= 20'000; ++i) {
    const double x = 0.0137 * i;
    ASSERT_EQ(std::bit_cast<std::uint64_t>(maths::sine(x)), std::bit_cast<std::uint64_t>(maths::sincos(x).sin)) << x;
  }
}

}  // namespace
}  // namespace colony
