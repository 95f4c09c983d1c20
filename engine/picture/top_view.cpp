#include "engine/picture/top_view.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/picture/pixels.hpp"

namespace colony {
namespace {

/// A body prepared for scanning its columns.
class ColumnScan {
 public:
  explicit ColumnScan(const Body& body)
      : body_(body),
        step_(body.to_unit().col(2)),
        step_squared_(step_.squaredNorm()),
        noise_slope_(noise_slope_max(body.noise(), step_)) {}

  double top_um(double x_um, double y_um, double floor_um) const {
    // On the column the smooth field is the parabola peak - |step|^2 (z - middle)^2.
    const Vec3 base = body_.to_unit() * Vec3(x_um - body_.centre_um().x(), y_um - body_.centre_um().y(), 0.0);
    const double slope = base.dot(step_);
    const double peak = 1.0 - base.squaredNorm() + slope * slope / step_squared_;
    const double above = peak + body_.noise_bound();
    if (!(above >= 0.0)) return floor_um;
    const double middle_um = body_.centre_um().z() - slope / step_squared_;
    const double reach_um = std::sqrt(above / step_squared_);
    double z_um = middle_um + reach_um;   // f <= 0 from here up
    if (!(z_um > floor_um)) return floor_um;
    // Below `end` nothing is to be looked for: it is inside, or below all of the body, or below the floor.
    const double inside = peak - body_.noise_bound();
    double end_um = inside > 0.0 ? middle_um + std::sqrt(inside / step_squared_) : middle_um - reach_um;
    end_um = std::max(end_um, floor_um);
    const double slope_max = 2.0 * step_squared_ * reach_um + noise_slope_;

    double field = body_.field(Vec3(x_um, y_um, z_um));
    if (field >= 0.0) return z_um;   // tangent, within rounding
    while (z_um > end_um) {
      const double next_um = std::max(z_um - std::max(-field / slope_max, kScanStepMin_um), end_um);
      const double next = body_.field(Vec3(x_um, y_um, next_um));
      if (next >= 0.0) return refined(x_um, y_um, next_um, next, z_um, field);
      z_um = next_um;
      field = next;
    }
    // At the bound of the certain inside, rounding may leave f a hair below zero.
    return inside > 0.0 ? std::max(end_um, floor_um) : floor_um;
  }

 private:
  /// The root between `in` (f >= 0) and `out` (f < 0): two steps of false position on a bracket of kScanStepMin_um or a little more.
  double refined(double x_um, double y_um, double in_um, double in, double out_um, double out) const {
    const double guess_um = in_um + (out_um - in_um) * (in / (in - out));
    const double value = body_.field(Vec3(x_um, y_um, guess_um));
    if (value >= 0.0) return guess_um + (out_um - guess_um) * (value / (value - out));
    return in_um + (guess_um - in_um) * (in / (in - value));
  }

