#include "engine/analysis/controls.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "engine/analysis/opencv.hpp"
#include "engine/base/maths.hpp"
#include "engine/random/stream.hpp"

namespace colony {
namespace {

Error wrong(ErrorCode code, const std::string& field, const std::string& message) {
  return {code, field + ": " + message, {{field, message}}};
}

/// Discs in a frame that holds them with a margin.
Result<LabelImage> framed(std::vector<LabelDisc> discs, double margin, std::optional<double> um_per_px) {
  double left = discs.front().x, right = left, top = discs.front().y, bottom = top;
  for (const LabelDisc& disc : discs) {
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
  for (LabelDisc& disc : discs) {
    disc.x += margin - left;
    disc.y += margin - top;
  }
  draw_discs(discs, image);
  return image;
}

Status check_hull(const Hull& hull) {
  const auto pixels = static_cast<std::size_t>(std::max<std::int64_t>(hull.width_px, 0)) *
                      static_cast<std::size_t>(std::max<std::int64_t>(hull.height_px, 0));
  if (Status status = check_image_shape(hull.width_px, hull.height_px, pixels, {}, "hull"); !status) return status;
  if (hull.area_px < 1) return wrong(ErrorCode::kInvalid, "hull", "has no pixels");
  return Ok{};
}

struct Place {
  double distance2 = 0.0, x = 0.0, y = 0.0;
  friend bool operator<(const Place& a, const Place& b) { return std::tie(a.distance2, a.y, a.x) < std::tie(b.distance2, b.y, b.x); }
};

/// Points of the hexagonal lattice about (x, y) that lie in the hull.
std::vector<Place> lattice_in(const Hull& hull, double x, double y, double spacing) {
  std::vector<Place> places;
  const double height = spacing * std::sqrt(3.0) / 2.0;
  const auto rows = static_cast<std::int64_t>(static_cast<double>(hull.height_px) / height) + 1;
  for (std::int64_t j = -rows; j <= rows; ++j) {
    const double at_y = y + height * static_cast<double>(j);
    if (!(at_y >= 0.0 && at_y < static_cast<double>(hull.height_px))) continue;
    const Hull::Span& span = hull.rows[static_cast<std::size_t>(at_y)];
    // Only the columns of the span are gone through: a long thin hull lies in a frame of many more.
    const double first_x = x + (j % 2 != 0 ? 0.5 * spacing : 0.0);
    const auto first = static_cast<std::int64_t>((static_cast<double>(span.first) - first_x) / spacing) - 1;
    for (std::int64_t i = first;; ++i) {
      const double at_x = first_x + spacing * static_cast<double>(i);
      if (at_x >= static_cast<double>(span.end)) break;
      if (at_x < static_cast<double>(span.first)) continue;
      places.push_back({(at_x - x) * (at_x - x) + (at_y - y) * (at_y - y), at_x, at_y});
    }
  }
  return places;
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

void draw_discs(const std::vector<LabelDisc>& discs, LabelImage& image) {
  std::vector<float> power(image.values.size(), 0.0F);  // d^2 - r^2 of the owner
  // The clamp comes before the conversion.
  const auto inside = [](double at, std::int64_t count) {
    return static_cast<std::int64_t>(std::clamp(at, 0.0, static_cast<double>(count - 1)));
  };
  for (const LabelDisc& disc : discs) {
    const std::int64_t last_row = inside(disc.y + disc.radius, image.height_px);
    const std::int64_t first_column = inside(disc.x - disc.radius, image.width_px), last_column = inside(disc.x + disc.radius, image.width_px);
    for (std::int64_t row = inside(disc.y - disc.radius, image.height_px); row <= last_row; ++row) {
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
}

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
  std::vector<LabelDisc> discs;
  for (std::size_t k = 0; k < areas.size(); ++k) {
    const auto [distance, j, i] = points[k];
    const double x = 2.0 * (static_cast<double>(i) + 0.5 * static_cast<double>(j));
    discs.push_back({static_cast<std::uint32_t>(k + 1), radius * x, radius * std::sqrt(3.0) * static_cast<double>(j), radius});
  }
  return framed(std::move(discs), std::max(radius, 1.0), um_per_px);
}

Result<LabelImage> random_disc_control(const std::vector<LabelArea>& areas, Seed seed, std::optional<double> um_per_px) {
  if (const Status status = check_areas(areas); !status) return status.error();
  const double reach = radius_of(total_area(areas));
  std::vector<LabelDisc> discs;
  for (const LabelArea& area : areas) {
    Stream stream(seed, CellId{area.label}, 0, Purpose::kControl);
    const double distance = reach * std::sqrt(stream.uniform());
    const maths::SinCos turn = maths::sincos(stream.uniform({0.0, 2.0 * maths::kPi}));
    discs.push_back({area.label, distance * turn.cos, distance * turn.sin, radius_of(static_cast<double>(area.area_px))});
  }
  const double margin = std::max(1.0, radius_of(total_area(areas) / static_cast<double>(areas.size())));
  return framed(std::move(discs), margin, um_per_px);
}

Hull hull_of(const LabelImage& labels) {
  Hull hull;
  hull.width_px = labels.width_px;
  hull.height_px = labels.height_px;
  hull.rows.resize(static_cast<std::size_t>(std::max<std::int64_t>(labels.height_px, 0)));
  std::vector<cv::Point> corners, polygon;
  for (std::int64_t row = 0; row < labels.height_px; ++row) {
    const std::uint32_t* pixels = labels.row(row);
    std::int64_t first = 0, end = labels.width_px;
    while (first < end && pixels[first] == 0) ++first;
    while (end > first && pixels[end - 1] == 0) --end;
    if (first == end) continue;
    for (const std::int64_t y : {row, row + 1}) {
      corners.emplace_back(static_cast<int>(first), static_cast<int>(y));
      corners.emplace_back(static_cast<int>(end), static_cast<int>(y));
    }
  }
  if (corners.empty()) return hull;
  settle_opencv();
  cv::convexHull(corners, polygon);
  std::vector<double> left(hull.rows.size(), static_cast<double>(labels.width_px)), right(hull.rows.size(), 0.0);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const cv::Point& a = polygon[i];
    const cv::Point& b = polygon[(i + 1) % polygon.size()];
    for (int row = std::min(a.y, b.y); row < std::max(a.y, b.y); ++row) {
      const double share = (row + 0.5 - a.y) / (b.y - a.y), x = a.x + share * (b.x - a.x);
      const auto at = static_cast<std::size_t>(row);
      left[at] = std::min(left[at], x);
      right[at] = std::max(right[at], x);
    }
  }
  for (std::size_t row = 0; row < hull.rows.size(); ++row) {
    // Centres at column + 0.5 from `left` to `right`, neither of which is negative.
    const auto first = static_cast<std::int64_t>(left[row] + 0.5), end = static_cast<std::int64_t>(right[row] + 0.5);
    if (end > first) hull.rows[row] = {first, end};
    hull.area_px += std::max<std::int64_t>(0, end - first);
  }
  return hull;
}

Result<LabelImage> hexagonal_control(const std::vector<LabelArea>& areas, const Hull& hull, std::optional<double> um_per_px) {
  if (const Status status = check_areas(areas); !status) return status.error();
  if (const Status status = check_hull(hull); !status) return status.error();
  double x = 0.0, y = 0.0;  // the hull's centre
  for (std::size_t row = 0; row < hull.rows.size(); ++row) {
    const auto first = static_cast<double>(hull.rows[row].first), end = static_cast<double>(hull.rows[row].end);
    x += (end - first) * (first + end) / 2.0;
    y += (end - first) * (static_cast<double>(row) + 0.5);
  }
  const auto area = static_cast<double>(hull.area_px), count = static_cast<double>(areas.size());
  x /= area;
  y /= area;
  // The widest lattice with enough points. Their number falls with the spacing but for single steps, so the last one that had enough is kept.
  double low = 0.0, high = 2.0 * std::sqrt(2.0 / std::sqrt(3.0) * area / count);
  std::vector<Place> places;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings || places.empty(); ++i) {
    const double spacing = (low + high) / 2.0;
    std::vector<Place> found = lattice_in(hull, x, y, spacing);
    const bool enough = found.size() >= areas.size();
    (enough ? low : high) = spacing;
    if (enough) places = std::move(found);
  }
  std::sort(places.begin(), places.end());
  const double radius = radius_of(total_area(areas) / count);
  std::vector<LabelDisc> discs;
  for (std::size_t k = 0; k < areas.size(); ++k) discs.push_back({static_cast<std::uint32_t>(k + 1), places[k].x, places[k].y, radius});
  LabelImage image(hull.width_px, hull.height_px, um_per_px);
  draw_discs(discs, image);
  return image;
}

Result<LabelImage> random_disc_control(const std::vector<LabelArea>& areas, const Hull& hull, Seed seed, std::optional<double> um_per_px) {
  if (const Status status = check_areas(areas); !status) return status.error();
  if (const Status status = check_hull(hull); !status) return status.error();
  std::vector<std::int64_t> above(hull.rows.size() + 1, 0);  // pixels of the rows before
  for (std::size_t row = 0; row < hull.rows.size(); ++row) above[row + 1] = above[row] + hull.rows[row].end - hull.rows[row].first;
  std::vector<LabelDisc> discs;
  for (const LabelArea& area : areas) {
    Stream stream(seed, CellId{area.label}, 0, Purpose::kControl);
    const double at = stream.uniform() * static_cast<double>(hull.area_px);  // a place along all rows, one after the other
    const auto pixel = std::min(static_cast<std::int64_t>(at), hull.area_px - 1);
    const auto row = static_cast<std::size_t>(std::upper_bound(above.begin(), above.end(), pixel) - above.begin() - 1);
    const double x = static_cast<double>(hull.rows[row].first) + (at - static_cast<double>(above[row]));
    discs.push_back({area.label, x, static_cast<double>(row) + stream.uniform(), radius_of(static_cast<double>(area.area_px))});
  }
  LabelImage image(hull.width_px, hull.height_px, um_per_px);
  draw_discs(discs, image);
  return image;
}

Result<LabelImage> noise_free_control(const Colony& colony, std::int64_t width_px, std::int64_t height_px,
                                      double um_per_px, double left_um, double top_um, StopFlag stop) {
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
    throw_if_stopped(stop);
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
