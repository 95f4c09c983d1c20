// voxels: how many neighbours cover each small cube about a dividing cell, so that a candidate's point costs one look-up however many
// neighbours there are.
// Method:  the plane is divided into cubes aligned to the dish. A body's raster (the cubes whose centre it holds, noise included) depends on
//          the body alone and is kept from search to search; a search adds the rasters of the bodies that its candidates can reach.
// Units:   um; the edge follows the parameters (voxel_edge_um), about an eighth of the smallest cell's size. A candidate's fitness is off by
//          0.03 rms and by nothing on average, less than the sampling of 256 points (0.04); the winner is scored by the field itself
//          (tests/unit/voxel_test.cpp).
// Why the same bits everywhere: rasters are signs of the same single-precision field on every vector target; counts are integers. What is
//          kept in the cache cannot matter: an entry is used only for the very body it was made from.
// Threads: one set of voxels per worker.
// Source:  ours (engine/DESIGN.md).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/model/params.hpp"
#include "engine/shape/body.hpp"
#include "engine/space/overlap_kernel.hpp"

namespace colony {

/// The cubes a body covers: rows along x, bit i of a row's words is cube x0 + i.
struct VoxelRaster {
  std::int32_t x0 = 0, y0 = 0, z0 = 0;   // in edges from the origin of the dish
  std::int32_t nx = 0, ny = 0, nz = 0;
  std::int32_t words_per_row = 0;
  std::vector<std::uint32_t> rows;       // (z, y, word); two words to spare
  bool holds(std::int32_t x, std::int32_t y, std::int32_t z) const;
};

void make_raster(const Body& body, double edge_um, VoxelRaster& out, kernel::CountWork* work = nullptr);
/// The brute-force twin, cube by cube.
void make_raster_reference(const Body& body, double edge_um, VoxelRaster& out);

/// Rasters of recent bodies, by cell id.
class RasterCache {
 public:
  explicit RasterCache(double edge_um) : edge_um_(edge_um) {}
  /// Valid until the next call. Adds the evaluations it took to `work`.
  const VoxelRaster& of(CellId id, const Body& body, kernel::CountWork& work);

 private:
  struct Slot {
    CellId id;                           // 0: empty
    Vec3 centre = Vec3::Zero();
    Mat3 to_unit = Mat3::Zero();
    Vec3 noise_offset = Vec3::Zero();
    VoxelRaster raster;
  };
  static constexpr std::size_t kSlotsMax = 8192;         // about 6 MiB with preset paper
  static constexpr std::size_t kBytesMax = 32U << 20;    // of rasters: when more would be kept, all others go

  double edge_um_;
  std::size_t bytes_ = 0;                // of the rasters kept
  std::vector<Slot> slots_;              // grows by doubling up to kSlotsMax; slot = id modulo size
};

/// Counts of covering bodies in a box of cubes.
class VoxelCounts {
 public:
  /// The box holds every candidate of any search with these parameters.
  explicit VoxelCounts(const Params& params);

  /// Empties it and moves it over `pivot_um`.
  void centre_on(const Vec3& pivot_um);
  void add(const VoxelRaster& raster);

  double edge_um() const { return edge_um_; }
  std::int32_t nx() const { return n_; }
  std::int32_t nz() const { return nz_; }
  /// Coordinate (um, absolute) of the low corner of the box.
  Vec3 corner_um() const { return {x0_ * edge_um_, y0_ * edge_um_, 0.0}; }
  /// Index of a count that stays 0.
  std::size_t empty_cube() const { return counts_.size() - 1; }
  /// counts()[(z * nx() + y) * nx() + x]. 255 stands for 255 and more.
  const std::uint8_t* counts() const { return counts_.data(); }

 private:
  double edge_um_;
  std::int32_t n_ = 0;                   // cubes along x and along y
  std::int32_t nz_ = 0;                  // the top layer is never covered
  std::int32_t x0_ = 0, y0_ = 0;
  std::vector<std::uint8_t> counts_;
};

/// In edges: how much higher a point is looked up than it lies. A point on the dish must not fall below the lowest cubes by rounding: it
/// would be looked up outside the counts. The layer on top leaves room for it.
inline constexpr double kVoxelLift = 1e-4;

/// Edge of the cubes.
double voxel_edge_um(const Params& params);

}  // namespace colony
