// Preparation of bodies, and the plain C++ twin of the vector kernels (overlap_simd.cpp).
#include "engine/space/overlap_kernel.hpp"

#include <bit>

#include "engine/base/maths.hpp"
#include "engine/space/deformed_kernel.hpp"

namespace colony::kernel {
namespace {

// sin x for |x| <= 100: reduced by a multiple of pi, odd polynomial of degree 7, least in its largest error on [-pi/2, pi/2]. Absolute error
// below 3e-6 for |x| <= 25: far below what a sign decided by sampling could notice. The vector version has the same operations.
float sine(float x) {
  // Adding 1.5 * 2^23 rounds to the nearest integer, whose lowest bit is then the sum's.
  const float shifted = x * 0.318309886F + 12582912.0F;
  const float k = shifted - 12582912.0F;
  const float r = x - k * 3.14159265F;
  const float r2 = r * r;
  float sum = -1.84901083e-4F * r2 + 8.31230105e-3F;
  sum = sum * r2 - 1.66656764e-1F;
  const float s = r + (r * r2) * sum;
  return (std::bit_cast<std::uint32_t>(shifted) & 1U) != 0 ? -s : s;
}

float reduced_phase(double phase) {
  const double turns = phase / (2.0 * maths::kPi);
  return static_cast<float>(phase - 2.0 * maths::kPi * static_cast<double>(static_cast<std::int64_t>(turns)));
}

void grow(std::vector<float>& buffer, std::size_t n) {
  if (buffer.size() < n) buffer.resize(n);
}

}  // namespace

FloatBody::FloatBody(const Body& body, const Vec3& origin_um) {
  const Vec3 shift = body.to_unit() * (origin_um - body.centre_um());
  const NoiseParams& p = body.noise();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[3 * i + j] = static_cast<float>(body.to_unit()(i, j));
    t[i] = static_cast<float>(shift[i]);
    q1[i] = reduced_phase(p.frequency * body.noise_offset()[i]);
    q2[i] = reduced_phase(p.frequency / 1.35 * body.noise_offset()[i]);
  }
  frequency = static_cast<float>(p.frequency);
  slower_frequency = static_cast<float>(p.frequency / 1.35);
  amplitude = static_cast<float>(p.amplitude);
  second_amplitude = static_cast<float>(p.amplitude / 1.17);
  phase = static_cast<float>(p.phase);
  // A little wider than the bound: rounding in the noise must not make the shortcut differ from the full evaluation.
  band = static_cast<float>(body.noise_bound()) * 1.0001F + 1e-5F;
  // The band is wider than the bound, and the kernels err by some 1e-6 of the coordinates.
  const Box box = body.box();
  for (int i = 0; i < 2; ++i) {
    const double margin = 1e-3 * (box.high[i] - box.low[i]) + 1e-4;
    low[i] = static_cast<float>(box.low[i] - origin_um[i] - margin);
    high[i] = static_cast<float>(box.high[i] - origin_um[i] + margin);
  }
}

void BandBuffer::hold(std::size_t n) {
  for (std::vector<float>* buffer : {&u, &v, &w, &smooth, &x, &y, &z}) grow(*buffer, n + kPadding);
}

float noise_reference(const FloatBody& b, float u, float v, float w) {
  const float sx = sine(b.frequency * u + b.q1[0]);
  const float sy = sine(b.frequency * v + b.q1[1]);
  const float sz = sine(b.frequency * w + b.q1[2]);
  const float gx = b.amplitude * sx + b.second_amplitude * sine((b.slower_frequency * u + b.q2[0]) + b.phase * sz);
  const float gy = b.amplitude * sy + b.second_amplitude * sine((b.slower_frequency * v + b.q2[1]) + b.phase * sx);
  const float gz = b.amplitude * sz + b.second_amplitude * sine((b.slower_frequency * w + b.q2[2]) + b.phase * sy);
  return (gx * gy) * gz;
}

namespace {

float smooth_at(const FloatBody& b, float x, float y, float z, float& noise) {
  const float u = ((b.m[0] * x + b.m[1] * y) + b.m[2] * z) + b.t[0];
  const float v = ((b.m[3] * x + b.m[4] * y) + b.m[5] * z) + b.t[1];
  const float w = ((b.m[6] * x + b.m[7] * y) + b.m[8] * z) + b.t[2];
  noise = noise_reference(b, u, v, w);
  return ((1.0F - u * u) - v * v) - w * w;
}

}  // namespace

float smooth_reference(const FloatBody& b, float x, float y, float z) {
  float noise = 0.0F;
  return smooth_at(b, x, y, z, noise);
}

bool is_inside_reference(const FloatBody& b, float x, float y, float z) {
  float noise = 0.0F;
  const float smooth = smooth_at(b, x, y, z, noise);
  return smooth + noise >= 0.0F;
}

bool is_in_deformed_reference(const FloatBody& body, std::span<const FloatBody> neighbours, bool largest_only, float x, float y, float z) {
  float taken = 0.0F;
  float noise = 0.0F;
  for (const FloatBody& other : neighbours) {
    const float smooth = smooth_at(other, x, y, z, noise);
    const float field = smooth + noise;
    const float takes = field > 0.0F ? field : 0.0F;
    taken = largest_only ? (takes > taken ? takes : taken) : taken + takes;
  }
  const float smooth = smooth_at(body, x, y, z, noise);
  return (smooth + noise) - taken >= 0.0F;
}

bool is_covered_reference(const Cover& c, float x, float y, float z) {
  const float dx = x - c.centre[0];
  const float dy = y - c.centre[1];
  const float dz = z - c.centre[2];
  const float squares = (c.xx * (dx * dx) + c.yy * (dy * dy)) + c.zz * (dz * dz);
  const float products = (c.xy * (dx * dy) + c.xz * (dx * dz)) + c.yz * (dy * dz);
  return squares + (products + products) <= 1.0F;
}

}  // namespace colony::kernel
