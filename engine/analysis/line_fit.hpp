// line_fit: ordinary least squares of y on x, a line and a parabola, with standard errors; Student's t and chi-square tails.
// Method:  sums about the means, in index order.
// Errors:  CHECKs the number of points and that the x differ.
// Accuracy: t quantiles to 1e-6 (bisection on the exact integral); tails to 1e-7 (the normal distribution function's).
// Threads: pure.
#pragma once

#include <cstddef>
#include <span>

namespace colony {

struct LineFit {
  std::size_t point_count = 0;
  double slope = 0.0, slope_se = 0.0;
  double intercept = 0.0, intercept_se = 0.0;
  double r2 = 0.0;               // 1 where y does not vary at all
  double residual_sd = 0.0;      // sqrt(residual sum of squares / (n - 2))
  double lag1 = 0.0;             // autocorrelation of neighbouring residuals, 0 where there are none
};

/// At least 3 points, x not all equal.
LineFit fit_line(std::span<const double> x, std::span<const double> y);

struct ParabolaFit {
  double curvature = 0.0;        // c of y = a + b (x - mean) + c (x - mean)^2
  double curvature_se = 0.0;
  double residual_sd = 0.0;      // sqrt(residual sum of squares / (n - 3))
};

/// At least 4 points, at least 3 different x.
ParabolaFit fit_parabola(std::span<const double> x, std::span<const double> y);

/// t with P(|T| > t) = alpha for `degrees` >= 1 degrees of freedom, alpha in [1e-6, 0.5].
double student_t_two_sided(double alpha, std::size_t degrees);

/// P(chi-square > x) for 1 <= degrees <= 100.
double chi_square_tail(double x, std::size_t degrees);

}  // namespace colony
