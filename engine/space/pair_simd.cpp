// The vector kernels of pair_kernel.hpp. Compiled once per target; the numbers are the same on each (overlap_kernel.hpp says why).
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/space/pair_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/space/field_inl.hpp"
#include "engine/space/pair_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {

// Where points that are not there (below the dish, past the end) are put: outside every body.
constexpr float kNowhere = 1e4F;

// Adds the indices of the neighbours whose noisy ellipsoid can reach the candidate's: boxes meet, and no plane across the line of
// centres separates them. Culling only: it may keep too many, never too few (the factor is for rounding).
std::size_t find_near(const CandidateBody& body, const NeighbourSet& set, std::uint32_t* out) {
  const D d;
  const hn::RebindToUnsigned<D> indices;
  const std::size_t lanes = hn::Lanes(d);
  const V half_x = hn::Sqrt(constant(body.form[0]));
  const V half_y = hn::Sqrt(constant(body.form[1]));
  const V half_z = hn::Sqrt(constant(body.form[2]));
  const V margin = constant(1.0001F);
  std::size_t count = 0;
  const auto quadratic = [&](V xx, V yy, V zz, V xy, V xz, V yz, V x, V y, V z) {
    const V diagonal = hn::Add(hn::Add(hn::Mul(xx, hn::Mul(x, x)), hn::Mul(yy, hn::Mul(y, y))), hn::Mul(zz, hn::Mul(z, z)));
    const V cross = hn::Add(hn::Add(hn::Mul(xy, hn::Mul(x, y)), hn::Mul(xz, hn::Mul(x, z))), hn::Mul(yz, hn::Mul(y, z)));
    return hn::Add(diagonal, hn::Add(cross, cross));
  };
  for (std::size_t j = 0; j < set.size(); j += lanes) {
    const V x = hn::Sub(hn::LoadU(d, set.centre[0].data() + j), constant(body.centre[0]));
    const V y = hn::Sub(hn::LoadU(d, set.centre[1].data() + j), constant(body.centre[1]));
    const V z = hn::Sub(hn::LoadU(d, set.centre[2].data() + j), constant(body.centre[2]));
    auto meet = hn::FirstN(d, set.size() - j);
    meet = hn::And(meet, hn::Le(hn::Abs(x), hn::Mul(margin, hn::Add(half_x, hn::LoadU(d, set.half[0].data() + j)))));
    meet = hn::And(meet, hn::Le(hn::Abs(y), hn::Mul(margin, hn::Add(half_y, hn::LoadU(d, set.half[1].data() + j)))));
    meet = hn::And(meet, hn::Le(hn::Abs(z), hn::Mul(margin, hn::Add(half_z, hn::LoadU(d, set.half[2].data() + j)))));
    if (hn::AllFalse(d, meet)) continue;
    const V own = quadratic(constant(body.form[0]), constant(body.form[1]), constant(body.form[2]), constant(body.form[3]),
                            constant(body.form[4]), constant(body.form[5]), x, y, z);
    const auto form = [&](int k) { return hn::LoadU(d, set.form[static_cast<std::size_t>(k)].data() + j); };
    const V other = quadratic(form(0), form(1), form(2), form(3), form(4), form(5), x, y, z);
    const V distance2 = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const V reach = hn::Add(hn::Sqrt(hn::Max(own, hn::Zero(d))), hn::Sqrt(hn::Max(other, hn::Zero(d))));
    meet = hn::And(meet, hn::Le(distance2, hn::Mul(margin, reach)));
    const auto ids = hn::Iota(indices, static_cast<std::uint32_t>(j));
    hn::StoreU(hn::Compress(ids, hn::RebindMask(indices, meet)), indices, out + count);
    count += hn::CountTrue(d, meet);
  }
  return count;
}

// Maps the own points first..last to the dish, into buffers; returns how many are above it.
std::uint32_t place_points(const SearchScene& scene, const CandidateBody& body, const OwnPoints& own, std::uint32_t first,
                           std::uint32_t last, PairBuffers& buffers, bool& beyond_wall) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t hits = 0;
  const float* a = body.axes;
  for (std::size_t i = first; i < last; i += lanes) {
    const V u = hn::LoadU(d, own.u.data() + i);
    const V v = hn::LoadU(d, own.v.data() + i);
    const V w = hn::LoadU(d, own.w.data() + i);
    const V x = row(a, body.centre[0], u, v, w);
    const V y = row(a + 3, body.centre[1], u, v, w);
    const V z = row(a + 6, body.centre[2], u, v, w);
    const auto above = hn::And(hn::Ge(z, constant(scene.dish_z)), hn::FirstN(d, last - i));
    hits += hn::CountTrue(d, above);
    if (scene.has_wall) {
      const V wx = hn::Sub(x, constant(scene.wall_x));
      const V wy = hn::Sub(y, constant(scene.wall_y));
      const auto beyond = hn::Gt(hn::Add(hn::Mul(wx, wx), hn::Mul(wy, wy)), constant(scene.wall_radius2));
      if (!hn::AllFalse(d, hn::And(beyond, above))) beyond_wall = true;
    }
    hn::StoreU(hn::IfThenElse(above, x, constant(kNowhere)), d, buffers.x.data() + (i - first));
    hn::StoreU(y, d, buffers.y.data() + (i - first));
    hn::StoreU(z, d, buffers.z.data() + (i - first));
  }
  return static_cast<std::uint32_t>(hits);
}

