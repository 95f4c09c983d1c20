#include "server/api/plot.hpp"

#include <algorithm>
#include <cmath>

namespace colony::server::api {
namespace {

/// The range that is compared, as a band, and the ticks of the box sides.
void draw_sides(Canvas& canvas, const Panel& panel, const Axes& axes, const Curve* compared) {
  if (compared != nullptr) {
    const BoxDimensions& found = *compared->compared->dimensions;
    const double from = axes.x(panel, static_cast<double>(found.side_min_px)), to = axes.x(panel, static_cast<double>(found.side_max_px));
    canvas.box({from, panel.y}, to - from, panel.height, kBandInk, true);
  }
  for (const double side : ticks(axes.x_low, axes.x_high)) {
    const double x = axes.x(panel, side);
    canvas.line({x, panel.y}, {x, panel.y + panel.height}, kGridInk);
    canvas.text({x, panel.y + panel.height + 24.0}, format("%.0f", side), kAxisInk, Align::kCentre);
  }
}

}  // namespace

double round_length(double most) {
  double best = 1e-9;
  for (double decade = 1e-6; decade < 1e9; decade *= 10.0) {
    for (const double digit : {1.0, 2.0, 5.0}) best = digit * decade <= most ? digit * decade : best;
  }
  return best;
}

std::vector<double> ticks(double low, double high) {
  std::vector<double> all;
  const bool is_long = high / low > 2000.0;
  for (double decade = 1e-3; decade <= high; decade *= 10.0) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = digit * decade;
      if (value >= low && value <= high && (digit == 1.0 || !is_long)) all.push_back(value);
    }
  }
  return all;
}

std::vector<double> slope_ticks(double low, double high) {
  std::vector<double> all;
  const double step = high - low > 2.0 ? 0.5 : high - low > 0.6 ? 0.2 : 0.1;
  for (int k = 0; k <= 30; ++k) {
    const double slope = step * k;
    if (slope >= low && slope <= high) all.push_back(slope);
  }
  return all;
}

void Axes::take(const Curve& curve) {
  for (const BoxCount& count : curve.all->dimensions->counts) {
    const auto side = static_cast<double>(count.side_px);
    x_low = std::min(x_low, side);
    x_high = std::max(x_high, side);
    y_low = std::min(y_low, count.count_mean);
    y_high = std::max(y_high, count.count_mean);
  }
}
double Axes::x(const Panel& panel, double side) const { return panel.x + std::log(side / x_low) / std::log(x_high / x_low) * panel.width; }
double Axes::y(const Panel& panel, double count) const {
  return panel.y + panel.height - std::log(count / y_low) / std::log(y_high / y_low) * panel.height;
}

void SlopeRange::take(const Curve& curve) {
  for (const LocalSlope& slope : windowed_slopes(*curve.all->dimensions)) {
    low = std::min(low, slope.dimension - 0.05);
    high = std::max(high, slope.dimension + 0.05);
  }
}
double SlopeRange::y(const Panel& panel, double slope) const {
  return panel.y + panel.height - (slope - low) / (high - low) * panel.height;
}

void draw_frame(Canvas& canvas, const Panel& panel) { canvas.box({panel.x, panel.y}, panel.width, panel.height, kAxisInk, false); }

namespace {

/// Along the whole of `points`, so that dashes run over their corners.
void draw_dashed(Canvas& canvas, const std::vector<CanvasPoint>& points, Ink ink) {
  constexpr double kDash_px = 9.0, kPeriod_px = 16.0;
  double walked = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const CanvasPoint a = points[i - 1], b = points[i];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    for (double at = 0.0; at < length;) {
      const double phase = std::fmod(walked + at, kPeriod_px);
      const bool is_dash = phase < kDash_px;
      const double end = std::min(length, at + std::max(0.25, (is_dash ? kDash_px : kPeriod_px) - phase));
      const auto on = [&](double s) { return CanvasPoint{a.x + (b.x - a.x) * s / length, a.y + (b.y - a.y) * s / length}; };
      if (is_dash) canvas.line(on(at), on(end), ink, 2.0);
      at = end;
    }
    walked += length;
  }
}

/// What lies under the curves of either panel. `y`: where a value of `values` stands; `as`: how it is written.
template <class Y>
void draw_grid(Canvas& canvas, const Panel& panel, const Axes& axes, const std::vector<Curve>& curves, const std::vector<double>& values,
               const char* as, Y y) {
  const auto with_fit = std::find_if(curves.begin(), curves.end(), [](const Curve& c) { return !c.is_control && c.compared->dimensions; });
  draw_sides(canvas, panel, axes, with_fit == curves.end() ? nullptr : &*with_fit);
  for (const double value : values) {
    canvas.line({panel.x, y(value)}, {panel.x + panel.width, y(value)}, kGridInk);
    canvas.text({panel.x - 10.0, y(value) + 6.0}, format(as, value), kAxisInk, Align::kRight);
  }
  canvas.text({panel.x + panel.width, panel.y + panel.height + 50.0}, "box side s, px", kAxisInk, Align::kRight);
}

}  // namespace

