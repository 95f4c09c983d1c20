#include "engine/shape/body.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

bool finite(const Vec3& v) { return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z()); }

}  // namespace

Mat3 rotation_matrix(const Vec3& rotation_rad) {
  const double angle = std::sqrt(rotation_rad.squaredNorm());
  if (angle == 0.0) return Mat3::Identity();
  const Vec3 k = rotation_rad / angle;
  const auto [s, c] = maths::sincos(angle);
  const double t = 1.0 - c;
  Mat3 m;
  m << c + t * k.x() * k.x(), t * k.x() * k.y() - s * k.z(), t * k.x() * k.z() + s * k.y(),
      t * k.x() * k.y() + s * k.z(), c + t * k.y() * k.y(), t * k.y() * k.z() - s * k.x(),
      t * k.x() * k.z() - s * k.y(), t * k.y() * k.z() + s * k.x(), c + t * k.z() * k.z();
  return m;
}

Vec3 rotation_vector(const Mat3& r) {
  // By way of the quaternion, from its largest component: the trace alone loses all digits near half a turn.
  const double trace = r(0, 0) + r(1, 1) + r(2, 2);
  double w = 0.0;
  Vec3 v;
  if (trace >= 0.0) {
    w = 0.5 * std::sqrt(1.0 + trace);
    v = Vec3(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)) / (4.0 * w);
  } else {
    int i = 0;
    if (r(1, 1) > r(0, 0)) i = 1;
    if (r(2, 2) > r(i, i)) i = 2;
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    const double p = 0.5 * std::sqrt(std::max(0.0, 1.0 + r(i, i) - r(j, j) - r(k, k)));
    v[i] = p;
    v[j] = (r(i, j) + r(j, i)) / (4.0 * p);
    v[k] = (r(i, k) + r(k, i)) / (4.0 * p);
    w = (r(k, j) - r(j, k)) / (4.0 * p);
  }
  if (w < 0.0) {
    w = -w;
    v = -v;
  }
  const double s = std::sqrt(v.squaredNorm());
  if (s < 1e-12) return 2.0 * v;
  // 2 atan2(s, w), from whichever of the two is better conditioned.
  const double half = w < 0.7 ? maths::acos(std::min(w, 1.0)) : 0.5 * maths::kPi - maths::acos(std::min(s, 1.0));
  return v * (2.0 * half / s);
}

double gardner_noise(double u, double v, double w, const NoiseParams& p) {
  const double sx = maths::sine(p.frequency * u);
  const double sy = maths::sine(p.frequency * v);
  const double sz = maths::sine(p.frequency * w);
  const double second = p.amplitude / 1.17;
  const double slower = p.frequency / 1.35;
  const double gx = p.amplitude * sx + second * maths::sine(slower * u + p.phase * sz);
  const double gy = p.amplitude * sy + second * maths::sine(slower * v + p.phase * sx);
  const double gz = p.amplitude * sz + second * maths::sine(slower * w + p.phase * sy);
  return gx * gy * gz;
}

double noise_period(const NoiseParams& params) { return 54.0 * maths::kPi / params.frequency; }

Body::Body(const BodyGeometry& geometry, const NoiseParams& noise)
    : centre_(geometry.centre_um),
      semiaxes_(geometry.semiaxes_um),
      noise_offset_(geometry.noise_offset),
      noise_(noise),
      noisy_scale_(std::sqrt(1.0 + colony::noise_bound(noise))) {
  CHECK(finite(centre_) && finite(semiaxes_) && finite(geometry.rotation_rad) && finite(noise_offset_));
  CHECK(semiaxes_.x() > 0.0 && semiaxes_.y() > 0.0 && semiaxes_.z() > 0.0);
  const Mat3 axes = rotation_matrix(geometry.rotation_rad);  // columns: the cell's axes in the dish's frame
  for (int i = 0; i < 3; ++i) to_unit_.row(i) = axes.col(i).transpose() / semiaxes_[i];

  // Covariance-like form S = R diag(s^2) R^T: half extents are the roots of its diagonal, its upper 2x2 block is the shadow's.
  Mat3 form = Mat3::Zero();
  for (int i = 0; i < 3; ++i) form += (semiaxes_[i] * semiaxes_[i]) * (axes.col(i) * axes.col(i).transpose());
  for (int i = 0; i < 3; ++i) half_extent_um_[i] = noisy_scale_ * std::sqrt(form(i, i));
  const double determinant = form(0, 0) * form(1, 1) - form(0, 1) * form(0, 1);
  footprint_xx_ = form(1, 1) / determinant;
  footprint_xy_ = -form(0, 1) / determinant;
  footprint_yy_ = form(0, 0) / determinant;
}

