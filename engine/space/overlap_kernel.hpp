// overlap_kernel: the field of one body over arrays of points, single precision. The only place where speed beats form.
// Why the same bits everywhere: only + - * and conversions, in a fixed order per point, no contraction (compiler flags), no
// reduction over points but integer counts. Vectorised or not, a point's value is the same.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/shape/body.hpp"

namespace colony::kernel {

/// A body prepared for points given relative to `origin`.
struct FloatBody {
  float m[9];               // (u, v, w) = m (p - origin) + t
  float t[3];
  float q1[3], q2[3];       // phases of the two sines along each axis: the noise offset, reduced to [0, 2 pi)
  float frequency, slower_frequency, amplitude, second_amplitude, phase;
  float band;               // |1 - u^2 - v^2 - w^2| above this: the sign needs no noise
  FloatBody(const Body& body, const Vec3& origin_um);
};

/// Gardner's noise at n points (u, v, w) of the cell's frame.
void noise(const FloatBody& body, const float* u, const float* v, const float* w, std::size_t n, float* out);

/// 1 - u^2 - v^2 - w^2 at n points.
void smooth_field(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, float* out);

/// (u, v, w) of one point.
struct Unit { float u, v, w; };
inline Unit to_unit(const FloatBody& b, float x, float y, float z) {
  return {b.m[0] * x + b.m[1] * y + b.m[2] * z + b.t[0], b.m[3] * x + b.m[4] * y + b.m[5] * z + b.t[1],
          b.m[6] * x + b.m[7] * y + b.m[8] * z + b.t[2]};
}

}  // namespace colony::kernel
