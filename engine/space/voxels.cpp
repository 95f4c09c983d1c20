#include "engine/space/voxels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"
#include "engine/space/voxel_kernel.hpp"

namespace colony {
namespace {

constexpr double kVoxelsMax = 7e6;         // in the box of a search
constexpr double kEdgesAcrossSmallest = 8.0;

std::int32_t cube_of(double coordinate_um, double edge_um) {
  const double quotient = coordinate_um / edge_um;
  CHECK(quotient > -2e9 && quotient < 2e9);
  const auto truncated = static_cast<std::int64_t>(quotient);
  return static_cast<std::int32_t>(truncated - (static_cast<double>(truncated) > quotient ? 1 : 0));
}

// Where the raster lies, and the body relative to the centre of its first cube.
kernel::FloatBody frame_raster(const Body& body, double edge_um, VoxelRaster& out) {
  const Box& box = body.box();
  out.x0 = cube_of(box.low.x(), edge_um);
  out.y0 = cube_of(box.low.y(), edge_um);
  out.z0 = cube_of(box.low.z(), edge_um);
  out.nx = cube_of(box.high.x(), edge_um) - out.x0 + 1;
  out.ny = cube_of(box.high.y(), edge_um) - out.y0 + 1;
  out.nz = cube_of(box.high.z(), edge_um) - out.z0 + 1;
  out.words_per_row = (out.nx + 31) / 32;
  out.rows.assign(static_cast<std::size_t>(out.words_per_row) * static_cast<std::size_t>(out.ny) * static_cast<std::size_t>(out.nz) + 2, 0);
  return kernel::FloatBody(body, Vec3((out.x0 + 0.5) * edge_um, (out.y0 + 0.5) * edge_um, (out.z0 + 0.5) * edge_um));
}

constexpr std::size_t kPadding = 64;       // whole vectors are written, and one count stays 0

}  // namespace

bool VoxelRaster::holds(std::int32_t x, std::int32_t y, std::int32_t z) const {
  const std::int32_t i = x - x0, j = y - y0, k = z - z0;
  if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) return false;
  return (rows[static_cast<std::size_t>((k * ny + j) * words_per_row + i / 32)] >> (i % 32)) & 1U;
}

void make_raster(const Body& body, double edge_um, VoxelRaster& out, kernel::CountWork* work) {
  const kernel::FloatBody relative = frame_raster(body, edge_um, out);
  kernel::raster_rows(relative, static_cast<float>(edge_um), out.nx, out.ny, out.nz, out.words_per_row, out.rows.data(), work);
}

void make_raster_reference(const Body& body, double edge_um, VoxelRaster& out) {
  const kernel::FloatBody relative = frame_raster(body, edge_um, out);
  const auto edge = static_cast<float>(edge_um);
  for (std::int32_t k = 0; k < out.nz; ++k) {
    for (std::int32_t j = 0; j < out.ny; ++j) {
      for (std::int32_t i = 0; i < out.nx; ++i) {
        if (!kernel::is_inside_reference(relative, edge * static_cast<float>(i), edge * static_cast<float>(j), edge * static_cast<float>(k))) continue;
        out.rows[static_cast<std::size_t>((k * out.ny + j) * out.words_per_row + i / 32)] |= 1U << (i % 32);
      }
    }
  }
}

const VoxelRaster& RasterCache::of(CellId id, const Body& body, kernel::CountWork& work) {
  while (slots_.size() < kSlotsMax && slots_.size() < id.value) {
    std::vector<Slot> grown(std::max<std::size_t>(64, 2 * slots_.size()));
    for (Slot& slot : slots_) {
      if (slot.id.value != 0) std::swap(grown[slot.id.value % grown.size()], slot);
    }
    slots_ = std::move(grown);
  }
  Slot& slot = slots_[id.value % slots_.size()];
  const bool known = slot.id == id && slot.centre == body.centre_um() && slot.to_unit == body.to_unit() && slot.noise_offset == body.noise_offset();
  if (!known) {
    slot.id = id;
    slot.centre = body.centre_um();
    slot.to_unit = body.to_unit();
    slot.noise_offset = body.noise_offset();
    const auto bytes_of = [](const VoxelRaster& raster) { return raster.rows.capacity() * sizeof(std::uint32_t); };
    bytes_ -= bytes_of(slot.raster);
    make_raster(body, edge_um_, slot.raster, &work);
    bytes_ += bytes_of(slot.raster);
    if (bytes_ > kBytesMax) {
      for (Slot& other : slots_) {
        if (&other != &slot) other = Slot{};
      }
      bytes_ = bytes_of(slot.raster);
    }
  }
  return slot.raster;
}

double voxel_edge_um(const Params& params) {
  const double smallest_um3 = params.cell.pair_volume_um3.low * params.cell.smaller_share.low;
  const double wanted = maths::cbrt(smallest_um3) / kEdgesAcrossSmallest;
  const double width = 2.0 * search_reach_um(params);
  return std::max(wanted, maths::cbrt(width * width * body_top_max_um(params) / kVoxelsMax));
}

VoxelCounts::VoxelCounts(const Params& params) : edge_um_(voxel_edge_um(params)) {
  n_ = static_cast<std::int32_t>(2.0 * search_reach_um(params) / edge_um_) + 4;
  nz_ = static_cast<std::int32_t>(body_top_max_um(params) / edge_um_) + 2;
  CHECK(static_cast<double>(n_) * n_ * nz_ + kPadding < 8388608.0);  // an index is a float's mantissa in the kernel
  counts_.resize(static_cast<std::size_t>(n_) * static_cast<std::size_t>(n_) * static_cast<std::size_t>(nz_) + kPadding);
}

void VoxelCounts::centre_on(const Vec3& pivot_um) {
  x0_ = cube_of(pivot_um.x(), edge_um_) - n_ / 2;
  y0_ = cube_of(pivot_um.y(), edge_um_) - n_ / 2;
  std::memset(counts_.data(), 0, counts_.size());
}

void VoxelCounts::add(const VoxelRaster& raster) {
  const std::int32_t first_y = raster.y0 - y0_;
  CHECK(raster.z0 >= 0 && raster.z0 + raster.nz < nz_);
  const kernel::RowRange rows{raster.rows.data(), raster.words_per_row, raster.ny, raster.nz, std::max(0, -first_y), std::min(raster.ny, n_ - first_y),
                              first_y};
  if (rows.first_y >= rows.end_y) return;
  kernel::add_rows(rows, raster.x0 - x0_, n_, counts_.data() + raster.z0 * n_ * n_);
}

}  // namespace colony
