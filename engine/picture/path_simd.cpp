// The vector kernel of path_kernel.hpp. Compiled once per target; the numbers are the same on each.
#define HWY_COMPILE_ALL_ATTAINABLE
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/picture/path_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/picture/path_kernel.hpp"
#include "engine/space/field_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace colony::kernel::HWY_NAMESPACE {

// Per active body and lane group, kWidest floats each.
enum Slot : std::size_t { kU, kV, kW, kSmooth, kNow, kBefore, kCell, kNucleus, kNucleusLow, kNucleusHigh, kSlots };
constexpr std::size_t kWidest = HWY_MAX_BYTES / sizeof(float);

struct Part {
  V low, high;
};

/// Cuts the part of [0, 1] where the line from `from` to `to` is >= 0 out of `part`.
HWY_INLINE void cut(Part& part, V from, V to) {
  const D d;
  const V zero = hn::Zero(d);
  const auto starts_in = hn::Ge(from, zero);
  const auto ends_in = hn::Ge(to, zero);
  if (hn::AllTrue(d, hn::And(starts_in, ends_in))) return;
  const V root = hn::Div(from, hn::Sub(from, to));
  const V low = hn::IfThenElseZero(hn::AndNot(starts_in, ends_in), root);
  const V high = hn::IfThenElse(hn::AndNot(ends_in, starts_in), root, constant(1.0F));
  part.low = hn::IfThenElse(hn::Gt(low, part.low), low, part.low);
  part.high = hn::IfThenElse(hn::Lt(high, part.high), high, part.high);
  part.high = hn::IfThenElse(hn::Or(starts_in, ends_in), part.high, constant(-1.0F));
}

HWY_INLINE V positive(V x) { return hn::IfThenElseZero(hn::Gt(x, hn::Zero(D())), x); }

struct Group {
  std::span<const PathBody> bodies;
  bool largest_only;
  float dz;
  PathBuffer* buffer;

  float* lanes(std::size_t active, Slot slot) const {
    return buffer->lanes.data() + (active * kSlots + slot) * kWidest;
  }
  V load(std::size_t active, Slot slot) const { return hn::LoadU(D(), lanes(active, slot)); }
  void store(std::size_t active, Slot slot, V value) const { hn::StoreU(value, D(), lanes(active, slot)); }

  void prepare(V x, V y) const;
  void evaluate(std::size_t level) const;
  void add_interval(std::size_t level) const;
};

// Which bodies the columns can meet, and between which levels.
void Group::prepare(V x, V y) const {
  const D d;
  const std::size_t lane_count = hn::Lanes(d);
  const V zero = hn::Zero(d);
  buffer->active.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const PathBody& b = bodies[i];
    const float* m = b.field.m;
    const V u = row(m, b.field.t[0], x, y, zero);
    const V v = row(m + 3, b.field.t[1], x, y, zero);
    const V w = row(m + 6, b.field.t[2], x, y, zero);
    // Along the column the smooth field is the parabola peak - step2 (z - middle)^2.
    const float step2 = m[2] * m[2] + m[5] * m[5] + m[8] * m[8];
    const V slope =
        hn::Add(hn::Add(hn::Mul(u, constant(m[2])), hn::Mul(v, constant(m[5]))), hn::Mul(w, constant(m[8])));
    const V peak = hn::Add(smooth_field(u, v, w), hn::Div(hn::Mul(slope, slope), constant(step2)));
    const V above = hn::Add(peak, constant(b.field.band + 1e-3F));  // the slack is for rounding alone
    const auto near = hn::Ge(above, zero);
    if (hn::AllFalse(d, near)) continue;
    const V middle = hn::Div(hn::Neg(slope), constant(step2));
    const V reach = hn::Sqrt(hn::Div(positive(above), constant(step2)));
    HWY_ALIGN float lows[kWidest], highs[kWidest];
    hn::Store(hn::IfThenElse(near, hn::Sub(middle, reach), constant(1e9F)), d, lows);
    hn::Store(hn::IfThenElse(near, hn::Add(middle, reach), constant(-1.0F)), d, highs);
    float low = 1e9F, high = -1.0F;
    for (std::size_t lane = 0; lane < lane_count; ++lane) {
      low = lows[lane] < low ? lows[lane] : low;
      high = highs[lane] > high ? highs[lane] : high;
    }
    if (!(high > 0.0F)) continue;
    const std::size_t at = buffer->active.size();
    if (buffer->lanes.size() < (at + 1) * kSlots * kWidest) buffer->lanes.resize(2 * (at + 1) * kSlots * kWidest);
    PathBuffer::Active active;
    active.body = i;
    active.first_level = low > 0.0F ? static_cast<std::size_t>(low / dz) : 0;
    active.end_level = static_cast<std::size_t>(high / dz) + 2;
    const float step = hn::GetLane(hn::Sqrt(constant(step2))) * dz;
    active.margin = 3.0F * step + step * step;

    const V dx = hn::Sub(x, constant(b.nucleus_x));
    const V dy = hn::Sub(y, constant(b.nucleus_y));
    const V distance2 = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
    const V share = hn::Sub(constant(1.0F), hn::Div(distance2, constant(b.nucleus_radius * b.nucleus_radius)));
    const auto in_nucleus = hn::Gt(share, zero);
    active.has_nucleus = !hn::AllFalse(d, in_nucleus);
    const V half = hn::Mul(constant(b.nucleus_half_height), hn::Sqrt(positive(share)));
    buffer->active.push_back(active);
    store(at, kNucleusLow, hn::IfThenElse(in_nucleus, hn::Sub(constant(b.nucleus_z), half), constant(1.0F)));
    store(at, kNucleusHigh, hn::IfThenElseZero(in_nucleus, hn::Add(constant(b.nucleus_z), half)));
    store(at, kU, u);
    store(at, kV, v);
    store(at, kW, w);
    store(at, kCell, zero);
    store(at, kNucleus, zero);
  }
}

