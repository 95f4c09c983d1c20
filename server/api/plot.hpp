// plot: the plots of a figure: box counts over box sides with fitted lines, their slopes, and a legend.
// Method:  both axes logarithmic, slopes on a plain one; ticks at 1, 2 and 5 times powers of ten. A curve has one colour, its legend's too.
// Units:   pixels of the canvas; box sides in pixels of what was counted.
// Errors:  none.     Threads: a canvas is one thread's.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "engine/analysis/canvas.hpp"
#include "engine/analysis/report.hpp"

namespace colony::server::api {

inline constexpr Ink kBlackInk{0, 0, 0}, kAxisInk{0x40, 0x40, 0x40}, kGridInk{0xe6, 0xe6, 0xe6}, kBandInk{0xf1, 0xf4, 0xf9}, kOutlineInk{0x1f, 0x77, 0xb4};
inline constexpr double kLegendRow_px = 26;

struct Panel {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
};

/// printf for what fits a line of a figure.
template <class... Values>
std::string format(const char* form, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, form, values...);
  return text;
}

/// A line that was counted: all its boxes, and the fit over those that are compared. `all` has dimensions.
struct Curve {
  std::string name;
  const MeasuredLine* all = nullptr;
  const MeasuredLine* compared = nullptr;
  Ink ink;
  bool is_control = false;
  bool is_dashed = false;  // drawn last: it may lie on another curve, which then shows between its dashes
};

/// 1, 2 or 5 times a power of ten, at most `most`, from 1e-6 on.
double round_length(double most);

/// 1, 2, 5, 10, ... within [low, high], rising; only powers of ten where it is long.
std::vector<double> ticks(double low, double high);

/// Multiples of 0.1 or, where it is long, 0.2 or 0.5 within [low, high], for slopes; none beyond 30 of them from 0.
std::vector<double> slope_ticks(double low, double high);

/// Logarithmic both ways. `take` widens them to a curve.
struct Axes {
  double x_low = 1e300, x_high = 0.0, y_low = 1e300, y_high = 0.0;

  void take(const Curve& curve);
  double x(const Panel& panel, double side) const;
  double y(const Panel& panel, double count) const;
};

struct SlopeRange {
  double low = 0.95, high = 1.05;
  void take(const Curve& curve);
  double y(const Panel& panel, double slope) const;
};

void draw_frame(Canvas& canvas, const Panel& panel);
void draw_counts(Canvas& canvas, const Panel& panel, const Axes& axes, const std::vector<Curve>& curves);
void draw_slopes(Canvas& canvas, const Panel& panel, const Axes& axes, const SlopeRange& range, const std::vector<Curve>& curves);
/// Below a plot, since its curves may run anywhere in it: a row of kLegendRow_px a curve, and one more. The panel's height does not count.
void draw_legend(Canvas& canvas, const Panel& panel, const std::vector<Curve>& curves);

}  // namespace colony::server::api