// How many of the n placed points lie inside the body.
HWY_INLINE std::uint32_t count_in(const FloatBody& body, std::size_t n, PairBuffers& buffers) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const V above = constant(body.band);
  const V below = constant(-body.band);
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; i += lanes) {
    const V x = hn::LoadU(d, buffers.x.data() + i);
    const V y = hn::LoadU(d, buffers.y.data() + i);
    const V z = hn::LoadU(d, buffers.z.data() + i);
    const V u = row(body.m, body.t[0], x, y, z);
    const V v = row(body.m + 3, body.t[1], x, y, z);
    const V w = row(body.m + 6, body.t[2], x, y, z);
    const V smooth = smooth_field(u, v, w);
    const auto near = hn::Ge(smooth, below);
    if (hn::AllFalse(d, near)) continue;
    const auto inside = hn::Gt(smooth, above);
    const auto undecided = hn::AndNot(inside, near);
    if (hn::AllFalse(d, undecided)) {
      count += hn::CountTrue(d, inside);
      continue;
    }
    buffers.noise_count += hn::CountTrue(d, undecided);
    const V field = hn::Add(smooth, noise(body, u, v, w));
    count += hn::CountTrue(d, hn::Or(inside, hn::And(undecided, hn::Ge(field, hn::Zero(d)))));
  }
  return static_cast<std::uint32_t>(count);
}

PairScore score_pair_kernel(const SearchScene& scene, const std::array<CandidateBody, 2>& pair, ShareLimit most_shared,
                            PairBuffers& buffers) {
  PairScore score;
  std::array<std::size_t, 2> near_count = {0, 0};
  std::array<bool, 2> culled = {false, false};
  const std::size_t stages = scene.own[0].stage_ends.size();
  std::array<std::uint32_t, 2> first = {0, 0};
  for (std::size_t stage = 0; stage < stages; ++stage) {
    for (std::size_t k = 0; k < 2; ++k) {
      const OwnPoints& own = scene.own[k];
      const std::uint32_t last = own.stage_ends[stage];
      if (first[k] == last) continue;
      score.hits[k] += place_points(scene, pair[k], own, first[k], last, buffers, score.beyond_wall);
      if (score.beyond_wall) return score;
      if (!culled[k]) {
        near_count[k] = find_near(pair[k], scene.neighbours, buffers.near[k].data());
        culled[k] = true;
      }
      const std::size_t n = last - first[k];
      first[k] = last;
      buffers.field_count += n * (near_count[k] + 1);
      const std::uint32_t by_sibling = count_in(pair[1 - k].field, n, buffers);
      score.sibling[k] += by_sibling;
      score.shared[k] += by_sibling;
      for (std::size_t j = 0;; ++j) {
        if (!most_shared.empty() && score.shared[k] > most_shared[score.hits[k]]) {
          buffers.field_count -= n * (near_count[k] - j);
          score.dropped = true;
          return score;
        }
        if (j == near_count[k]) break;
        score.shared[k] += count_in(scene.neighbours.bodies[buffers.near[k][j]], n, buffers);
      }
    }
  }
  return score;
}

void flag_inside_kernel(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, std::uint8_t* flags) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < n; i += lanes) {
    const V px = hn::LoadU(d, x + i);
    const V py = hn::LoadU(d, y + i);
    const V pz = hn::LoadU(d, z + i);
    const V u = row(body.m, body.t[0], px, py, pz);
    const V v = row(body.m + 3, body.t[1], px, py, pz);
    const V w = row(body.m + 6, body.t[2], px, py, pz);
    const V smooth = smooth_field(u, v, w);
    const auto near = hn::Ge(smooth, constant(-body.band));
    auto inside = hn::And(near, hn::Gt(smooth, constant(body.band)));
    if (!hn::AllFalse(d, hn::AndNot(inside, near))) {
      inside = hn::And(near, hn::Ge(hn::Add(smooth, noise(body, u, v, w)), hn::Zero(d)));
    }
    std::uint8_t bits[8 + 8];
    hn::StoreMaskBits(d, inside, bits);
    const std::size_t count = n - i < lanes ? n - i : lanes;
    for (std::size_t lane = 0; lane < count; ++lane) flags[i + lane] = (bits[lane >> 3] >> (lane & 7)) & 1;
  }
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(score_pair_kernel);
HWY_EXPORT(flag_inside_kernel);

namespace {
void hold(std::vector<float>& buffer, std::size_t n) {
  if (buffer.size() < n + kPadding) buffer.resize(n + kPadding);
}
}  // namespace

PairScore score_pair(const SearchScene& scene, const std::array<CandidateBody, 2>& pair, ShareLimit most_shared, PairBuffers& buffers) {
  const std::size_t n = scene.own[0].size() > scene.own[1].size() ? scene.own[0].size() : scene.own[1].size();
  hold(buffers.x, n);
  hold(buffers.y, n);
  hold(buffers.z, n);
  for (auto& near : buffers.near) {
    if (near.size() < scene.neighbours.size() + kPadding) near.resize(scene.neighbours.size() + kPadding);
  }
  return HWY_DYNAMIC_DISPATCH(score_pair_kernel)(scene, pair, most_shared, buffers);
}

void flag_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, std::uint8_t* flags) {
  HWY_DYNAMIC_DISPATCH(flag_inside_kernel)(body, x, y, z, n, flags);
}

}  // namespace colony::kernel
#endif
