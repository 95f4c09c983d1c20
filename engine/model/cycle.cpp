#include "engine/model/cycle.hpp"

#include <cmath>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr double kTruncation_sd = 3.0;
constexpr std::uint32_t kCommonLane = 2;
constexpr int kRejectionsMax = 1000;  // each fails with probability 0.0027: never reached

bool within(double z) { return z >= -kTruncation_sd && z <= kTruncation_sd; }

double cycle_from_normal(const CycleParams& cycle, double z) {
  if (cycle.distribution == CycleDistribution::kNormal) return cycle.mean_h + cycle.sd_h * z;
  return cycle.mean_h + cycle.half_range_h * (2.0 * maths::normal_cdf(z) - 1.0);
}

}  // namespace

double draw_cycle_h(const CycleParams& cycle, Stream& stream) {
  if (cycle.distribution == CycleDistribution::kUniform) {
    return stream.uniform({cycle.mean_h - cycle.half_range_h, cycle.mean_h + cycle.half_range_h});
  }
  for (int i = 0; i < kRejectionsMax; ++i) {
    const double z = stream.normal();
    if (within(z)) return cycle.mean_h + cycle.sd_h * z;
  }
  CHECK(false && "a truncated normal was rejected a thousand times");
  return cycle.mean_h;
}

std::array<double, 2> draw_sibling_cycles_h(const CycleParams& cycle, Seed seed, CellId parent, std::uint32_t ordinal) {
  Stream own(seed, parent, ordinal, Purpose::kCycle, 0);
  Stream daughter(seed, parent, ordinal, Purpose::kCycle, 1);
  if (cycle.sibling_correlation == 0.0) return {draw_cycle_h(cycle, own), draw_cycle_h(cycle, daughter)};

  // For uniforms made from normals, the normals' correlation is 2 sin(pi rho / 6) (Pearson 1907).
  const double rho = cycle.distribution == CycleDistribution::kNormal
                         ? cycle.sibling_correlation
                         : 2.0 * maths::sincos(maths::kPi * cycle.sibling_correlation / 6.0).sin;
  Stream common(seed, parent, ordinal, Purpose::kCycle, kCommonLane);
  for (int i = 0; i < kRejectionsMax; ++i) {
    const double shared = std::sqrt(rho) * common.normal();
    const double a = shared + std::sqrt(1.0 - rho) * own.normal();
    const double b = shared + std::sqrt(1.0 - rho) * daughter.normal();
    const bool truncated = cycle.distribution == CycleDistribution::kNormal && !(within(a) && within(b));
    if (!truncated) return {cycle_from_normal(cycle, a), cycle_from_normal(cycle, b)};
  }
  CHECK(false && "a truncated pair was rejected a thousand times");
  return {cycle.mean_h, cycle.mean_h};
}

}  // namespace colony