double Body::smooth_field(const Vec3& point_um) const { return 1.0 - (to_unit_ * (point_um - centre_)).squaredNorm(); }

double Body::field(const Vec3& point_um) const {
  const Vec3 u = to_unit_ * (point_um - centre_);
  const Vec3 n = u + noise_offset_;
  return 1.0 - u.squaredNorm() + gardner_noise(n.x(), n.y(), n.z(), noise_);
}

bool Body::contains(const Vec3& point_um) const {
  if (!(point_um.z() >= 0.0)) return false;
  const double smooth = smooth_field(point_um);
  const double bound = noise_bound();
  if (smooth > bound) return true;
  if (!(smooth >= -bound)) return false;
  return field(point_um) >= 0.0;
}

double Body::half_width_um(const Vec3& unit) const {
  // The support function of an ellipsoid: |diag(s) R^T n|; the rows of to_unit_ are axes over semiaxes.
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double along = to_unit_.row(i).dot(unit) * semiaxes_[i] * semiaxes_[i];
    sum += along * along;
  }
  return std::sqrt(sum);
}

bool separated(const Body& a, const Body& b) {
  const Vec3 apart = b.centre_um() - a.centre_um();
  const double distance = std::sqrt(apart.squaredNorm());
  if (!(distance > 0.0)) return false;
  const Vec3 unit = apart / distance;
  // Both lie inside their scaled ellipsoids, whose half widths along the line of centres must add up to reach. The margin is
  // for rounding alone.
  return distance > 1.000001 * (a.noisy_scale() * a.half_width_um(unit) + b.noisy_scale() * b.half_width_um(unit));
}

bool Body::footprint_contains(double x_um, double y_um) const {
  const double dx = x_um - centre_.x();
  const double dy = y_um - centre_.y();
  return footprint_xx_ * dx * dx + 2.0 * footprint_xy_ * dx * dy + footprint_yy_ * dy * dy <= 1.0;
}

Vec2 Body::footprint_half_extent_um() const {
  const double determinant = footprint_xx_ * footprint_yy_ - footprint_xy_ * footprint_xy_;
  return {std::sqrt(footprint_yy_ / determinant), std::sqrt(footprint_xx_ / determinant)};
}

namespace {

// How the dish cuts an ellipsoid. An affine map makes the ellipsoid a unit ball and the dish a plane at distance -d from its centre.
struct DishCut {
  double d = 0.0;                  // height of the centre over the half height, clamped to [-1, 1]
  Vec3 top_um = Vec3::Zero();      // from the centre to the highest point
  explicit DishCut(const BodyGeometry& geometry) {
    const Mat3 axes = rotation_matrix(geometry.rotation_rad);
    Vec3 form_z = Vec3::Zero();    // R diag(s^2) R^T e_z
    for (int i = 0; i < 3; ++i) {
      form_z += (geometry.semiaxes_um[i] * geometry.semiaxes_um[i] * axes(2, i)) * Vec3(axes.col(i));
    }
    const double half_height = std::sqrt(form_z.z());
    top_um = form_z / half_height;
    d = std::clamp(geometry.centre_um.z() / half_height, -1.0, 1.0);
  }
};

}  // namespace

double volume_above_dish_um3(const BodyGeometry& geometry) {
  const double d = DishCut(geometry).d;
  const double share = (2.0 + 3.0 * d - d * d * d) / 4.0;  // of a ball cut by a plane (Archimedes)
  return share * 4.0 / 3.0 * maths::kPi * geometry.semiaxes_um.x() * geometry.semiaxes_um.y() * geometry.semiaxes_um.z();
}

Vec3 centroid_above_dish_um(const BodyGeometry& geometry) {
  const DishCut cut(geometry);
  const double below = 2.0 + 3.0 * cut.d - cut.d * cut.d * cut.d;
  if (!(below > 0.0)) return geometry.centre_um;  // all of it under the dish: no centroid
  const double one_minus = 1.0 - cut.d * cut.d;
  return geometry.centre_um + (0.75 * one_minus * one_minus / below) * cut.top_um;
}

double taken_by(std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um) {
  double taken = 0.0;
  for (const Body* other : neighbours) {
    if (!(other->smooth_field(point_um) >= -other->noise_bound())) continue;  // f_j < 0: takes nothing
    const double f = other->field(point_um);
    if (!(f > 0.0)) continue;
    taken = rule == ContactRule::kSum ? taken + f : std::max(taken, f);
  }
  return taken;
}

double deformed_field(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um) {
  return body.field(point_um) - taken_by(neighbours, rule, point_um);
}

}  // namespace colony
