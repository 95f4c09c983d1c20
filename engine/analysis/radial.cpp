#include "engine/analysis/radial.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"

namespace colony {
namespace {

struct Spread {
  double mean = 0.0, sd = 0.0;
};
Spread spread_of(const std::vector<double>& values) {
  Spread spread;
  if (values.empty()) return spread;
  const auto n = static_cast<double>(values.size());
  double sum = 0.0, squares = 0.0;
  for (const double value : values) sum += value;
  spread.mean = sum / n;
  for (const double value : values) squares += (value - spread.mean) * (value - spread.mean);
  if (values.size() > 1) spread.sd = std::sqrt(squares / (n - 1.0));
  return spread;
}

}  // namespace

Result<std::vector<Ring>> radial_profile(const LabelImage& labels, const std::vector<Shape>& shapes,
                                         const std::optional<std::vector<std::uint32_t>>& active, int ring_count, StopFlag stop) {
  if (const Status status = check_image(labels, "image"); !status) return status.error();
  if (ring_count < 1 || ring_count > 200) {
    return Error{ErrorCode::kInvalid, "ring_count: must lie in 1..200", {{"ring_count", "must lie in 1..200"}}};
  }
  if (shapes.empty()) return Error{ErrorCode::kInvalid, "image: has no labels", {{"image", "has no labels"}}};
  double weight = 0.0, x = 0.0, y = 0.0;
  for (const Shape& shape : shapes) {
    const auto area = static_cast<double>(shape.area_px);
    weight += area;
    x += area * shape.centre_x_px;
    y += area * shape.centre_y_px;
  }
  x /= weight;
  y /= weight;
  const auto distance = [x, y](double px, double py) { return std::sqrt((px - x) * (px - x) + (py - y) * (py - y)); };
  double farthest = 0.0;
  for (const Shape& shape : shapes) farthest = std::max(farthest, distance(shape.centre_x_px, shape.centre_y_px));
  const double width = farthest > 0.0 ? farthest / ring_count : 1.0;
  std::vector<Ring> rings(static_cast<std::size_t>(ring_count));
  std::vector<std::vector<double>> areas(rings.size());
  std::vector<std::uint64_t> active_counts(rings.size(), 0);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    rings[i].inner_px = width * static_cast<double>(i);
    rings[i].outer_px = width * static_cast<double>(i + 1);
  }
  const auto ring_of = [&](double px) { return static_cast<std::size_t>(px / width); };
  for (const Shape& shape : shapes) {
    const std::size_t ring = std::min(ring_of(distance(shape.centre_x_px, shape.centre_y_px)), rings.size() - 1);
    ++rings[ring].cell_count;
    if (shape.is_measured) areas[ring].push_back(static_cast<double>(shape.area_px));
    if (active && std::binary_search(active->begin(), active->end(), shape.label)) ++active_counts[ring];
  }
  for (std::int64_t row = 0; row < labels.height_px; ++row) {
    throw_if_stopped(stop);
    for (std::int64_t column = 0; column < labels.width_px; ++column) {
      if (labels.at(row, column) == 0) continue;
      // Pixels beyond the farthest centre belong to no ring.
      const std::size_t ring = ring_of(distance(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5));
      if (ring < rings.size()) ++rings[ring].covered_px;
    }
  }
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const Spread spread = spread_of(areas[i]);
    const auto n = static_cast<double>(rings[i].cell_count);
    rings[i].area_mean_px = spread.mean;
    if (areas[i].size() > 1) rings[i].area_se_px = spread.sd / std::sqrt(static_cast<double>(areas[i].size()));
    if (rings[i].covered_px > 0) rings[i].density_per_px = n / static_cast<double>(rings[i].covered_px);
    if (active && rings[i].cell_count > 0) rings[i].active_share = static_cast<double>(active_counts[i]) / n;
  }
  return rings;
}

ApartCells apart_cells(const std::vector<Shape>& shapes, const Contacts& contacts) {
  CHECK(shapes.size() == contacts.cells.size());
  std::vector<double> areas[2], circularities[2];
  std::uint64_t counts[2] = {0, 0};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    CHECK(shapes[i].label == contacts.cells[i].label);
    const std::size_t group = contacts.cells[i].neighbour_count == 0 ? 0 : 1;
    ++counts[group];
    if (!shapes[i].is_measured) continue;
    areas[group].push_back(static_cast<double>(shapes[i].area_px));
    circularities[group].push_back(shapes[i].circularity);
  }
  const auto variation = [](const std::vector<double>& values) {
    const Spread spread = spread_of(values);
    return spread.mean > 0.0 ? spread.sd / spread.mean : 0.0;
  };
  ApartCells result;
  result.apart_count = counts[0];
  result.other_count = counts[1];
  if (!shapes.empty()) result.share = static_cast<double>(counts[0]) / static_cast<double>(shapes.size());
  result.apart_area_cv = variation(areas[0]);
  result.apart_circularity_sd = spread_of(circularities[0]).sd;
  result.other_area_cv = variation(areas[1]);
  result.other_circularity_sd = spread_of(circularities[1]).sd;
  return result;
}

}  // namespace colony
