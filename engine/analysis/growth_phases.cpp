#include "engine/analysis/growth_phases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/analysis/line_fit.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

Error wrong(ErrorCode code, const std::string& message) { return {code, "series: " + message, {{"series", message}}}; }

enum Phase { kExponential, kLinear, kPlateau };

/// Sums up to each row, from which the squared deviations of any stretch follow at once.
class Stretches {
 public:
  explicit Stretches(std::span<const GrowthPoint> series) : sums_(series.size() + 1) {
    const double middle = (series.front().time_h + series.back().time_h) / 2.0;
    const double half = std::max((series.back().time_h - series.front().time_h) / 2.0, 1e-9);
    const double log_first = maths::log(series.front().size);
    for (std::size_t i = 0; i < series.size(); ++i) {
      const double t = (series[i].time_h - middle) / half, y = maths::log(series[i].size) - log_first;
      // sqrt N stands for the radius: one quantity for all phases, or the sums would not be comparable.
      const double radius = std::sqrt(series[i].size), weight = 4.0 / (radius * radius);
      const std::array<double, kTerms> terms{1.0, t, t * t, y, t * y, y * y, weight, weight * t, weight * t * t,
                                             4.0 / radius, 4.0 * t / radius, 4.0};
      for (std::size_t k = 0; k < kTerms; ++k) sums_[i + 1][k] = sums_[i][k] + terms[k];
    }
  }

  /// Of rows [first, end) about the best line or constant.
  double squares(Phase phase, std::size_t first, std::size_t end) const {
    std::array<double, kTerms> s;
    for (std::size_t k = 0; k < kTerms; ++k) s[k] = sums_[end][k] - sums_[first][k];
    if (phase == kPlateau) return std::max(0.0, s[5] - s[3] * s[3] / s[0]);
    if (phase == kExponential) return line(s[0], s[1], s[2], s[3], s[4], s[5]);
    return line(s[6], s[7], s[8], s[9], s[10], s[11]);
  }

 private:
  static constexpr std::size_t kTerms = 12;
  static double line(double w, double t, double tt, double y, double ty, double yy) {
    const double sxx = tt - t * t / w, sxy = ty - t * y / w, syy = yy - y * y / w;
    return std::max(0.0, syy - (sxx > 0.0 ? sxy * sxy / sxx : 0.0));
  }
  std::vector<std::array<double, kTerms>> sums_;
};

struct Choice {
  double bic = std::numeric_limits<double>::infinity();
  double squares = 0.0;
  // Rows [0, first), [first, second), [second, n): exponential, linear, plateau; an empty one is missing.
  std::size_t first = 0, second = 0;
};

void consider(const Stretches& stretches, std::size_t n, std::size_t first, std::size_t second, Choice& best) {
  const std::array<std::size_t, 4> ends{0, first, second, n};
  double squares = 0.0, parameters = 1.0;
  int phases = 0;
  for (std::size_t p = 0; p < 3; ++p) {
    const std::size_t rows = ends[p + 1] - ends[p];
    if (rows == 0) continue;
    if (rows < kPhaseRowsMin) return;
    squares += stretches.squares(static_cast<Phase>(p), ends[p], ends[p + 1]);
    parameters += p == kPlateau ? 1.0 : 2.0;
    ++phases;
  }
  parameters += phases - 1;
  // Perfect data must not divide by nothing: a relative scatter of 1e-8 is as good as none.
  const auto count = static_cast<double>(n);
  const double bic = count * maths::log(std::max(squares / count, 1e-16)) + parameters * maths::log(count);
  if (bic < best.bic) best = {bic, squares, first, second};
}

double widening(const LineFit& fit) {
  const double r = std::clamp(fit.lag1, 0.0, 0.95);
  return std::sqrt((1.0 + r) / (1.0 - r));
}

