// Curves of a page as inline SVG.
#include <algorithm>
#include <cmath>

#include "client/cli/report.hpp"

namespace colony::client {
namespace {

constexpr double kWidth = 640, kHeight = 400, kLeft = 70, kBottom = 50, kTop = 15, kRight = 15;

std::string number(double value, int decimals = 2) { return fixed(value, decimals); }

/// 1, 2 or 5 times a power of ten, so that at most about six fit below `high`.
double tick_step(double high) {
  const double rough = std::max(high, 1e-300) / 6.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= rough) return factor * decade;
  }
  return 10.0 * decade;
}

struct Axis {
  double low = 0, high = 1;
  bool is_logarithmic = false;
  double share(double value) const {
    return is_logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  }
  std::vector<double> ticks() const {
    std::vector<double> out;
    if (is_logarithmic) {
      for (double at = low; at <= high * 1.0001; at *= 10.0) out.push_back(at);
    } else {
      const double step = tick_step(high);
      for (int i = 0; i * step <= high * 1.0001; ++i) out.push_back(i * step);
    }
    return out;
  }
};

Axis axis_of(const std::vector<Curve>& curves, bool is_x, bool is_logarithmic) {
  double least = 1e300, most = 0;
  for (const Curve& curve : curves) {
    for (const auto& [x, y] : curve.points) {
      least = std::min(least, is_x ? x : y);
      most = std::max(most, is_x ? x : y);
    }
  }
  if (!is_logarithmic) return {0, most > 0 ? most * 1.02 : 1, false};
  if (!(least > 0 && least < 1e300)) return {1, 10, true};
  const double low = std::pow(10.0, std::floor(std::log10(least)));
  return {low, std::max(most * 1.1, low * 10), true};
}

}  // namespace

std::string curves_svg(const std::vector<Curve>& curves, const std::string& x_title, const std::string& y_title,
                       bool is_logarithmic) {
  const Axis x = axis_of(curves, true, is_logarithmic), y = axis_of(curves, false, is_logarithmic);
  const auto place_x = [&](double value) { return kLeft + x.share(value) * (kWidth - kLeft - kRight); };
  const auto place_y = [&](double value) { return kHeight - kBottom - y.share(value) * (kHeight - kBottom - kTop); };
  std::string out = "<svg viewBox=\"0 0 " + number(kWidth, 0) + " " + number(kHeight, 0) + "\" width=\"" + number(kWidth, 0) +
                    "\" role=\"img\" font-family=\"sans-serif\" font-size=\"12\">";
  const auto text = [&](double at_x, double at_y, const char* anchor, const std::string& what, const std::string& colour) {
    out += "<text x=\"" + number(at_x, 1) + "\" y=\"" + number(at_y, 1) + "\" text-anchor=\"" + anchor + "\" fill=\"" + colour + "\">" +
           html_text(what) + "</text>";
  };
  const auto line = [&](double x1, double y1, double x2, double y2) {
    out += "<path d=\"M" + number(x1, 1) + " " + number(y1, 1) + "L" + number(x2, 1) + " " + number(y2, 1) + "\" stroke=\"#ddd\"/>";
  };
  for (const double tick : x.ticks()) {
    line(place_x(tick), kTop, place_x(tick), kHeight - kBottom);
    text(place_x(tick), kHeight - kBottom + 16, "middle", number(tick, tick < 1 && tick > 0 ? 2 : 0), "#444");
  }
  for (const double tick : y.ticks()) {
    line(kLeft, place_y(tick), kWidth - kRight, place_y(tick));
    text(kLeft - 6, place_y(tick) + 4, "end", number(tick, tick < 1 && tick > 0 ? 2 : 0), "#444");
  }
  text((kLeft + kWidth) / 2, kHeight - 10, "middle", x_title, "#000");
  text(kLeft, kTop - 3, "start", y_title, "#000");
  // Where curves usually are not: log-log ones fall to the right, the others rise or lie high.
  double legend = is_logarithmic ? kTop + 16 : kHeight - kBottom - 6 - 15 * (static_cast<double>(curves.size()) - 1);
  for (const Curve& curve : curves) {
    if (curve.points.empty()) continue;
    std::string path;
    for (const auto& [at_x, at_y] : curve.points) {
      if (is_logarithmic && !(at_x > 0 && at_y > 0)) continue;
      path += (path.empty() ? "M" : "L") + number(place_x(at_x), 1) + " " + number(place_y(at_y), 1);
    }
    out += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + curve.colour + "\" stroke-width=\"1.5\"/>";
    text(kWidth - kRight - 6, legend, "end", curve.name, curve.colour);
    legend += 15;
  }
  return out + "</svg>";
}

}  // namespace colony::client
