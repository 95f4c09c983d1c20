// The vector kernels of pair_kernel.hpp and voxel_kernel.hpp. Compiled once per target; the numbers are the same on each (overlap_kernel.hpp says why).
#include <bit>

#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/space/pair_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/space/field_inl.hpp"
#include "engine/space/pair_kernel.hpp"
#include "engine/space/voxel_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {

struct Tally {
  std::uint32_t hits = 0, covering = 0, sibling = 0;
};

// Counts at the cubes with these indices (whole numbers below 2^23), summed over the lanes. One load a lane: a gather costs more on the
// CPUs we know (Zen).
HWY_INLINE std::uint32_t look_up(const std::uint8_t* counts, V cubes) {
  const D d;
  const hn::RebindToSigned<D> integers;
  HWY_ALIGN std::int32_t at[HWY_MAX_BYTES / sizeof(std::int32_t)];
  // Added to 2^23, a whole number below it stands in the mantissa.
  const auto bits = hn::BitCast(integers, hn::Add(cubes, constant(8388608.0F)));
  hn::Store(hn::And(bits, hn::Set(integers, 0x7fffff)), integers, at);
  std::uint32_t sum = 0;
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) sum += counts[at[lane]];
  return sum;
}

// The whole number of the cube at `value` >= 0 (in edges): value - 1/2 rounded to nearest, which is the floor but at the faces.
HWY_INLINE V cube_of(V value_less_half) {
  return hn::Sub(hn::Add(value_less_half, constant(12582912.0F)), constant(12582912.0F));
}

// The own points first..last of one body.
HWY_INLINE Tally tally(const SearchScene& scene, const CandidateBody& body, const FloatBody& sibling, const OwnPoints& own,
                       std::uint32_t first, std::uint32_t last, CountWork& work, bool& beyond_wall) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t hits = 0;
  std::size_t in_sibling = 0;
  std::uint32_t covering = 0;
  const float* a = body.axes;
  const V scale = constant(scene.voxels_per_um);
  const V nx = constant(scene.voxels_x);
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
    const V cube_x = cube_of(hn::Add(hn::Mul(x, scale), constant(scene.voxel_shift[0])));
    const V cube_y = cube_of(hn::Add(hn::Mul(y, scale), constant(scene.voxel_shift[1])));
    const V cube_z = cube_of(hn::Add(hn::Mul(z, scale), constant(scene.voxel_shift[2])));
    // Exact: all whole numbers below 2^23 (tests/unit/candidate_test.cpp).
    const V cube = hn::Add(hn::Mul(hn::Add(hn::Mul(cube_z, nx), cube_y), nx), cube_x);
    covering += look_up(scene.counts, hn::IfThenElse(above, cube, constant(scene.empty_cube)));

    const V su = row(sibling.m, sibling.t[0], x, y, z);
    const V sv = row(sibling.m + 3, sibling.t[1], x, y, z);
    const V sw = row(sibling.m + 6, sibling.t[2], x, y, z);
    const V smooth = smooth_field(su, sv, sw);
    in_sibling += hn::CountTrue(d, hn::And(above, hn::Ge(smooth, hn::Zero(d))));
  }
  work.field_count += hits;  // the sibling's; points below the dish are asked nothing
  work.lookup_count += hits;
  return {static_cast<std::uint32_t>(hits), covering, static_cast<std::uint32_t>(in_sibling)};
}

PairScore score_pair_kernel(const SearchScene& scene, const std::array<CandidateBody, 2>& pair, ShareLimit most_shared,
                            CountWork& work) {
  PairScore score;
  const std::size_t stages = scene.own[0].stage_ends.size();
  std::array<std::uint32_t, 2> first = {0, 0};
  for (std::size_t stage = 0; stage < stages; ++stage) {
    for (std::size_t k = 0; k < 2; ++k) {
      const OwnPoints& own = scene.own[k];
      const std::uint32_t last = own.stage_ends[stage];
      if (first[k] == last) continue;
      const Tally counted = tally(scene, pair[k], pair[1 - k].field, own, first[k], last, work, score.beyond_wall);
      if (score.beyond_wall) return score;
      first[k] = last;
      score.hits[k] += counted.hits;
      score.sibling[k] += counted.sibling;
      score.shared[k] += counted.covering + counted.sibling;
      if (!most_shared.empty() && score.shared[k] > most_shared[score.hits[k]]) {
        score.dropped = true;
        return score;
      }
    }
  }
  return score;
}