// f of every body at a level, into kNow; what was there goes to kBefore.
void Group::evaluate(std::size_t level) const {
  const D d;
  const V z = constant(static_cast<float>(level) * dz);
  const V outside = constant(-1.0F);
  // Lanes where one body, and where two or more, may be positive here or at the next level.
  auto once = hn::Gt(hn::Zero(d), hn::Zero(d));
  auto twice = once;
  for (std::size_t a = 0; a < buffer->active.size(); ++a) {
    const PathBuffer::Active& active = buffer->active[a];
    store(a, kBefore, load(a, kNow));
    if (level < active.first_level || level >= active.end_level) continue;
    const FloatBody& b = bodies[active.body].field;
    const V u = hn::Add(load(a, kU), hn::Mul(constant(b.m[2]), z));
    const V v = hn::Add(load(a, kV), hn::Mul(constant(b.m[5]), z));
    const V w = hn::Add(load(a, kW), hn::Mul(constant(b.m[8]), z));
    const V smooth = smooth_field(u, v, w);
    store(a, kSmooth, smooth);
    const auto near = hn::Ge(smooth, constant(-(b.band + active.margin)));
    twice = hn::Or(twice, hn::And(once, near));
    once = hn::Or(once, near);
  }
  for (std::size_t a = 0; a < buffer->active.size(); ++a) {
    PathBuffer::Active& active = buffer->active[a];
    V value = outside;
    if (level >= active.first_level && level < active.end_level) {
      const FloatBody& b = bodies[active.body].field;
      const V smooth = load(a, kSmooth);
      const float limit = b.band + active.margin;
      value = smooth;
      const auto needs = hn::And(hn::Ge(smooth, constant(-limit)), hn::Or(twice, hn::Le(smooth, constant(limit))));
      if (b.amplitude > 0.0F && !hn::AllFalse(d, needs)) {
        const V u = hn::Add(load(a, kU), hn::Mul(constant(b.m[2]), z));
        const V v = hn::Add(load(a, kV), hn::Mul(constant(b.m[5]), z));
        const V w = hn::Add(load(a, kW), hn::Mul(constant(b.m[8]), z));
        value = hn::IfThenElse(needs, hn::Add(smooth, noise(b, u, v, w)), smooth);
      }
    }
    store(a, kNow, value);
    const auto anywhere = hn::Or(hn::Ge(value, hn::Zero(d)), hn::Ge(load(a, kBefore), hn::Zero(d)));
    active.positive = !hn::AllFalse(d, anywhere);
  }
}

