// bodies: ellipsoids for tests, made from a Stream so that a failing case is named by its number.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/LU>

#include "engine/base/maths.hpp"
#include "engine/growth/chromosome.hpp"
#include "engine/random/sobol.hpp"
#include "engine/random/stream.hpp"
#include "engine/shape/body.hpp"

namespace colony::testing {

/// Draws for test case `number`; purposes of the engine do not matter here.
inline Stream case_stream(std::uint32_t number, std::uint32_t lane = 0) {
  return Stream(20'000, CellId{number}, 0, Purpose::kFounder, lane);
}

inline PointSet points(std::uint32_t n, std::uint32_t number) {
  Stream stream(20'001, CellId{number}, 0, Purpose::kSearchPoints);
  PointSet set;
  scrambled_sobol(n, {stream.next_u32(), stream.next_u32(), stream.next_u32()}, set);
  return set;
}

inline NoiseParams smooth() { return {0.0, 5.0, 1.4}; }
inline NoiseParams rough() { return {0.40, 5.0, 1.4}; }

inline Vec3 unit_vector(Stream& stream) {
  const double z = stream.uniform({-1.0, 1.0});
  const auto [s, c] = maths::sincos(2.0 * maths::kPi * stream.uniform());
  const double r = std::sqrt(1.0 - z * z);
  return {r * c, r * s, z};
}

/// Any ellipsoid: semiaxes 2..15 um, any rotation, centre within `spread` of the origin, partly under the dish or not.
inline BodyGeometry any_ellipsoid(Stream& stream, double spread_um) {
  BodyGeometry g;
  for (int i = 0; i < 3; ++i) g.semiaxes_um[i] = stream.uniform({2.0, 15.0});
  g.rotation_rad = unit_vector(stream) * stream.uniform({0.0, maths::kPi});
  g.centre_um = Vec3(stream.uniform({-spread_um, spread_um}), stream.uniform({-spread_um, spread_um}),
                     stream.uniform({-1.0, 10.0}));
  for (int i = 0; i < 3; ++i) g.noise_offset[i] = stream.uniform({0.0, 54.0 * maths::kPi / 5.0});
  return g;
}

/// A body as the engine places it: from the paper's ranges, spread on the dish, within `spread` of (x, y).
inline BodyGeometry spread_cell(Stream& stream, double x_um, double y_um, double spread_um) {
  BodyGeometry g;
  const double elongation = stream.uniform({1.0, 1.7});
  const double volume = stream.uniform({320.0, 2160.0});
  g.semiaxes_um = semiaxes_um(volume, elongation, stream.uniform({0.3, 0.6}));
  const double turn = maths::kPi * stream.uniform();
  const double tilt = stream.uniform({-0.07, 0.07});
  g.rotation_rad = orientation_rad(turn, tilt, stream.uniform({-0.07, 0.07}));
  const double dx = stream.uniform({-spread_um, spread_um});
  const double dy = stream.uniform({-spread_um, spread_um});
  g.centre_um = Vec3(x_um + dx, y_um + dy, spread_height_um(g.semiaxes_um));
  for (int i = 0; i < 3; ++i) g.noise_offset[i] = stream.uniform({0.0, 54.0 * maths::kPi / 5.0});
  return g;
}

/// A sphere well above the dish.
inline BodyGeometry sphere(double radius_um, const Vec3& centre_um) {
  BodyGeometry g;
  g.centre_um = centre_um;
  g.semiaxes_um = Vec3::Constant(radius_um);
  return g;
}

inline double ellipsoid_volume_um3(const Vec3& s) { return 4.0 / 3.0 * maths::kPi * s.x() * s.y() * s.z(); }

}  // namespace colony::testing
