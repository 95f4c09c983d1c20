#include "engine/analysis/controls.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "engine/base/maths.hpp"
#include "engine/random/stream.hpp"

namespace colony {
namespace {

Error wrong(ErrorCode code, const std::string& field, const std::string& message) {
  return {code, field + ": " + message, {{field, message}}};
}

struct Disc {
  std::uint32_t label = 0;
  double x = 0.0, y = 0.0, radius = 0.0;
};

/// Discs in a frame that holds them with a margin; a pixel is its centre.
Result<LabelImage> draw_discs(std::vector<Disc> discs, double margin, std::optional<double> um_per_px) {
  double left = discs.front().x, right = left, top = discs.front().y, bottom = top;
  for (const Disc& disc : discs) {
    left = std::min(left, disc.x - disc.radius);
    right = std::max(right, disc.x + disc.radius);
    top = std::min(top, disc.y - disc.radius);
    bottom = std::max(bottom, disc.y + disc.radius);
  }
  const double width = right - left + 2.0 * margin, height = bottom - top + 2.0 * margin;
  const auto side_max = static_cast<double>(kImageSideMax_px - 1);
  if (!(width < side_max && height < side_max)) {
    return wrong(ErrorCode::kLimit, "areas", "the control would be larger than 20000 pixels a side");
  }
  LabelImage image(static_cast<std::int64_t>(width) + 1, static_cast<std::int64_t>(height) + 1, um_per_px);
  std::vector<float> power(image.values.size(), 0.0F);  // d^2 - r^2 of the owner
  for (Disc& disc : discs) {
    disc.x += margin - left;
    disc.y += margin - top;
    const auto first_row = static_cast<std::int64_t>(disc.y - disc.radius);
    const auto last_row = std::min(image.height_px - 1, static_cast<std::int64_t>(disc.y + disc.radius));
    const auto first_column = static_cast<std::int64_t>(disc.x - disc.radius);
    const auto last_column = std::min(image.width_px - 1, static_cast<std::int64_t>(disc.x + disc.radius));
    for (std::int64_t row = first_row; row <= last_row; ++row) {
      const double dy = static_cast<double>(row) + 0.5 - disc.y;
      for (std::int64_t column = first_column; column <= last_column; ++column) {
        const double dx = static_cast<double>(column) + 0.5 - disc.x;
        const auto here = static_cast<float>(dx * dx + dy * dy - disc.radius * disc.radius);
        const std::size_t at = image.index(row, column);
        if (here > 0.0F || (image.values[at] != 0 && here >= power[at])) continue;
        image.values[at] = disc.label;
        power[at] = here;
      }
    }
  }
  return image;
}

Status check_areas(const std::vector<LabelArea>& areas) {
  if (areas.empty()) return wrong(ErrorCode::kInvalid, "areas", "there are no cells to match");
  if (areas.size() > kControlCellsMax) {
    return wrong(ErrorCode::kLimit, "areas", "more than " + std::to_string(kControlCellsMax) + " cells");
  }
  return Ok{};
}

double total_area(const std::vector<LabelArea>& areas) {
  std::uint64_t sum = 0;
  for (const LabelArea& area : areas) sum += area.area_px;
  return static_cast<double>(sum);
}

double radius_of(double area) { return std::sqrt(area / maths::kPi); }

/// The highest z >= 0 of the smooth ellipsoid over (x, y), or -1: f = 1 - |a + b z|^2 is a parabola in z.
double smooth_top_um(const Body& body, double x_um, double y_um) {
  const Vec3& centre = body.centre_um();
  const Vec3 a = body.to_unit() * Vec3(x_um - centre.x(), y_um - centre.y(), -centre.z());
  const Vec3 b = body.to_unit().col(2);
  const double ab = a.dot(b), bb = b.squaredNorm(), rest = ab * ab - bb * (a.squaredNorm() - 1.0);
  if (!(rest >= 0.0)) return -1.0;
  return (std::sqrt(rest) - ab) / bb;
}

}  // namespace

std::vector<LabelArea> label_areas(const LabelImage& labels) {
  std::map<std::uint32_t, std::uint64_t> areas;
  for (std::size_t i = 0; i < labels.values.size();) {
    const std::uint32_t label = labels.values[i];
    const std::size_t first = i;
    while (i < labels.values.size() && labels.values[i] == label) ++i;
    if (label != 0) areas[label] += i - first;
  }
  std::vector<LabelArea> result;
  for (const auto& [label, area_px] : areas) result.push_back({label, area_px});
  return result;
}

Result<LabelImage> hexagonal_control(const std::vector<LabelArea>& areas, std::optional<double> um_per_px) {
  if (const Status status = check_areas(areas); !status) return status.error();
  const auto count = static_cast<double>(areas.size());
  const double radius = radius_of(total_area(areas) / count);
  // Lattice points i (1, 0) + j (1/2, sqrt(3)/2): squared distance i^2 + i j + j^2, an integer, so ties are exact.
  const auto reach = static_cast<std::int64_t>(std::sqrt(count)) + 2;
  std::vector<std::tuple<std::int64_t, std::int64_t, std::int64_t>> points;  // (distance, row, column)
  for (std::int64_t j = -reach; j <= reach; ++j) {
    for (std::int64_t i = -2 * reach; i <= 2 * reach; ++i) points.emplace_back(i * i + i * j + j * j, j, i);
  }
  std::sort(points.begin(), points.end());
  std::vector<Disc> discs;
  for (std::size_t k = 0; k < areas.size(); ++k) {
    const auto [distance, j, i] = points[k];
    const double x = 2.0 * (static_cast<double>(i) + 0.5 * static_cast<double>(j));
    discs.push_back({static_cast<std::uint32_t>(k + 1), radius * x, radius * std::sqrt(3.0) * static_cast<double>(j), radius});
  }
  return draw_discs(std::move(discs), std::max(radius, 1.0), um_per_px);
}

Result<LabelImage> random_disc_control(const std::vector<LabelArea>& areas, Seed seed, std::optional<double> um_per_px) {
  if (const Status status = check_areas(areas); !status) return status.error();
  const double reach = radius_of(total_area(areas));
  std::vector<Disc> discs;
  for (const LabelArea& area : areas) {
    Stream stream(seed, CellId{area.label}, 0, Purpose::kControl);
    const double distance = reach * std::sqrt(stream.uniform());
    const maths::SinCos turn = maths::sincos(stream.uniform({0.0, 2.0 * maths::kPi}));
    discs.push_back({area.label, distance * turn.cos, distance * turn.sin, radius_of(static_cast<double>(area.area_px))});
  }
  const double margin = std::max(1.0, radius_of(total_area(areas) / static_cast<double>(areas.size())));
  return draw_discs(std::move(discs), margin, um_per_px);
}

Result<LabelImage> noise_free_control(const Colony& colony, std::int64_t width_px, std::int64_t height_px,
                                      double um_per_px, double left_um, double top_um) {
  const auto pixels = width_px > 0 && height_px > 0 && width_px <= kImageSideMax_px && height_px <= kImageSideMax_px
                          ? static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)
                          : std::size_t{0};
  if (const Status status = check_image_shape(width_px, height_px, pixels, um_per_px, "frame"); !status) {
    return status.error();
  }
  // Written so that NaN is refused; colonies lie within 1e9 um.
  if (!(std::abs(left_um) <= 2e9 && std::abs(top_um) <= 2e9)) {
    return wrong(ErrorCode::kInvalid, "frame", "its corner must lie within 2e9 um");
  }
  LabelImage image(width_px, height_px, um_per_px);
  std::vector<float> height(image.values.size(), 0.0F);
  // The pixels whose centres lie between two coordinates, within the frame; the clamp comes before the conversion.
  const auto first_in = [um_per_px](double um, std::int64_t count) {
    return static_cast<std::int64_t>(std::clamp(um / um_per_px - 1.0, 0.0, static_cast<double>(count)));
  };
  const auto end_in = [um_per_px](double um, std::int64_t count) {
    return static_cast<std::int64_t>(std::clamp(um / um_per_px + 2.0, 0.0, static_cast<double>(count)));
  };
  for (const Cell& cell : colony.cells()) {
    const Body& body = colony.body(cell.id);
    const Vec2 half = body.footprint_half_extent_um();
    const double x = body.centre_um().x() - left_um, y = top_um - body.centre_um().y();
    const std::int64_t row_end = end_in(y + half.y(), height_px), column_end = end_in(x + half.x(), width_px);
    for (std::int64_t row = first_in(y - half.y(), height_px); row < row_end; ++row) {
      for (std::int64_t column = first_in(x - half.x(), width_px); column < column_end; ++column) {
        const double top = smooth_top_um(body, left_um + (static_cast<double>(column) + 0.5) * um_per_px,
                                         top_um - (static_cast<double>(row) + 0.5) * um_per_px);
        const std::size_t at = image.index(row, column);
        const auto here = static_cast<float>(top);
        if (!(here >= 0.0F) || (image.values[at] != 0 && here <= height[at])) continue;
        image.values[at] = cell.id.value;
        height[at] = here;
      }
    }
  }
  return image;
}

}  // namespace colony
