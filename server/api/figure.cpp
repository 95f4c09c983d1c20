// The figure of a comparison, like figures 1 and 2 of the paper, the simulated colony on the left and the real one on the right: what was counted, in
// one scale; box counts with the fitted lines; slopes from small to large boxes, which a line hides.
#include <algorithm>
#include <string>

#include "engine/analysis/contour.hpp"
#include "engine/base/check.hpp"
#include "server/api/compare.hpp"
#include "server/api/plot.hpp"

namespace colony::server::api {
namespace {

constexpr double kPanelWidth_px = 740, kContourHeight_px = 620, kCountHeight_px = 560, kSlopeHeight_px = 250;
constexpr double kLeft_px = 112, kBetween_px = 128, kRight_px = 28;
constexpr double kTitle_px = 52, kRowGap_px = 60, kAxisText_px = 70, kBottom_px = 66;
constexpr Ink kPictureFrame{0xc8, 0xc8, 0xc8};
constexpr double kBar_px = 60.0;  // of a panel, for the scale bar

// --- what was counted ---

struct Drawing {
  const BinaryImage* walls = nullptr;
  const BinaryImage* outline = nullptr;
  PixelBox part;  // of both
};

PixelBox united(const PixelBox& a, const PixelBox& b) {
  if (a.width == 0) return b;
  if (b.width == 0) return a;
  const std::int64_t left = std::min(a.left, b.left), top = std::min(a.top, b.top);
  return {left, top, std::max(a.left + a.width, b.left + b.width) - left, std::max(a.top + a.height, b.top + b.height) - top};
}

/// Pixels of the image for one of the panel.
double step_of(const Drawing& drawing) {
  constexpr double kFill = 0.94;
  return std::max(static_cast<double>(drawing.part.width) / (kFill * kPanelWidth_px),
                  static_cast<double>(drawing.part.height) / (kFill * (kContourHeight_px - kBar_px)));
}

/// Where the upper left corner of the part lies: in the middle of the panel, above the scale bar.
CanvasPoint corner_of(const Panel& panel, const Drawing& drawing, double step) {
  return {panel.x + (panel.width - static_cast<double>(drawing.part.width) / step) / 2.0,
          panel.y + (panel.height - kBar_px - static_cast<double>(drawing.part.height) / step) / 2.0};
}

void draw_picture_frame(Canvas& canvas, const Panel& panel, const Drawing& drawing, double step) {
  canvas.box(corner_of(panel, drawing, step), static_cast<double>(drawing.part.width) / step, static_cast<double>(drawing.part.height) / step,
             kPictureFrame, false);
}

/// A line one pixel wide stays black when several pixels share one of the panel: its ink is spread over the width of a line there, not of the area.
void draw_ink(Canvas& canvas, const Panel& panel, const Drawing& drawing, const BinaryImage& lines, double step, Ink ink) {
  const auto [x, y] = corner_of(panel, drawing, step);
  const auto width = static_cast<std::int64_t>(panel.width), height = static_cast<std::int64_t>(panel.height);
  std::vector<float> dark(static_cast<std::size_t>(width * height), 0.0F);
  const std::int64_t repeat = std::max<std::int64_t>(1, static_cast<std::int64_t>(2.0 / step));  // finer than the panel's pixels
  const double part = std::max(1.0, step) / (step * step) / static_cast<double>(repeat * repeat);
  for (std::int64_t row = 0; row < drawing.part.height; ++row) {
    for (std::int64_t column = 0; column < drawing.part.width; ++column) {
      if (lines.at(drawing.part.top + row, drawing.part.left + column) == 0) continue;
      for (std::int64_t k = 0; k < repeat * repeat; ++k) {
        const auto n = static_cast<double>(repeat);
        const double at_y = y - panel.y + (static_cast<double>(row) + (static_cast<double>(k / repeat) + 0.5) / n) / step;
        const double at_x = x - panel.x + (static_cast<double>(column) + (static_cast<double>(k % repeat) + 0.5) / n) / step;
        const auto r = std::clamp<std::int64_t>(static_cast<std::int64_t>(at_y), 0, height - 1);
        const auto c = std::clamp<std::int64_t>(static_cast<std::int64_t>(at_x), 0, width - 1);
        dark[static_cast<std::size_t>(r * width + c)] += static_cast<float>(part);
      }
    }
  }
  for (std::int64_t row = 0; row < height; ++row) {
    for (std::int64_t column = 0; column < width; ++column) {
      const float share = dark[static_cast<std::size_t>(row * width + column)];
      if (share > 0.0F) canvas.shade(static_cast<std::int64_t>(panel.y) + row, static_cast<std::int64_t>(panel.x) + column, ink, share);
    }
  }
}

void draw_bar(Canvas& canvas, const Panel& panel, double step, std::optional<double> um_per_px) {
  const double most = 0.3 * panel.width * step;  // in px of the image
  const double length_px = um_per_px ? round_length(most * *um_per_px) / *um_per_px : round_length(most);
  const std::string text = um_per_px ? format("%.4g um (%.0f px)", length_px * *um_per_px, length_px) : format("%.4g px", length_px);
  const double y = panel.y + panel.height - 30.0, x = panel.x + 20.0;
  canvas.box({x, y - 3.0}, length_px / step, 6.0, kBlackInk, true);
  canvas.text({x + length_px / step + 14.0, y + 6.0}, text, kBlackInk);
}

/// Of single things the outer outline is that of each, and would only hide the other line.
bool has_outline(ObjectKind kind) { return kind == ObjectKind::kCells || kind == ObjectKind::kRegions; }

std::vector<Curve> curves_of(const LineReport& all, const std::vector<ControlReport>& controls, const ComparedSide& side, ObjectKind kind) {
  const LineNames names = line_names(kind);
  std::vector<Curve> curves;
  const auto add = [&](const std::string& name, const MeasuredLine& line, const MeasuredLine& compared, Ink ink, bool is_control,
                       bool is_dashed = false) {
    if (line.dimensions) curves.push_back({name, &line, &compared, ink, is_control, is_dashed});
  };
  add(names.walls, all.walls, side.lines.walls, kBlackInk, false);
  if (has_outline(kind)) add(names.outline, all.outline, side.lines.outline, kOutlineInk, false);
  for (std::size_t i = 0; i < controls.size(); ++i) {
    const std::string& name = controls[i].name;
    const bool is_smooth = name == "without_noise", is_hexagonal = name == "hexagonal";
    add(is_smooth ? "control, without noise" : is_hexagonal ? "control, hexagonal discs" : "control, random discs", controls[i].lines.walls,
        side.controls[i].lines.walls, is_smooth ? Ink{0x2c, 0xa0, 0x2c} : is_hexagonal ? Ink{0xd6, 0x27, 0x28} : Ink{0xe0, 0x82, 0x14}, true, is_smooth);
  }
  return curves;
}

std::string counted(const char* letter, const char* whose, std::uint64_t count, ObjectKind kind) {
  return std::string("(") + letter + ") " + whose + ", " + std::to_string(count) + " " + std::string(count == 1 ? singular_of(kind) : name_of(kind));
}

}  // namespace

Canvas comparison_canvas(const Comparison& comparison) {
  const auto walls = cell_walls(comparison.image.labels), outline = colony_outline(comparison.image.labels);
  CHECK(walls && outline);  // they were measured
  // Of the colony what is drawn; of the picture all of its frame, which cuts things.
  const Drawing drawings[2] = {{&*walls, &*outline, united(foreground_box(*walls), foreground_box(*outline))},
                               {&comparison.real.walls, &comparison.real.outline,
                                {0, 0, comparison.real.walls.width_px, comparison.real.walls.height_px}}};
  const double step = std::max({0.25, step_of(drawings[0]), step_of(drawings[1])});
  const std::vector<Curve> curves[2] = {
      curves_of(comparison.simulated.lines, comparison.simulated.controls, comparison.simulated_side, comparison.match.simulated),
      curves_of(comparison.real.lines, comparison.real.controls, comparison.real_side, comparison.real.objects)};
  // Shared by both plots, so that they can be read side by side.
  Axes axes;
  SlopeRange slopes;
  for (const auto& side : curves) {
    for (const Curve& curve : side) {
      axes.take(curve);
      slopes.take(curve);
    }
  }
  if (axes.x_high == 0.0) axes = {1.0, 10.0, 1.0, 10.0};
  axes = {axes.x_low / 1.12, axes.x_high * 1.12, axes.y_low / 1.4, axes.y_high * 1.4};

  const double rows = static_cast<double>(std::max(curves[0].size(), curves[1].size())) + 1.0;
  const double count_y = kTitle_px + kContourHeight_px + kRowGap_px, legend_y = count_y + kCountHeight_px + kAxisText_px;
  const double slope_y = legend_y + rows * kLegendRow_px + kRowGap_px;
  Canvas canvas(static_cast<std::int64_t>(kLeft_px + 2.0 * kPanelWidth_px + kBetween_px + kRight_px),
                static_cast<std::int64_t>(slope_y + kSlopeHeight_px + kBottom_px));
  const std::uint64_t all = comparison.simulated.cell_count;
  const std::string hidden = all == comparison.simulated.visible_count ? std::string() : " seen of " + std::to_string(all);
  for (int i = 0; i < 2; ++i) {
    const double x = kLeft_px + i * (kPanelWidth_px + kBetween_px);
    const Panel contours{x, kTitle_px, kPanelWidth_px, kContourHeight_px}, counts{x, count_y, kPanelWidth_px, kCountHeight_px},
        course{x, slope_y, kPanelWidth_px, kSlopeHeight_px};
    const bool is_simulated = i == 0;
    canvas.text({x, kTitle_px - 16.0},
                is_simulated ? counted("a", "simulated", comparison.simulated.visible_count, comparison.match.simulated) + hidden +
                                   format(", %.0f h", comparison.at.time_h)
                             : counted("b", "real", comparison.real.object_count, comparison.real.objects),
                kBlackInk, Align::kLeft, 16.0);
    if (!is_simulated) draw_picture_frame(canvas, contours, drawings[i], step);
    draw_ink(canvas, contours, drawings[i], *drawings[i].walls, step, kBlackInk);
    if (has_outline(is_simulated ? comparison.match.simulated : comparison.real.objects)) {
      draw_ink(canvas, contours, drawings[i], *drawings[i].outline, step, kOutlineInk);
    }
    draw_bar(canvas, contours, step, is_simulated ? std::optional(comparison.um_per_px) : comparison.real.analysis.um_per_px);
    draw_frame(canvas, contours);
    canvas.text({x, count_y - 16.0}, std::string(is_simulated ? "(c)" : "(d)") + " boxes met, N(s)", kBlackInk, Align::kLeft, 16.0);
    draw_counts(canvas, counts, axes, curves[i]);
    draw_legend(canvas, {x, legend_y, kPanelWidth_px, 0.0}, curves[i]);
    canvas.text({x, slope_y - 16.0}, std::string(is_simulated ? "(e)" : "(f)") + " slope of N(s) through " + std::to_string(kSlopeWindow) + " sides", kBlackInk,
                Align::kLeft, 16.0);
    draw_slopes(canvas, course, axes, slopes, curves[i]);
  }
  return canvas;
}

std::string comparison_figure(const Comparison& comparison, StopFlag stop) { return encode_step_png(comparison_canvas(comparison).picture(), stop); }

}  // namespace colony::server::api
