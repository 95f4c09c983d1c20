// splitting: the plane in which a cell divides, and how its nucleus comes to rest.
// Method:  the plane holds the nucleus centre c, the nearest membrane point m and the substrate normal; its normal is the
//          principal splitting direction. m is the nearest of kSettlePoints Sobol points of the slab |z - c_z| <= 0.3 C, z >= 0,
//          that lie outside the deformed cell: without the slab a flat cell's nearest membrane would always be its top.
//          With several layers there is no slab, and the plane holds c, m and a uniformly random perpendicular to m - c: its normal
//          is then one too.
// Units:   um.
// Random:  the caller's point sets.        Threads: pure.
// Source:  the paper, section 4.2 (Hertwig's long-axis rule); the substrate normal, because two points do not fix a plane, is ours.
#pragma once

#include <optional>
#include <span>

#include "engine/model/params.hpp"
#include "engine/random/sobol.hpp"
#include "engine/shape/body.hpp"
#include "engine/space/overlap.hpp"

namespace colony {

inline constexpr std::uint32_t kSettlePoints = 4096;
inline constexpr std::uint32_t kIsolationPoints = 4096;
inline constexpr std::uint32_t kIsolationPrefix = 256;   // looked at first

/// The point nearest to `nucleus_um` (ties: the first) among the points outside f~ of the slab (one layer) or of the body's box above the
/// dish (several); none if every point is inside.
std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points, OverlapScratch& scratch,
                                        Layers layers = Layers::kMono);
std::optional<Vec3> nearest_membrane_um(const Body& body, std::span<const Body* const> neighbours, ContactRule rule,
                                        const Vec3& nucleus_um, const PointSet& points, Layers layers = Layers::kMono);

/// One layer: unit normal of the splitting plane: horizontal, across m - c. None if m lies straight above or below c.
std::optional<Vec3> splitting_normal(const Vec3& nucleus_um, const Vec3& nearest_membrane_um);
/// Several layers: the unit vector across m - c at `angle_rad` from a fixed one; uniform on its circle if the angle is. None if m = c.
std::optional<Vec3> splitting_normal(const Vec3& nucleus_um, const Vec3& nearest_membrane_um, double angle_rad);

}  // namespace colony
