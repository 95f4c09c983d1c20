// cell: the complete state of one cell, s = (r, r_c, A, B, C, W1, W2, W3, T) of the paper (section 3) and our additions.
// Units:  um, um3, h, rad. The dish is the plane z = 0, cells live in z >= 0.
// Every double is finite and canonical (no -0.0): what is applied is what is stored.
// Layout: without padding but for three bytes, since there are as many cells as memory allows (tests hold its size).
#pragma once

#include <cstdint>

#include "engine/base/slim_optional.hpp"
#include "engine/base/types.hpp"

namespace colony {

enum class Activity : std::uint8_t { kActive = 0, kPassive = 1, kSenescent = 2 };

struct Cell {
  CellId id;
  SlimOptional<CellId> parent_id;          // none for a founder
  std::int32_t generation = 0;             // divisions down its lineage
  std::uint32_t ordinal = 0;               // events of which it was the subject
  std::int32_t try_count = 0;              // failed searches since it was founded, born or woken
  Activity activity = Activity::kActive;
  Vec3 centre_um = Vec3::Zero();           // r
  Vec3 nucleus_um = Vec3::Zero();          // r_c
  double nucleus_radius_um = 0.0;          // horizontal radius r_n of the oblate nucleus
  Vec3 semiaxes_um = Vec3::Zero();         // (A, B, C)
  Vec3 rotation_rad = Vec3::Zero();        // rotation vector (W1, W2, W3); orientation = Rodrigues(W)
  Vec3 noise_offset = Vec3::Zero();        // added to (u, v, w); dimensionless
  double born_h = 0.0;                     // T, time of the last splitting
  SlimOptional<double> due_h;              // next division attempt; none while asleep or senescent
  SlimOptional<double> settle_due_h;       // none once the nucleus has settled
  SlimOptional<double> move_due_h;         // none without motility
  SlimOptional<double> free_share;         // of the surroundings, at the last failed search or waking
  double volume_um3 = 0.0;                 // noise-free ellipsoid above the dish, analytic
  SlimOptional<double> deformed_volume_um3;// estimate at settling
  SlimOptional<Vec3> nearest_membrane_um;  // m, stored at settling; the next splitting plane goes through it
  friend bool operator==(const Cell&, const Cell&) = default;
};

}  // namespace colony