void draw_counts(Canvas& canvas, const Panel& panel, const Axes& axes, const std::vector<Curve>& curves) {
  draw_grid(canvas, panel, axes, curves, ticks(axes.y_low, axes.y_high), "%.0f", [&](double count) { return axes.y(panel, count); });
  // Controls first: the lines in question lie over them.
  for (const bool is_control : {true, false}) {
    for (const Curve& curve : curves) {
      if (curve.is_control != is_control) continue;
      std::vector<CanvasPoint> points;
      for (const BoxCount& count : curve.all->dimensions->counts) {
        points.push_back({axes.x(panel, static_cast<double>(count.side_px)), axes.y(panel, count.count_mean)});
      }
      if (is_control) {
        if (!curve.is_dashed) canvas.lines(points, curve.ink, 1.5);
        continue;
      }
      if (!curve.compared->dimensions) {
        for (const CanvasPoint& point : points) canvas.dot(point, 4.5, curve.ink, false);
        continue;
      }
      const BoxDimensions& fit = *curve.compared->dimensions;
      double mean_x = 0.0, mean_y = 0.0;  // least squares pass through the means
      for (const BoxCount& count : fit.counts) {
        mean_x += std::log(static_cast<double>(count.side_px)) / static_cast<double>(fit.counts.size());
        mean_y += std::log(count.count_mean) / static_cast<double>(fit.counts.size());
      }
      const auto on_line = [&](std::int64_t side) {
        const double x = std::log(static_cast<double>(side));
        return CanvasPoint{axes.x(panel, static_cast<double>(side)), axes.y(panel, std::exp(mean_y - fit.capacity.value * (x - mean_x)))};
      };
      canvas.line(on_line(fit.side_min_px), on_line(fit.side_max_px), curve.ink, 1.5);
      for (std::size_t i = 0; i < points.size(); ++i) canvas.dot(points[i], 4.5, curve.ink, i < fit.counts.size());
    }
  }
  for (const Curve& curve : curves) {
    if (!curve.is_dashed) continue;
    std::vector<CanvasPoint> points;
    for (const BoxCount& count : curve.all->dimensions->counts) {
      points.push_back({axes.x(panel, static_cast<double>(count.side_px)), axes.y(panel, count.count_mean)});
    }
    draw_dashed(canvas, points, curve.ink);
  }
  draw_frame(canvas, panel);
}

void draw_legend(Canvas& canvas, const Panel& panel, const std::vector<Curve>& curves) {
  double y = panel.y + 16.0;
  const double text_x = panel.x + 52.0, value_x = panel.x + 330.0;
  const BoxDimensions* fitted = nullptr;
  for (const Curve& curve : curves) {
    if (curve.is_dashed) {
      draw_dashed(canvas, {{panel.x, y - 5.0}, {panel.x + 38.0, y - 5.0}}, curve.ink);
    } else {
      canvas.line({panel.x, y - 5.0}, {panel.x + 38.0, y - 5.0}, curve.ink, curve.is_control ? 1.5 : 2.0);
    }
    if (!curve.is_control) canvas.dot({panel.x + 19.0, y - 5.0}, 4.5, curve.ink, true);
    canvas.text({text_x, y}, curve.name, kBlackInk);
    if (curve.compared->dimensions) {
      const Dimension& d0 = curve.compared->dimensions->capacity;
      canvas.text({value_x, y}, format("D0 %.3f +- %.3f, r2 %.3f", d0.value, d0.standard_error, d0.r2), kBlackInk);
      if (!curve.is_control && fitted == nullptr) fitted = &*curve.compared->dimensions;
    } else {
      canvas.text({value_x, y}, "too few box sides in common", kBlackInk);
    }
    y += kLegendRow_px;
  }
  if (fitted == nullptr) return;
  canvas.text({text_x, y}, format("D0 = -slope, fitted for boxes of %.0f to %.0f px (shaded)", static_cast<double>(fitted->side_min_px),
                                  static_cast<double>(fitted->side_max_px)), kAxisInk);
}

void draw_slopes(Canvas& canvas, const Panel& panel, const Axes& axes, const SlopeRange& range, const std::vector<Curve>& curves) {
  draw_grid(canvas, panel, axes, curves, slope_ticks(range.low, range.high), "%.1f", [&](double slope) { return range.y(panel, slope); });
  for (const bool is_control : {true, false}) {
    for (const Curve& curve : curves) {
      if (curve.is_control != is_control) continue;
      std::vector<CanvasPoint> points;
      for (const LocalSlope& slope : windowed_slopes(*curve.all->dimensions)) points.push_back({axes.x(panel, slope.side_px), range.y(panel, slope.dimension)});
      if (!curve.is_dashed) canvas.lines(points, curve.ink, is_control ? 1.5 : 2.0);
      for (const CanvasPoint& point : points) {
        if (!is_control) canvas.dot(point, 3.5, curve.ink, true);
      }
    }
  }
  for (const Curve& curve : curves) {
    if (!curve.is_dashed) continue;
    std::vector<CanvasPoint> points;
    for (const LocalSlope& slope : windowed_slopes(*curve.all->dimensions)) points.push_back({axes.x(panel, slope.side_px), range.y(panel, slope.dimension)});
    draw_dashed(canvas, points, curve.ink);
  }
  draw_frame(canvas, panel);
}

}  // namespace colony::server::api
