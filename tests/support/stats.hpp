// stats: means with standard errors, straight-line fits and whole distributions, for tests that assert a figure with its interval.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace colony::testing {

struct Mean {
  double value = 0.0;
  double se = 0.0;  // standard error of the mean
};

inline Mean mean_of(const std::vector<double>& x) {
  Mean mean;
  const auto n = static_cast<double>(x.size());
  for (const double v : x) mean.value += v / n;
  double squares = 0.0;
  for (const double v : x) squares += (v - mean.value) * (v - mean.value);
  mean.se = x.size() > 1 ? std::sqrt(squares / (n - 1.0) / n) : 0.0;
  return mean;
}

struct Line {
  double intercept = 0.0;
  double slope = 0.0;
  double slope_se = 0.0;
  double r2 = 0.0;
};

/// Ordinary least squares of y on x.
inline Line fit_line(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mx = 0.0, my = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  double sxx = 0.0, sxy = 0.0, syy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sxx += (x[i] - mx) * (x[i] - mx);
    sxy += (x[i] - mx) * (y[i] - my);
    syy += (y[i] - my) * (y[i] - my);
  }
  Line line;
  line.slope = sxy / sxx;
  line.intercept = my - line.slope * mx;
  const double residual = syy - line.slope * sxy;
  line.slope_se = n > 2 ? std::sqrt((residual > 0.0 ? residual : 0.0) / (n - 2.0) / sxx) : 0.0;
  line.r2 = syy > 0.0 ? 1.0 - residual / syy : 1.0;
  return line;
}

/// The value below which a share `p` in [0, 1] of the sample lies, interpolated between order statistics. Not of an empty sample.
inline double quantile(std::vector<double> x, double p) {
  std::sort(x.begin(), x.end());
  const double place = p * static_cast<double>(x.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, x.size() - 1);
  return x[below] + (place - static_cast<double>(below)) * (x[above] - x[below]);
}

/// Kolmogorov and Smirnov: the largest distance between the distribution functions of two samples. Equal values step together.
inline double ks_distance(std::vector<double> a, std::vector<double> b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  double distance = 0.0;
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    const double x = std::min(a[i], b[j]);
    while (i < a.size() && a[i] == x) ++i;
    while (j < b.size() && b[j] == x) ++j;
    const double of_a = static_cast<double>(i) / static_cast<double>(a.size()), of_b = static_cast<double>(j) / static_cast<double>(b.size());
    distance = std::max(distance, std::abs(of_a - of_b));
  }
  return distance;
}

/// What that distance exceeds once in a hundred times between independent samples of one law: sqrt(-ln(0.01 / 2) / 2) = 1.628 of
/// sqrt(1/n + 1/m) (Smirnov 1948). Pairs that go up and down together stay below it more often still.
inline double ks_bound(std::size_t n, std::size_t m) {
  return 1.628 * std::sqrt(1.0 / static_cast<double>(n) + 1.0 / static_cast<double>(m));
}

/// Pearson's statistic against equal expectations.
inline double chi_square_uniform(const std::vector<double>& counts) {
  double total = 0.0;
  for (const double c : counts) total += c;
  const double expected = total / static_cast<double>(counts.size());
  double sum = 0.0;
  for (const double c : counts) sum += (c - expected) * (c - expected) / expected;
  return sum;
}

/// A bound that chi-square with that many degrees of freedom exceeds with probability below 1e-6 (Wilson-Hilferty, z
/// = 4.9).
inline double chi_square_bound(std::size_t degrees) {
  const auto k = static_cast<double>(degrees);
  const double t = 1.0 - 2.0 / (9.0 * k) + 4.9 * std::sqrt(2.0 / (9.0 * k));
  return k * t * t * t;
}

}  // namespace colony::testing