HWY_INLINE std::uint32_t bits_of(hn::Mask<D> mask) {
  std::uint8_t bytes[8 + 8] = {0};  // StoreMaskBits may write 8
  const std::size_t byte_count = hn::StoreMaskBits(D(), mask, bytes);
  std::uint32_t bits = 0;
  for (std::size_t byte = 0; byte < byte_count; ++byte) bits |= static_cast<std::uint32_t>(bytes[byte]) << (8 * byte);
  return bits;
}

// Cubes whose sign needs the noise, gathered: in a row of a body one in three does, and a vector that holds one pays for all of its lanes.
class BandCubes {
 public:
  BandCubes(const FloatBody& body, std::uint32_t* rows, CountWork& work) : body_(body), rows_(rows), work_(work) {}
  /// Lane l of the mask is bit first_bit + l of the rows.
  HWY_INLINE void add(V u, V v, V w, V smooth, hn::Mask<D> mask, std::int32_t first_bit) {
    const D d;
    const hn::RebindToSigned<D> integers;
    hn::StoreU(hn::Compress(u, mask), d, u_ + count_);
    hn::StoreU(hn::Compress(v, mask), d, v_ + count_);
    hn::StoreU(hn::Compress(w, mask), d, w_ + count_);
    hn::StoreU(hn::Compress(smooth, mask), d, smooth_ + count_);
    const auto lane_bits = hn::Add(lanes_, hn::Set(integers, first_bit));
    hn::StoreU(hn::BitCast(integers, hn::Compress(hn::BitCast(d, lane_bits), mask)), integers, bit_ + count_);
    count_ += hn::CountTrue(d, mask);
    if (count_ > kHeld) decide();
  }
  void decide() {
    const D d;
    for (std::size_t i = 0; i < count_; i += hn::Lanes(d)) {
      const V field = hn::Add(hn::LoadU(d, smooth_ + i), noise(body_, hn::LoadU(d, u_ + i), hn::LoadU(d, v_ + i), hn::LoadU(d, w_ + i)));
      const auto inside = hn::And(hn::Ge(field, hn::Zero(d)), hn::FirstN(d, count_ - i));
      for (std::uint32_t bits = bits_of(inside); bits != 0; bits &= bits - 1) {
        const auto bit = static_cast<std::uint32_t>(bit_[i + static_cast<std::size_t>(std::countr_zero(bits))]);
        rows_[bit / 32] |= 1U << (bit % 32);
      }
    }
    work_.noise_count += count_;
    count_ = 0;
  }

 private:
  static constexpr std::size_t kHeld = 512;
  static constexpr std::size_t kRoom = kHeld + 2 * kPadding;
  const FloatBody& body_;
  std::uint32_t* rows_;
  CountWork& work_;
  const hn::Vec<hn::RebindToSigned<D>> lanes_ = hn::Iota(hn::RebindToSigned<D>(), 0);
  std::size_t count_ = 0;
  float u_[kRoom], v_[kRoom], w_[kRoom], smooth_[kRoom];
  std::int32_t bit_[kRoom];
};

