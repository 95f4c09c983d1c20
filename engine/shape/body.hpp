// body: a noisy ellipsoid on the dish, prepared for evaluation: the field f of one cell.
// Method:  f(p) = 1 - u^2 - v^2 - w^2 + noise(u, v, w), (u, v, w) = p in the cell's frame over its semiaxes; f >= 0 and z >= 0 is cell.
//          The sign of f is decided without the noise wherever |1 - u^2 - v^2 - w^2| exceeds the noise bound.
// Units:   um. The field is dimensionless.
// Errors:  CHECKs finite input and positive semiaxes.
// Threads: pure.
// Source:  the paper, section 3; Gardner's series as in HyperFun's solid noise.
#pragma once

#include <span>

#include "engine/base/types.hpp"
#include "engine/model/params.hpp"

namespace colony {

/// Axis-parallel box, um.
struct Box {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  bool empty() const { return !(low.x() < high.x() && low.y() < high.y() && low.z() < high.z()); }
  double volume() const { return empty() ? 0.0 : (high.x() - low.x()) * (high.y() - low.y()) * (high.z() - low.z()); }
};

/// The part common to both (possibly empty).
inline Box intersection(const Box& a, const Box& b) { return {a.low.cwiseMax(b.low), a.high.cwiseMin(b.high)}; }
/// Whether it is not empty. Axis by axis: of two bodies' boxes, computed as they are asked for, mostly one axis decides.
inline bool meets(const Box& a, const Box& b) {
  for (int i = 0; i < 3; ++i) {
    if (!(a.low[i] < b.high[i] && b.low[i] < a.high[i] && a.low[i] < a.high[i] && b.low[i] < b.high[i])) return false;
  }
  return true;
}

/// Geometry of a body, as stored in a cell.
struct BodyGeometry {
  Vec3 centre_um = Vec3::Zero();
  Vec3 semiaxes_um = Vec3::Zero();
  Vec3 rotation_rad = Vec3::Zero();
  Vec3 noise_offset = Vec3::Zero();
};

/// Rodrigues' rotation matrix of a rotation vector.
Mat3 rotation_matrix(const Vec3& rotation_rad);
/// The rotation vector of a rotation matrix; angle in [0, pi].
Vec3 rotation_vector(const Mat3& rotation);

/// A colony keeps one for each cell, so what costs little is computed when asked for: the box, the bound.
class Body {
 public:
  Body() = default;
  Body(const BodyGeometry& geometry, const NoiseParams& noise);

  /// f at p (um), double precision: the reference, and what pictures and measurements use.
  double field(const Vec3& point_um) const;
  /// 1 - u^2 - v^2 - w^2 at p, without noise.
  double smooth_field(const Vec3& point_um) const;
  /// f >= 0 and z >= 0 at p, without the noise where its bound allows.
  bool contains(const Vec3& point_um) const;
  /// Bounding box of the noisy body above the dish: semiaxes times sqrt(1 + bound), rotated, clipped at z >= 0.
  Box box() const {
    Box box{centre_ - half_extent_um_, centre_ + half_extent_um_};
    box.low.z() = box.low.z() < 0.0 ? 0.0 : box.low.z();
    box.high.z() = box.high.z() < 0.0 ? 0.0 : box.high.z();
    return box;
  }
  /// Half extent of the noise-free ellipsoid along a unit vector, um.
  double half_width_um(const Vec3& unit) const;
  /// True if (x, y) lies in the vertical projection of the noise-free ellipsoid.
  bool footprint_contains(double x_um, double y_um) const;
  /// (xx, xy, yy) of that projection: xx dx^2 + 2 xy dx dy + yy dy^2 <= 1.
  Vec3 footprint_form() const { return {footprint_xx_, footprint_xy_, footprint_yy_}; }
  /// Half extents of that projection along x and y, um.
  Vec2 footprint_half_extent_um() const;
  const Vec3& centre_um() const { return centre_; }
  const Vec3& semiaxes_um() const { return semiaxes_; }
  /// Rows: the cell's axes divided by the semiaxes, so (u, v, w) = to_unit() * (p - centre).
  const Mat3& to_unit() const { return to_unit_; }
  const Vec3& noise_offset() const { return noise_offset_; }
  const NoiseParams& noise() const { return noise_; }
  double noise_bound() const;
  double noisy_scale() const { return noisy_scale_; }

 private:
  Vec3 centre_ = Vec3::Zero();
  Vec3 semiaxes_ = Vec3::Ones();
  Mat3 to_unit_ = Mat3::Identity();
  Vec3 noise_offset_ = Vec3::Zero();
  NoiseParams noise_;
  double noisy_scale_ = 1.0;                   // sqrt(1 + bound): the noisy body lies inside the ellipsoid scaled by this
  Vec3 half_extent_um_ = Vec3::Zero();         // of the noisy body's box, not clipped
  double footprint_xx_ = 1.0, footprint_xy_ = 0.0, footprint_yy_ = 1.0;  // inverse of the shadow's 2x2 form
};

/// |noise| <= this: |G| <= a (1 + 1/1.17) on each axis, so the product is at most (1 + 1/1.17)^3 a^3 = 6.3796 a^3, rounded up.
inline double noise_bound(const NoiseParams& noise) { return 6.380 * noise.amplitude * noise.amplitude * noise.amplitude; }
inline double Body::noise_bound() const { return colony::noise_bound(noise_); }

/// True if a plane across the line of centres separates the two noisy bodies: then they share no point. (False proves nothing.)
bool separated(const Body& a, const Body& b);

/// Gardner's series at (u, v, w), offset not added; |noise| <= noise_bound(params).
double gardner_noise(double u, double v, double w, const NoiseParams& params);
/// The period of the series along each axis, 54 pi / q: offsets are drawn uniformly over it.
double noise_period(const NoiseParams& params);

/// Volume of the noise-free ellipsoid above the dish, um^3, analytic.
double volume_above_dish_um3(const BodyGeometry& geometry);
/// Its centroid, um, analytic: where the nucleus of a new cell stands.
Vec3 centroid_above_dish_um(const BodyGeometry& geometry);

/// What the neighbours take at p: the sum of max(0, f_j), or the largest. Evaluates the noise only where f_j can be positive.
double taken_by(std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um);

/// f~ at p: f minus what the neighbours take there. `rule` kSum: sum over max(0, f_j), the paper's; kMax: the largest only.
double deformed_field(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um);

}  // namespace colony
