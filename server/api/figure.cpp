// The figure of a comparison: like figures 1 and 2 of the paper, side by side for the simulated and the real colony.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>

#include "engine/analysis/contour.hpp"
#include "engine/base/check.hpp"
#include "engine/picture/glyphs.hpp"
#include "server/api/compare.hpp"

namespace colony::server::api {
namespace {

constexpr std::int64_t kPanel_px = 620;
constexpr std::int64_t kGap_px = 40;
constexpr std::int64_t kTitle_px = 40;
constexpr std::int64_t kTextScale = 2;
constexpr Rgb kAxis{0x60, 0x60, 0x60};
constexpr Rgb kGrid{0xe4, 0xe4, 0xe4};

struct Panel {
  std::int64_t row = 0, column = 0;  // of its upper left pixel
};

/// A curve of the plot: ln N against ln s, its mark and its line.
struct Curve {
  std::string_view name;
  const BoxDimensions* found = nullptr;
  Rgb colour;
};

// The lines in the panel: a pixel is as dark as the darkest of what it stands for, so that no thin line is lost.
void draw_lines(Picture& picture, const Panel& panel, const BinaryImage& lines) {
  const double step = std::max(1.0, static_cast<double>(std::max(lines.width_px, lines.height_px)) /
                                        static_cast<double>(kPanel_px));
  const auto place = [step](std::int64_t at) { return static_cast<std::int64_t>(static_cast<double>(at) / step); };
  for (std::int64_t row = 0; row < lines.height_px; ++row) {
    for (std::int64_t column = 0; column < lines.width_px; ++column) {
      if (lines.at(row, column) == 0) continue;
      put_pixel(picture, panel.row + std::min(place(row), kPanel_px - 1),
                panel.column + std::min(place(column), kPanel_px - 1), {0, 0, 0});
    }
  }
}

void draw_frame(Picture& picture, const Panel& panel) {
  fill_rectangle(picture, panel.row, panel.column, 1, kPanel_px, kAxis);
  fill_rectangle(picture, panel.row + kPanel_px - 1, panel.column, 1, kPanel_px, kAxis);
  fill_rectangle(picture, panel.row, panel.column, kPanel_px, 1, kAxis);
  fill_rectangle(picture, panel.row, panel.column + kPanel_px - 1, kPanel_px, 1, kAxis);
}

std::string two_decimals(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

/// Axes shared by both plots, so that they can be read side by side.
struct Axes {
  double side_low = 1.0, side_high = 10.0, count_low = 1.0, count_high = 10.0;

  void take(const Curve& curve) {
    for (const BoxCount& count : curve.found->counts) {
      side_high = std::max(side_high, static_cast<double>(count.side_px));
      count_high = std::max(count_high, count.count_mean);
    }
  }
  std::int64_t column(double side) const {
    return static_cast<std::int64_t>(std::log(side / side_low) / std::log(side_high / side_low) * (kPanel_px - 1));
  }
  std::int64_t row(double count) const {
    return kPanel_px - 1 -
           static_cast<std::int64_t>(std::log(count / count_low) / std::log(count_high / count_low) * (kPanel_px - 1));
  }
};

void draw_decades(Picture& picture, const Panel& panel, const Axes& axes) {
  for (double decade = 1.0; decade <= axes.side_high; decade *= 10.0) {
    const std::int64_t column = panel.column + axes.column(decade);
    fill_rectangle(picture, panel.row, column, kPanel_px, 1, kGrid);
    draw_text(picture, panel.row + kPanel_px + 6, column, std::to_string(static_cast<std::int64_t>(decade)), kTextScale,
              kAxis);
  }
  for (double decade = 1.0; decade <= axes.count_high; decade *= 10.0) {
    const std::int64_t row = panel.row + axes.row(decade);
    fill_rectangle(picture, row, panel.column, 1, kPanel_px, kGrid);
    draw_text(picture, row - kTextScale * kGlyphHeight_px, panel.column + 4,
              std::to_string(static_cast<std::int64_t>(decade)), kTextScale, kAxis);
  }
}

void draw_curve(Picture& picture, const Panel& panel, const Axes& axes, const Curve& curve) {
  const std::vector<BoxCount>& counts = curve.found->counts;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const auto side = static_cast<double>(counts[i].side_px);
    fill_rectangle(picture, panel.row + axes.row(counts[i].count_mean) - 3, panel.column + axes.column(side) - 3, 7, 7,
                   curve.colour);
    if (i == 0) continue;
    const auto before = static_cast<double>(counts[i - 1].side_px);
    for (std::int64_t x = axes.column(before); x <= axes.column(side); ++x) {
      const double share = axes.column(side) == axes.column(before)
                               ? 0.0
                               : static_cast<double>(x - axes.column(before)) /
                                     static_cast<double>(axes.column(side) - axes.column(before));
      const double count = std::exp(std::log(counts[i - 1].count_mean) * (1.0 - share) +
                                    std::log(counts[i].count_mean) * share);
      put_pixel(picture, panel.row + axes.row(count), panel.column + x, curve.colour);
    }
  }
}

std::vector<Curve> curves_of(const LineReport& lines, const std::vector<ControlReport>& controls) {
  std::vector<Curve> curves;
  if (lines.walls.dimensions) curves.push_back({"cell walls", &*lines.walls.dimensions, {0, 0, 0}});
  if (lines.outline.dimensions) curves.push_back({"outline", &*lines.outline.dimensions, {0x1f, 0x77, 0xb4}});
  for (const ControlReport& control : controls) {
    if (!control.lines.walls.dimensions) continue;
    Curve curve{"control", &*control.lines.walls.dimensions, {0x80, 0x80, 0x80}};
    if (control.name == "without_noise") curve = {"walls without noise", curve.found, {0x2c, 0xa0, 0x2c}};
    if (control.name == "hexagonal") curve = {"hexagonal discs", curve.found, {0xd6, 0x27, 0x28}};
    if (control.name == "random_discs") curve = {"random discs", curve.found, {0xff, 0x7f, 0x0e}};
    curves.push_back(curve);
  }
  return curves;
}

void draw_plot(Picture& picture, const Panel& panel, const Axes& axes, const std::vector<Curve>& curves) {
  draw_decades(picture, panel, axes);
  draw_frame(picture, panel);
  std::int64_t line = panel.row + 10;
  for (const Curve& curve : curves) {
    draw_curve(picture, panel, axes, curve);
    std::string text(curve.name);
    text += "  ";
    text += two_decimals(curve.found->capacity.value);
    if (curve.found->crossover.found) text += " crossover";
    draw_text(picture, line, panel.column + kPanel_px - 10 - kTextScale * text_width_px(text), text, kTextScale,
              curve.colour);
    line += kTextScale * (kGlyphHeight_px + 2);
  }
}

}  // namespace

std::string comparison_figure(const Comparison& comparison) {
  Picture picture;
  picture.width_px = 2 * kPanel_px + 3 * kGap_px;
  picture.height_px = 2 * kPanel_px + 2 * kTitle_px + 3 * kGap_px;
  picture.um_per_px = 1.0;
  picture.rgb.assign(static_cast<std::size_t>(3 * picture.width_px * picture.height_px), 0xff);
  const Panel panels[2][2] = {
      {{kTitle_px, kGap_px}, {kTitle_px, 2 * kGap_px + kPanel_px}},
      {{2 * kTitle_px + kGap_px + kPanel_px, kGap_px}, {2 * kTitle_px + kGap_px + kPanel_px, 2 * kGap_px + kPanel_px}}};
  const auto walls = cell_walls(comparison.image.labels);
  CHECK(static_cast<bool>(walls));  // they were measured
  draw_lines(picture, panels[0][0], *walls);
  draw_lines(picture, panels[0][1], comparison.real.walls);
  const std::vector<Curve> curves[2] = {curves_of(comparison.simulated.lines, comparison.simulated.controls),
                                        curves_of(comparison.real.lines, comparison.real.controls)};
  Axes axes;
  for (const auto& side : curves) {
    for (const Curve& curve : side) axes.take(curve);
  }
  for (int i = 0; i < 2; ++i) {
    draw_frame(picture, panels[0][i]);
    draw_plot(picture, panels[1][i], axes, curves[i]);
    const std::uint64_t cells = i == 0 ? comparison.simulated.cell_count : comparison.real.cell_count;
    char title[64];
    std::snprintf(title, sizeof title, "%s %llu cells", i == 0 ? "simulated" : "real",
                  static_cast<unsigned long long>(cells));
    draw_text(picture, 12, panels[0][i].column, title, kTextScale, {0, 0, 0});
    std::snprintf(title, sizeof title, "%s boxes met by side in px", i == 0 ? "simulated" : "real");
    draw_text(picture, panels[1][i].row - 26, panels[1][i].column, title, kTextScale, {0, 0, 0});
  }
  return encode_png(picture);
}

}  // namespace colony::server::api
