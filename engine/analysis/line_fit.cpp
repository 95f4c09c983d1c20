#include "engine/analysis/line_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

double mean_of(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

}  // namespace

LineFit fit_line(std::span<const double> x, std::span<const double> y) {
  CHECK(x.size() == y.size() && x.size() >= 3);
  const auto n = static_cast<double>(x.size());
  const double mean_x = mean_of(x), mean_y = mean_of(y);
  double sxx = 0.0, sxy = 0.0, syy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sxx += (x[i] - mean_x) * (x[i] - mean_x);
    sxy += (x[i] - mean_x) * (y[i] - mean_y);
    syy += (y[i] - mean_y) * (y[i] - mean_y);
  }
  CHECK(sxx > 0.0);
  LineFit fit;
  fit.point_count = x.size();
  fit.slope = sxy / sxx;
  fit.intercept = mean_y - fit.slope * mean_x;
  // The residuals themselves: syy - slope sxy cancels to nothing on a good line.
  double squares = 0.0, products = 0.0, before = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double residual = (y[i] - mean_y) - fit.slope * (x[i] - mean_x);
    squares += residual * residual;
    if (i > 0) products += residual * before;
    before = residual;
  }
  fit.residual_sd = std::sqrt(squares / (n - 2.0));
  fit.slope_se = fit.residual_sd / std::sqrt(sxx);
  fit.intercept_se = fit.residual_sd * std::sqrt(1.0 / n + mean_x * mean_x / sxx);
  fit.r2 = syy > 0.0 ? 1.0 - squares / syy : 1.0;
  fit.lag1 = squares > 0.0 ? products / squares : 0.0;
  return fit;
}

ParabolaFit fit_parabola(std::span<const double> x, std::span<const double> y) {
  CHECK(x.size() == y.size() && x.size() >= 4);
  const auto n = static_cast<double>(x.size());
  const LineFit line = fit_line(x, y);
  const double mean_x = mean_of(x), mean_y = mean_of(y);
  // The square, made orthogonal to the constant and to x: then its coefficient is that of a line through the residuals.
  std::vector<double> square(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) square[i] = (x[i] - mean_x) * (x[i] - mean_x);
  const LineFit of_square = fit_line(x, square);
  const double mean_square = mean_of(square);
  double szz = 0.0, szr = 0.0, srr = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double z = (square[i] - mean_square) - of_square.slope * (x[i] - mean_x);
    const double r = (y[i] - mean_y) - line.slope * (x[i] - mean_x);
    szz += z * z;
    szr += z * r;
    srr += r * r;
  }
  CHECK(szz > 0.0);
  ParabolaFit fit;
  fit.curvature = szr / szz;
  fit.residual_sd = std::sqrt(std::max(0.0, srr - fit.curvature * szr) / (n - 3.0));
  fit.curvature_se = fit.residual_sd / std::sqrt(szz);
  return fit;
}

double student_t_two_sided(double alpha, std::size_t degrees) {
  CHECK(alpha >= 1e-6 && alpha <= 0.5 && degrees >= 1);
  // With t = sqrt(d) tan(theta), P(|T| < t) is the integral of cos^(d-1) from 0 to theta over that to pi/2: finite sums by parts
  // (Abramowitz & Stegun 26.7.3, 26.7.4). Here in terms of sine and cosine, which bisection moves.
  const auto inside = [degrees](double theta) {
    const maths::SinCos turn = maths::sincos(theta);
    const double cos2 = turn.cos * turn.cos;
    double term, sum = 0.0;
    if (degrees % 2 == 0) {
      term = turn.sin;
      for (std::size_t k = 0; k < degrees / 2; ++k) {
        sum += term;
        term *= cos2 * static_cast<double>(2 * k + 1) / static_cast<double>(2 * k + 2);
      }
      return sum;
    }
    term = turn.sin * turn.cos;
    for (std::size_t k = 0; k < (degrees - 1) / 2; ++k) {
      sum += term;
      term *= cos2 * static_cast<double>(2 * k + 2) / static_cast<double>(2 * k + 3);
    }
    return 2.0 / maths::kPi * (theta + sum);
  };
  double low = 0.0, high = maths::kPi / 2.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2.0;
    (inside(middle) < 1.0 - alpha ? low : high) = middle;
  }
  const maths::SinCos turn = maths::sincos(low);
  return std::sqrt(static_cast<double>(degrees)) * turn.sin / turn.cos;
}

double chi_square_tail(double x, std::size_t degrees) {
  CHECK(degrees >= 1 && degrees <= 100);
  if (!(x > 0.0)) return 1.0;
  if (x > 1000.0) return 0.0;
  // Abramowitz & Stegun 26.4.4 and 26.4.5: finite sums.
  const double root = std::sqrt(x);
  double term, sum = 0.0;
  if (degrees % 2 == 0) {
    term = maths::exp(-x / 2.0);
    for (std::size_t k = 1; k <= degrees / 2; ++k) {
      sum += term;
      term *= x / static_cast<double>(2 * k);
    }
    return std::min(1.0, sum);
  }
  term = 2.0 * maths::exp(-x / 2.0) / std::sqrt(2.0 * maths::kPi) * root;
  for (std::size_t k = 1; k <= (degrees - 1) / 2; ++k) {
    sum += term;
    term *= x / static_cast<double>(2 * k + 1);
  }
  return std::min(1.0, 2.0 * maths::normal_cdf(-root) + sum);
}

}  // namespace colony
