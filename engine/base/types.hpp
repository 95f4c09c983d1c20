// types: the few types that every part of the engine shares.
// Units: um for lengths, h for times, rad for angles.
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace colony {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Identity of a cell: 1, 2, 3, ... in the order in which events create cells; never reused. 0 is no cell (image background).
struct CellId {
  std::uint32_t value = 0;
  friend constexpr auto operator<=>(CellId, CellId) = default;
};

/// Seed of a job, 0..kSeedMax: every integer that JSON can carry without loss.
using Seed = std::uint64_t;
inline constexpr Seed kSeedMax = (Seed{1} << 53) - 1;

/// A closed interval [low, high].
struct Interval {
  double low = 0.0;
  double high = 0.0;
  friend bool operator==(const Interval&, const Interval&) = default;
};

}  // namespace colony