GrowthPhase line_phase(std::span<const GrowthPoint> rows, bool exponential) {
  std::vector<double> t, y;
  for (const GrowthPoint& row : rows) {
    t.push_back(row.time_h);
    y.push_back(exponential ? maths::log(row.size) : row.radius_um);
  }
  const LineFit fit = fit_line(t, y);
  const double reach = student_t_two_sided(0.05, rows.size() - 2) * fit.slope_se * widening(fit);
  GrowthPhase phase{rows.front().time_h, rows.back().time_h, rows.size(), fit.slope,
                    {fit.slope - reach, fit.slope + reach}, fit.r2};
  if (!exponential) return phase;
  const double ln2 = maths::log(2.0), infinite = std::numeric_limits<double>::infinity();
  const Interval slope = phase.interval;
  phase.value = fit.slope != 0.0 ? ln2 / fit.slope : infinite;
  // A slope that may be 0 or less leaves the doubling time without an upper bound.
  phase.interval.low = slope.high > 0.0 ? ln2 / slope.high : -infinite;
  phase.interval.high = slope.low > 0.0 ? ln2 / slope.low : infinite;
  if (slope.high < 0.0) phase.interval = {ln2 / slope.high, ln2 / slope.low};
  return phase;
}

/// A stretch of constant size: the plateau, and a lag.
GrowthPhase plateau_phase(std::span<const GrowthPoint> rows) {
  const auto n = static_cast<double>(rows.size());
  double mean = 0.0, squares = 0.0, products = 0.0;
  for (const GrowthPoint& row : rows) mean += row.size / n;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    squares += (rows[i].size - mean) * (rows[i].size - mean);
    if (i > 0) products += (rows[i].size - mean) * (rows[i - 1].size - mean);
  }
  LineFit residuals;
  residuals.lag1 = squares > 0.0 ? products / squares : 0.0;
  const double reach = student_t_two_sided(0.05, rows.size() - 1) * std::sqrt(squares / (n - 1.0) / n) * widening(residuals);
  return {rows.front().time_h, rows.back().time_h, rows.size(), mean, {mean - reach, mean + reach}, 0.0};
}

}  // namespace

Result<GrowthPhases> growth_phases(std::span<const GrowthPoint> series) {
  const std::size_t n = series.size();
  if (n < kPhaseRowsMin) {
    return wrong(ErrorCode::kInvalid, std::to_string(n) + " rows; at least " + std::to_string(kPhaseRowsMin) + " are needed");
  }
  if (n > kSeriesRowsMax) {
    return wrong(ErrorCode::kLimit, std::to_string(n) + " rows; at most " + std::to_string(kSeriesRowsMax) + " (take every n-th)");
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::string row = "row " + std::to_string(i);
    // Written so that NaN is refused.
    if (!(std::abs(series[i].time_h) <= 1e9)) return wrong(ErrorCode::kInvalid, row + ": the time is no time");
    if (i > 0 && !(series[i].time_h > series[i - 1].time_h)) return wrong(ErrorCode::kInvalid, row + ": times must rise");
    if (!(series[i].size > 0.0 && series[i].size <= 1e15)) return wrong(ErrorCode::kInvalid, row + ": the size must be above 0");
    if (!(series[i].radius_um > 1e-6 && series[i].radius_um <= 1e9)) {
      return wrong(ErrorCode::kInvalid, row + ": the radius must be above 0");
    }
  }
  const Stretches stretches(series);
  Choice best;
  for (std::size_t first = 0; first <= n; ++first) {
    for (std::size_t second = first; second <= n; ++second) consider(stretches, n, first, second, best);
  }
  GrowthPhases phases;
  phases.bic = best.bic;
  phases.relative_sd = std::sqrt(best.squares / static_cast<double>(n));
  if (best.first > 0) {
    const GrowthPhase phase = line_phase(series.subspan(0, best.first), true);
    // An interval with 0 in it is one of a doubling time without an upper bound.
    if (std::isfinite(phase.value) && std::isfinite(phase.interval.high)) {
      phases.exponential = phase;
    } else {
      phases.lag = plateau_phase(series.subspan(0, best.first));
    }
  }
  if (best.second > best.first) phases.linear_radius = line_phase(series.subspan(best.first, best.second - best.first), false);
  if (best.second < n) phases.plateau = plateau_phase(series.subspan(best.second));
  return phases;
}

Result<GrowthPhases> growth_phases(std::span<const SeriesRow> series) {
  if (series.size() > kSeriesRowsMax) {
    return wrong(ErrorCode::kLimit, std::to_string(series.size()) + " rows; at most " + std::to_string(kSeriesRowsMax));
  }
  std::vector<GrowthPoint> points;
  for (const SeriesRow& row : series) points.push_back({row.time_h, static_cast<double>(row.cell_count), row.radius_um});
  return growth_phases(points);
}

}  // namespace colony
