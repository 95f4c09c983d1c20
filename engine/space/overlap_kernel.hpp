// overlap_kernel: the sign of one body's field over arrays of points, single precision: the hot loop of the whole engine.
// Method:  Highway, dispatched at run time over SSSE3, SSE4, AVX2, AVX3 and its target without vectors (SCALAR; EMU128 from GCC 12.3 on, see
//          engine/DESIGN.md, "What it promises"); the plain C++ twin does the same operations in the same order.
// Why the same bits everywhere: only + - * and conversions, in a fixed order per point; no multiply-add, no contraction
// (compiler flags), no reduction over points but integer counts. So a point's value does not depend on the width it was computed in.
// Threads: pure but for the caller's buffers and CountWork.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/shape/body.hpp"

namespace colony::kernel {

/// Arrays handed to the kernels must be readable (finite values) this far beyond their n, and writable for outputs.
inline constexpr std::size_t kPadding = 64;

/// A body prepared for points given relative to `origin`.
struct FloatBody {
  float m[9];               // (u, v, w) = m (p - origin) + t
  float t[3];
  float q1[3], q2[3];       // phases of the two sines along each axis: the noise offset, reduced to [0, 2 pi)
  float frequency, slower_frequency, amplitude, second_amplitude, phase;
  float band;               // |1 - u^2 - v^2 - w^2| above this: the sign needs no noise
  float low[2], high[2];    // beyond these along x or y, 1 - u^2 - v^2 - w^2 is below -band as computed: not evaluated there
  FloatBody() = default;    // of no body: to be overwritten
  FloatBody(const Body& body, const Vec3& origin_um);
};

/// The points whose sign needs the noise, gathered. Grows, never shrinks.
struct BandBuffer {
  std::vector<float> u, v, w, smooth, x, y, z;
  void hold(std::size_t n);
};

/// What kernels did, for benchmarks; it grows with every call. Counted in points, not in vectors: a vector computes all of its lanes, and
/// its noise even where one lane alone asks for it, so the machine does somewhat more than these numbers say.
struct CountWork {
  std::uint64_t field_count = 0;     // evaluations of one body's field at one point (or cube's centre), wherever they are made
  std::uint64_t noise_count = 0;     // of those, where the sign needed the noise
  std::uint64_t lookup_count = 0;    // points that asked the voxels how many neighbours cover them: no field is evaluated for that
  std::uint64_t cover_count = 0;     // points asked of noise-free covers (free share), an upper bound: the first that holds a point ends it
  CountWork& operator+=(const CountWork& other) {
    field_count += other.field_count;
    noise_count += other.noise_count;
    lookup_count += other.lookup_count;
    cover_count += other.cover_count;
    return *this;
  }
};

/// How many of n points are inside. (Here and below: `work` may be null.)
std::uint32_t count_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band,
                           CountWork* work = nullptr);

/// The same, and copies the inside points to out_x, out_y, out_z (in no particular order). out may not overlap the input.
std::uint32_t select_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, BandBuffer& band,
                            float* out_x, float* out_y, float* out_z, CountWork* work = nullptr);

/// counts[j] = how many of n points are inside bodies[j]. Fast where neighbouring points of the arrays are neighbours in space.
void count_each(std::span<const FloatBody> bodies, const float* x, const float* y, const float* z, std::size_t n, std::uint32_t* counts,
                CountWork& work);

/// The twin of one point in plain C++: no shortcut, the noise always evaluated.
bool is_inside_reference(const FloatBody& body, float x, float y, float z);
/// The field without noise, plain C++.
float smooth_reference(const FloatBody& body, float x, float y, float z);
/// Gardner's noise at (u, v, w) in the cell's frame, plain C++.
float noise_reference(const FloatBody& body, float u, float v, float w);

/// The vector target in use, e.g. "AVX2".
const char* vector_target();

}  // namespace colony::kernel