  const Body& body_;
  const Vec3 step_;              // change of (u, v, w) per um of z
  const double step_squared_;
  const double noise_slope_;
};

/// Share of a pixel inside a disc, to first order in the distance of its centre from the rim.
std::uint8_t disc_cover(double distance_um, double radius_um, double um_per_px) {
  const double share = (radius_um - distance_um) / um_per_px + 0.5;
  return static_cast<std::uint8_t>(std::clamp(share, 0.0, 1.0) * 255.0 + 0.5);
}

/// Indices of the pixel centres in [low, high], clipped to [begin, end).
struct Span {
  std::int64_t begin;
  std::int64_t end;
};
Span centres_within(double low_px, double high_px, std::int64_t begin, std::int64_t end) {
  const double low = std::clamp(low_px - 0.5, static_cast<double>(begin), static_cast<double>(end));
  const double high = std::clamp(high_px - 0.5, static_cast<double>(begin) - 1.0, static_cast<double>(end) - 1.0);
  return {ceil_to_int(low), floor_to_int(high) + 1};
}

void draw_body(TopView& view, CellId id, const Body& body) {
  const Frame& frame = view.frame;
  const Box& box = body.box();
  const Span columns = centres_within((box.low.x() - frame.left_um) / frame.um_per_px,
                                      (box.high.x() - frame.left_um) / frame.um_per_px, 0, frame.width_px);
  const Span rows = centres_within((frame.top_um - box.high.y()) / frame.um_per_px,
                                   (frame.top_um - box.low.y()) / frame.um_per_px, view.rows.first, view.rows.end);
  const ColumnScan scan(body);
  for (std::int64_t row = rows.begin; row < rows.end; ++row) {
    const double y_um = frame.y_um(row);
    for (std::int64_t column = columns.begin; column < columns.end; ++column) {
      const std::size_t at = view.index(row, column);
      // Ids come in ascending order and only a greater height replaces: a tie stays with the lower id.
      const double floor_um = static_cast<double>(view.height_um[at]);
      const float top_um = static_cast<float>(scan.top_um(frame.x_um(column), y_um, floor_um));
      if (!(top_um > view.height_um[at])) continue;
      view.height_um[at] = top_um;
      view.owner[at] = id.value;
    }
  }
}

void draw_nucleus(TopView& view, const Cell& cell) {
  const Frame& frame = view.frame;
  const double reach_um = cell.nucleus_radius_um + frame.um_per_px;
  const double x_px = (cell.nucleus_um.x() - frame.left_um) / frame.um_per_px;
  const double y_px = (frame.top_um - cell.nucleus_um.y()) / frame.um_per_px;
  const double reach_px = reach_um / frame.um_per_px;
  const Span columns = centres_within(x_px - reach_px, x_px + reach_px, 0, frame.width_px);
  const Span rows = centres_within(y_px - reach_px, y_px + reach_px, view.rows.first, view.rows.end);
  for (std::int64_t row = rows.begin; row < rows.end; ++row) {
    const double dy_um = frame.y_um(row) - cell.nucleus_um.y();
    for (std::int64_t column = columns.begin; column < columns.end; ++column) {
      const std::size_t at = view.index(row, column);
      if (view.owner[at] != cell.id.value) continue;
      const double dx_um = frame.x_um(column) - cell.nucleus_um.x();
      view.nucleus[at] = disc_cover(std::sqrt(dx_um * dx_um + dy_um * dy_um), cell.nucleus_radius_um, frame.um_per_px);
    }
  }
}

}  // namespace

double noise_slope_max(const NoiseParams& noise, const Vec3& step) {
  // |Gx|, |Gy|, |Gz| <= a (1 + 1/1.17). Along one axis one factor changes directly and one through the phase h sin(.).
  const double factor = noise.amplitude * (1.0 + 1.0 / 1.17);
  const double direct = noise.amplitude * noise.frequency * (1.0 + 1.0 / (1.17 * 1.35));
  const double phase = noise.amplitude / 1.17 * std::abs(noise.phase) * noise.frequency;
  return factor * factor * (direct + phase) * (std::abs(step.x()) + std::abs(step.y()) + std::abs(step.z()));
}

double column_top_um(const Body& body, double x_um, double y_um, double floor_um) {
  return ColumnScan(body).top_um(x_um, y_um, floor_um);
}

TopView top_view(const Colony& colony, const Frame& frame, RowRange rows) {
  CHECK(rows.first >= 0 && rows.first <= rows.end && rows.end <= frame.height_px);
  CHECK(frame.width_px > 0 && frame.um_per_px > 0.0);
  TopView view;
  view.frame = frame;
  view.rows = rows;
  const std::size_t pixel_count = static_cast<std::size_t>((rows.end - rows.first) * frame.width_px);
  view.owner.assign(pixel_count, 0);
  view.height_um.assign(pixel_count, 0.0f);
  view.nucleus.assign(pixel_count, 0);
  if (pixel_count == 0) return view;

  double highest_um = 0.0;
  for (const Cell& cell : colony.cells()) highest_um = std::max(highest_um, colony.body(cell.id).box().high.z());
  Box strip;
  strip.low = Vec3(frame.left_um, frame.top_um - static_cast<double>(rows.end) * frame.um_per_px, 0.0);
  strip.high = Vec3(frame.left_um + static_cast<double>(frame.width_px) * frame.um_per_px,
                    frame.top_um - static_cast<double>(rows.first) * frame.um_per_px, highest_um);
  std::vector<CellId> ids;
  colony.cells_meeting(strip, ids);
  for (const CellId id : ids) draw_body(view, id, colony.body(id));
  for (const CellId id : ids) draw_nucleus(view, colony.cell(id));
  return view;
}

}  // namespace colony