// Cubes of a body: see voxel_kernel.hpp. Of each row only what lies inside the noisy ellipsoid is asked: |p + x e|^2 <= 1 + band solved for x,
// for a vector of rows at a time. The ellipsoid is widened by a thousandth: a hundred times what single precision may err by.
void raster_kernel(const FloatBody& body, float edge, std::int32_t nx, std::int32_t ny, std::int32_t nz, std::int32_t words_per_row,
                   std::uint32_t* HWY_RESTRICT rows, CountWork& work) {
  const D d;
  const hn::RebindToSigned<D> integers;
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
  const V lane_numbers = hn::ConvertTo(d, hn::Iota(integers, 0));  // once: it goes through memory
  BandCubes band(body, rows, work);
  const float* m = body.m;
  const float a = (m[0] * m[0] + m[3] * m[3]) + m[6] * m[6];
  const V in_edges = constant(1.0F / (a * edge));
  const V radius2 = constant((1.0F + body.band) * 1.001F);
  HWY_ALIGN float first[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float last[HWY_MAX_BYTES / sizeof(float)];
  for (std::int32_t k = 0; k < nz; ++k) {
    const V z = constant(edge * static_cast<float>(k));
    for (std::int32_t first_j = 0; first_j < ny; first_j += lanes) {
      const V ys = hn::Mul(constant(edge), hn::Add(lane_numbers, constant(static_cast<float>(first_j))));
      const V u0 = row(m, body.t[0], hn::Zero(d), ys, z);
      const V v0 = row(m + 3, body.t[1], hn::Zero(d), ys, z);
      const V w0 = row(m + 6, body.t[2], hn::Zero(d), ys, z);
      const V along = hn::Add(hn::Add(hn::Mul(constant(m[0]), u0), hn::Mul(constant(m[3]), v0)), hn::Mul(constant(m[6]), w0));
      const V beyond = hn::Sub(hn::Add(hn::Add(hn::Mul(u0, u0), hn::Mul(v0, v0)), hn::Mul(w0, w0)), radius2);
      const V discriminant = hn::Sub(hn::Mul(along, along), hn::Mul(constant(a), beyond));
      const auto met = hn::Ge(discriminant, hn::Zero(d));
      if (hn::AllFalse(d, met)) continue;
      const V root = hn::Sqrt(hn::IfThenElseZero(met, discriminant));
      const V low = hn::Mul(hn::Neg(hn::Add(along, root)), in_edges);
      const V high = hn::Mul(hn::Sub(root, along), in_edges);
      const V end = constant(static_cast<float>(nx - 1));
      hn::Store(hn::IfThenElse(hn::Gt(low, hn::Zero(d)), low, hn::Zero(d)), d, first);
      hn::Store(hn::IfThenElse(met, hn::IfThenElse(hn::Lt(high, end), high, end), constant(-1.0F)), d, last);
      const std::int32_t row_count = ny - first_j < lanes ? ny - first_j : lanes;
      for (std::int32_t lane = 0; lane < row_count; ++lane) {
        if (!(last[lane] >= first[lane])) continue;
        const auto from = static_cast<std::int32_t>(first[lane]);
        const auto to = static_cast<std::int32_t>(last[lane]) + 1;
        const std::int32_t j = first_j + lane;
        const V y = constant(edge * static_cast<float>(j));
        const std::int32_t row_at = (k * ny + j) * words_per_row;
        work.field_count += static_cast<std::uint64_t>(to - from);
        for (std::int32_t i = from; i < to; i += lanes) {
          const V x = hn::Mul(constant(edge), hn::Add(lane_numbers, constant(static_cast<float>(i))));
          const V u = row(m, body.t[0], x, y, z);
          const V v = row(m + 3, body.t[1], x, y, z);
          const V w = row(m + 6, body.t[2], x, y, z);
          const V smooth = smooth_field(u, v, w);
          const auto near = hn::And(hn::Ge(smooth, constant(-body.band)), hn::FirstN(d, static_cast<std::size_t>(to - i)));
          const auto inside = hn::And(near, hn::Gt(smooth, constant(body.band)));
          const std::uint64_t bits = std::uint64_t{bits_of(inside)} << (i % 32);
          std::uint32_t* words = rows + row_at + i / 32;
          words[0] |= static_cast<std::uint32_t>(bits);
          words[1] |= static_cast<std::uint32_t>(bits >> 32);
          const auto undecided = hn::AndNot(inside, near);
          if (!hn::AllFalse(d, undecided)) band.add(u, v, w, smooth, undecided, 32 * row_at + i);
        }
      }
    }
  }
  band.decide();
}

void add_rows_kernel(const RowRange& rows, std::int32_t first_x, std::int32_t n, std::uint8_t* HWY_RESTRICT counts) {
  const hn::CappedTag<std::uint8_t, 32> bytes;
  const std::size_t lanes = hn::Lanes(bytes);
  const auto one = hn::Set(bytes, std::uint8_t{1});
  const auto add_word = [&](std::uint32_t bits, std::uint8_t* to) {
    for (std::size_t i = 0; i < 32; i += lanes) {
      const std::uint64_t part = bits >> i;  // LoadMaskBits may read 8 bytes; lanes may be fewer than a byte's bits
      const auto mask = hn::LoadMaskBits(bytes, reinterpret_cast<const std::uint8_t*>(&part));
      const auto before = hn::LoadU(bytes, to + i);
      hn::StoreU(hn::SaturatedAdd(before, hn::IfThenElseZero(mask, one)), bytes, to + i);
    }
  };
  // Most rasters lie whole in the counts, a word a row; an empty row costs no more than the question whether it is.
  if (rows.words_per_row == 1 && first_x >= 0 && first_x + 32 <= n) {
    for (std::int32_t z = 0; z < rows.nz; ++z) {
      const std::uint32_t* words = rows.words + z * rows.ny;
      std::uint8_t* to = counts + (z * n + rows.at_y) * n + first_x;
      for (std::int32_t y = rows.first_y; y < rows.end_y; ++y) add_word(words[y], to + y * n);
    }
    return;
  }
  for (std::int32_t z = 0; z < rows.nz; ++z) {
    for (std::int32_t y = rows.first_y; y < rows.end_y; ++y) {
      const std::uint32_t* words = rows.words + (z * rows.ny + y) * rows.words_per_row;
      std::uint8_t* row = counts + (z * n + rows.at_y + y) * n;
      for (std::int32_t word = 0; word < rows.words_per_row; ++word) {
        std::int32_t x = first_x + 32 * word;
        std::uint32_t bits = words[word];
        if (x < 0) {
          bits = x > -32 ? bits >> -x : 0;
          x = 0;
        }
        if (x + 32 > n) bits = x < n ? bits & ((1U << (n - x)) - 1U) : 0;
        if (bits != 0) add_word(bits, row + x);
      }
    }
  }
}

void flag_inside_kernel(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, std::uint8_t* flags,
                        CountWork& work) {
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
    const auto near = hn::And(hn::Ge(smooth, constant(-body.band)), hn::FirstN(d, n - i));
    auto inside = hn::And(near, hn::Gt(smooth, constant(body.band)));
    const auto undecided = hn::AndNot(inside, near);
    if (!hn::AllFalse(d, undecided)) {
      work.noise_count += hn::CountTrue(d, undecided);
      inside = hn::And(near, hn::Ge(hn::Add(smooth, noise(body, u, v, w)), hn::Zero(d)));
    }
    std::uint8_t bits[8 + 8];
    hn::StoreMaskBits(d, inside, bits);
    const std::size_t count = n - i < lanes ? n - i : lanes;
    for (std::size_t lane = 0; lane < count; ++lane) flags[i + lane] = (bits[lane >> 3] >> (lane & 7)) & 1;
  }
  work.field_count += n;
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(score_pair_kernel);
HWY_EXPORT(raster_kernel);
HWY_EXPORT(add_rows_kernel);
HWY_EXPORT(flag_inside_kernel);

PairScore score_pair(const SearchScene& scene, const std::array<CandidateBody, 2>& pair, ShareLimit most_shared, CountWork& work) {
  return HWY_DYNAMIC_DISPATCH(score_pair_kernel)(scene, pair, most_shared, work);
}

void raster_rows(const FloatBody& body, float edge, std::int32_t nx, std::int32_t ny, std::int32_t nz, std::int32_t words_per_row,
                 std::uint32_t* rows, CountWork* work) {
  CountWork unused;
  HWY_DYNAMIC_DISPATCH(raster_kernel)(body, edge, nx, ny, nz, words_per_row, rows, work != nullptr ? *work : unused);
}

void add_rows(const RowRange& rows, std::int32_t first_x, std::int32_t n, std::uint8_t* counts) {
  HWY_DYNAMIC_DISPATCH(add_rows_kernel)(rows, first_x, n, counts);
}

void flag_inside(const FloatBody& body, const float* x, const float* y, const float* z, std::size_t n, std::uint8_t* flags,
                 CountWork* work) {
  CountWork unused;
  HWY_DYNAMIC_DISPATCH(flag_inside_kernel)(body, x, y, z, n, flags, work != nullptr ? *work : unused);
}

}  // namespace colony::kernel
#endif
