// overlap: how much of one cell body lies inside its neighbours.
// Method:  scrambled Sobol points in the body's own clipped box; integer hit counts. The field is evaluated in single precision
//          relative to the box's centre; its sign is decided without the noise outside the noise band.
// Units:   um, um3; fractions in [0, 1].
// Shapes:  points n x 3, n a power of two in [64, 65536].
// Errors:  CHECKs n. Estimates: relative RMS error of a ball's volume 3.4 % at n = 256, 0.39 % at 4096 (tests/unit/space_test.cpp).
// Threads: pure but for the caller's scratch.
// Source:  the paper, section 4.1; the single point set for all pairs is ours (engine/DESIGN.md).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/random/sobol.hpp"
#include "engine/shape/body.hpp"
#include "engine/space/overlap_kernel.hpp"

namespace colony {

/// Point `i` of the unit cube's `points`, placed in `box`, um, double precision.
Vec3 placed_um(const Box& box, const PointSet& points, std::size_t i);

/// Integers from which fitness is made.
struct OverlapCounts {
  std::uint32_t point_count = 0;
  std::uint32_t hit_count = 0;                 // points inside the body
  std::uint32_t outside_wall_count = 0;        // of those, beyond the dish's wall
  std::vector<std::uint32_t> shared_counts;    // per neighbour: inside both
  /// 1 - sum shared / hits, clamped to [0, 1]; 0 for a body without hits or across the wall.
  double fitness() const;
};

/// Buffers that are kept from call to call; one per thread.
struct OverlapScratch {
  std::vector<float> x, y, z;                  // points under test
  std::vector<float> inside_x, inside_y, inside_z;
  kernel::BandBuffer band;
  std::vector<kernel::FloatBody> bodies;
  std::vector<std::size_t> indices;
  std::vector<std::uint32_t> shared;
  kernel::CountWork work;                      // grows with every call
};

/// Counts for `body` against each of `neighbours` (any that cannot touch count 0). `wall_radius_um`: the dish, centred at the origin.
void count_overlaps(const Body& body, std::span<const Body* const> neighbours, std::optional<double> wall_radius_um,
                    const PointSet& points, OverlapScratch& scratch, OverlapCounts& out);

/// Most bodies that find no room fail by far, and the first points of a set show it at a fraction of the cost: a fitness on kLookPoints that is
/// below what is asked by more than kLookMargin (about five standard errors) settles the matter.
inline constexpr std::uint32_t kLookPoints = 256;
inline constexpr double kLookMargin = 0.15;

/// The brute-force twin: every point, every neighbour, noise always evaluated, no boxes. The same counts to the last bit.
OverlapCounts count_overlaps_reference(const Body& body, std::span<const Body* const> neighbours,
                                       std::optional<double> wall_radius_um, const PointSet& points);

/// Reference form of the paper, double precision: |P| times the share of points in the admissible domain P with
/// min(f_a, f_b) >= 0. 0 if P is empty. P is the intersection of the clipped boxes.
double interpenetration_volume_um3(const Body& a, const Body& b, const PointSet& points);

/// The admissible domain of the paper: projections of the two boxes on the three coordinate planes intersected; empty if any is.
Box admissible_domain(const Body& a, const Body& b);

/// The interference relation S = 1: some point of the domain has min(f_a, f_b) >= 0.
bool touches(const Body& a, const Body& b, const PointSet& points, OverlapScratch& scratch);
bool touches(const Body& a, const Body& b, const PointSet& points);

/// Volume and centre of mass of the deformed body (the undeformed one if `neighbours` is empty), above the dish. Single precision at
/// the points, exact sums.
struct MassEstimate {
  double volume_um3 = 0.0;
  Vec3 centre_um = Vec3::Zero();               // the body's centre if there is no hit
  std::uint32_t hit_count = 0;
};
MassEstimate deformed_mass(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const PointSet& points,
                           OverlapScratch& scratch);
MassEstimate deformed_mass(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const PointSet& points);

/// The point nearest to `from_um` (ties: the first) among the points placed in `box` that lie outside the deformed body; none if all are
/// inside.
std::optional<Vec3> nearest_outside_um(const Box& box, const Vec3& from_um, const Body& body, std::span<const Body* const> neighbours,
                                       ContactRule rule, const PointSet& points, OverlapScratch& scratch);

/// True if f~ >= 0 at p (z >= 0), with as few evaluations as the signs allow.
bool deformed_contains(const Body& body, std::span<const Body* const> neighbours, ContactRule rule, const Vec3& point_um);

}  // namespace colony
