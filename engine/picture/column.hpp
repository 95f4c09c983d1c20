// column: the top of one body above one point of the dish.
// Method:  scan from above, stepping down by |f| / L, L a bound of |df/dz|, and by kScanStepMin_um at least: nothing
//          is stepped over but a lobe thinner than that. Only the band is scanned where the noise can decide the sign.
//          Both the band and L come from bounds of the noise on this very column: cells lie flat, so along z the
//          in-plane factors of Gardner's product hardly change, and their values in the middle bound them far better
//          than their amplitude does. f is evaluated along the column with a sine of its own: within kColumnFieldError of
//          Body::field, the reference, and three times as fast. A height is displaced by about the same share of the
//          cell's, far below a grey level.
// Units:   um.
// Errors:  none.      Threads: pure.
#pragma once

#include "engine/picture/top_kernel.hpp"
#include "engine/shape/body.hpp"

namespace colony {

/// Thinnest lobe that the scan cannot miss, um along z.
inline constexpr double kScanStepMin_um = 0.02;

/// |field of a column - Body::field|, at most.
inline constexpr double kColumnFieldError = 1e-8;

/// What the noise can do between two heights of a column.
struct NoiseLimits {
  double bound = 0.0;             // |noise|, at most
  double slope_max_per_um = 0.0;  // |d noise / dz|, at most
};

/// The field along one column: (u, v, w) is linear in z.
class Column {
 public:
  Column(const Body& body, const Vec3& step, double x_um, double y_um)
      : unit_(unit_at(body, x_um - body.centre_um().x(), y_um - body.centre_um().y(), -body.centre_um().z())),
        step_(step),
        noise_at_(unit_ + body.noise_offset()),
        noise_(body.noise()) {}

  double field(double z_um) const;
  /// (u, v, w) at z = 0.
  const Vec3& unit() const { return unit_; }
  /// The place in the noise at height z.
  Vec3 noise_at(double z_um) const { return noise_at_ + step_ * z_um; }

 private:
  /// Sums of three from the left, as in the vector kernel; the library's product adds the last row up in another order.
  static Vec3 unit_at(const Body& body, double x_um, double y_um, double z_um) {
    const Mat3& m = body.to_unit();
    const auto row = [&](int i) { return m(i, 0) * x_um + m(i, 1) * y_um + m(i, 2) * z_um; };
    return {row(0), row(1), row(2)};
  }

  Vec3 unit_;
  Vec3 step_;
  Vec3 noise_at_;
  const NoiseParams& noise_;
};

/// A body prepared for its columns; it must outlive this.
class ColumnScan {
 public:
  explicit ColumnScan(const Body& body);

  /// The highest z > floor_um with f >= 0 in the column (x, y), or floor_um if there is none.
  double top_um(double x_um, double y_um, double floor_um) const;

  /// The same for columns side by side (top_kernel.hpp).
  kernel::TopBody prepared() const;

  Column column(double x_um, double y_um) const { return Column(body_, step_, x_um, y_um); }
  /// Limits of the noise for z in [low_um, high_um] of the column.
  NoiseLimits noise_limits(const Column& column, double low_um, double high_um) const;

 private:
  const Body& body_;
  Vec3 step_;  // change of (u, v, w) per um of z
  double step_squared_;
  Vec3 rate_;          // |step_|, component by component
  Vec3 factor_slope_;  // of Gx, Gy, Gz, at most, per um of z
};

}  // namespace colony