// What each cell holds between the level before and this one.
void Group::add_interval(std::size_t level) const {
  const D d;
  const V zero = hn::Zero(d);
  const V one = constant(1.0F);
  const std::size_t count = buffer->active.size();
  std::size_t positive_count = 0;
  for (const PathBuffer::Active& active : buffer->active) positive_count += active.positive ? 1 : 0;
  for (std::size_t i = 0; i < count; ++i) {
    const PathBuffer::Active& active = buffer->active[i];
    if (!active.positive) continue;
    const V from = load(i, kBefore);
    const V to = load(i, kNow);
    Part part{zero, one};
    cut(part, from, to);
    if (positive_count > 1) {
      V sum_from = zero, sum_to = zero, most_from = zero, most_to = zero;
      for (std::size_t j = 0; j < count; ++j) {
        if (j == i || !buffer->active[j].positive) continue;
        const V other_from = load(j, kBefore);
        const V other_to = load(j, kNow);
        cut(part, hn::Sub(from, other_from), hn::Sub(to, other_to));
        const V takes_from = positive(other_from);
        const V takes_to = positive(other_to);
        sum_from = hn::Add(sum_from, takes_from);
        sum_to = hn::Add(sum_to, takes_to);
        most_from = hn::IfThenElse(hn::Gt(takes_from, most_from), takes_from, most_from);
        most_to = hn::IfThenElse(hn::Gt(takes_to, most_to), takes_to, most_to);
      }
      if (!largest_only && positive_count > 2) {
        // Where one neighbour alone takes, f_i - f_j has said it all.
        const auto several = hn::Or(hn::Gt(sum_from, most_from), hn::Gt(sum_to, most_to));
        cut(part, hn::IfThenElse(several, hn::Sub(from, sum_from), one),
            hn::IfThenElse(several, hn::Sub(to, sum_to), one));
      }
    }
    store(i, kCell, hn::Add(load(i, kCell), hn::Mul(positive(hn::Sub(part.high, part.low)), constant(dz))));
    if (!active.has_nucleus) continue;
    const V start = constant(static_cast<float>(level - 1));
    const V low = hn::Mul(hn::Add(start, part.low), constant(dz));
    const V high = hn::Mul(hn::Add(start, part.high), constant(dz));
    const V nucleus_low = load(i, kNucleusLow);
    const V nucleus_high = load(i, kNucleusHigh);
    const V common = hn::Sub(hn::IfThenElse(hn::Lt(high, nucleus_high), high, nucleus_high),
                             hn::IfThenElse(hn::Gt(low, nucleus_low), low, nucleus_low));
    store(i, kNucleus, hn::Add(load(i, kNucleus), positive(common)));
  }
}

void column_paths_kernel(std::span<const PathBody> bodies, bool largest_only, const float* HWY_RESTRICT x, float y,
                         std::size_t n, float dz, PathBuffer& buffer, float* HWY_RESTRICT cell,
                         float* HWY_RESTRICT nucleus) {
  const D d;
  const std::size_t lane_count = hn::Lanes(d);
  for (std::size_t i = 0; i < bodies.size() * kPathRun; ++i) cell[i] = nucleus[i] = 0.0F;
  const Group group{bodies, largest_only, dz, &buffer};
  for (std::size_t first = 0; first < n; first += lane_count) {
    group.prepare(hn::LoadU(d, x + first), constant(y));
    if (buffer.active.empty()) continue;
    std::size_t begin = buffer.active[0].first_level, end = 0;
    for (const PathBuffer::Active& active : buffer.active) {
      begin = active.first_level < begin ? active.first_level : begin;
      end = active.end_level > end ? active.end_level : end;
    }
    for (std::size_t a = 0; a < buffer.active.size(); ++a) group.store(a, kNow, constant(-1.0F));
    group.evaluate(begin);
    for (std::size_t level = begin + 1; level <= end; ++level) {
      group.evaluate(level);
      group.add_interval(level);
    }
    for (std::size_t a = 0; a < buffer.active.size(); ++a) {
      const std::size_t at = buffer.active[a].body * kPathRun + first;
      hn::StoreU(group.load(a, kCell), d, cell + at);
      hn::StoreU(group.load(a, kNucleus), d, nucleus + at);
    }
  }
}

}  // namespace colony::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colony::kernel {

HWY_EXPORT(column_paths_kernel);

void column_paths(std::span<const PathBody> bodies, bool largest_only, const float* x, float y, std::size_t n, float dz,
                  PathBuffer& buffer, float* cell, float* nucleus) {
  HWY_DYNAMIC_DISPATCH(column_paths_kernel)(bodies, largest_only, x, y, n, dz, buffer, cell, nucleus);
}

}  // namespace colony::kernel
#endif
