#include "engine/picture/paths.hpp"

#include <algorithm>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/base/float_mode.hpp"
#include "engine/picture/bands.hpp"
#include "engine/picture/path_kernel.hpp"

namespace colony {
namespace {

using kernel::kPathRun;
constexpr auto kRun = static_cast<std::int64_t>(kPathRun);
constexpr double kLevelsMax = 4096.0;  // of a column, whatever the cells

/// Distance of the levels: one for the whole colony, so that cells are cut at the same heights.
double level_um(const Colony& colony) {
  double semiaxis_um = 0.0, top_um = 0.0;
  for (const Cell& cell : colony.cells()) {
    semiaxis_um = semiaxis_um == 0.0 ? cell.semiaxes_um.z() : std::min(semiaxis_um, cell.semiaxes_um.z());
    top_um = std::max(top_um, colony.body(cell.id).box().high.z());
  }
  return std::max(semiaxis_um / kPathLevelsPerSemiaxis, top_um / kLevelsMax);
}

/// The nucleus is given relative to the same origin as the body.
kernel::PathBody path_body(const Cell& cell, const Body& body, const Vec3& origin_um) {
  kernel::PathBody prepared;
  prepared.field = kernel::FloatBody(body, origin_um);
  prepared.nucleus_x = static_cast<float>(cell.nucleus_um.x() - origin_um.x());
  prepared.nucleus_y = static_cast<float>(cell.nucleus_um.y() - origin_um.y());
  prepared.nucleus_z = static_cast<float>(cell.nucleus_um.z());
  prepared.nucleus_radius = static_cast<float>(cell.nucleus_radius_um);
  prepared.nucleus_half_height = static_cast<float>(nucleus_half_height_um(cell));
  return prepared;
}

/// What one call of the kernel gave: columns [column, column + count) of a row, ids[i]'s lengths at [i * kPathRun].
struct Lengths {
  std::int64_t row, column;
  std::size_t count;
  std::span<const CellId> ids;
  const float* cell;
  const float* nucleus;
};

/// take(lengths) for every run of pixels of a band that a cell may meet. Tiles lie at multiples of kRun and kBandRows_px
/// of the frame: a tile's origin, and so each rounding, is that of the pixel, not of the rows asked for.
template <class Take>
void scan_band(const Colony& colony, bool largest_only, const Frame& frame, double dz_um, RowRange band,
               std::span<const CellId> ids, const Take& take) {
  check_floating_point_mode();
  const std::int64_t tile_count = (frame.width_px + kRun - 1) / kRun;
  std::vector<std::vector<CellId>> of_tile(static_cast<std::size_t>(tile_count));
  for (const CellId id : ids) {
    const Span columns = columns_of(colony.body(id).box(), frame);
    if (columns.begin >= columns.end) continue;
    for (std::int64_t tile = columns.begin / kRun; tile <= (columns.end - 1) / kRun; ++tile) {
      of_tile[static_cast<std::size_t>(tile)].push_back(id);
    }
  }
  const std::int64_t anchor_row = band.first / kBandRows_px * kBandRows_px;
  float x[kPathRun];
  for (std::size_t i = 0; i < kPathRun; ++i) x[i] = static_cast<float>(static_cast<double>(i) * frame.um_per_px);
  kernel::PathBuffer buffer;
  std::vector<kernel::PathBody> bodies;
  std::vector<float> cell, nucleus;
  for (std::int64_t tile = 0; tile < tile_count; ++tile) {
    const std::vector<CellId>& here = of_tile[static_cast<std::size_t>(tile)];
    if (here.empty()) continue;
    const std::int64_t column = tile * kRun;
    const Vec3 origin_um(frame.x_um(column), frame.y_um(anchor_row), 0.0);
    bodies.clear();
    for (const CellId id : here) bodies.push_back(path_body(colony.cell(id), colony.body(id), origin_um));
    cell.resize(here.size() * kPathRun);
    nucleus.resize(here.size() * kPathRun);
    const auto count = static_cast<std::size_t>(std::min(kRun, frame.width_px - column));
    for (std::int64_t row = band.first; row < band.end; ++row) {
      const auto y = static_cast<float>(-static_cast<double>(row - anchor_row) * frame.um_per_px);
      kernel::column_paths(bodies, largest_only, x, y, count, static_cast<float>(dz_um), buffer, cell.data(),
                           nucleus.data());
      take(Lengths{row, column, count, here, cell.data(), nucleus.data()});
    }
  }
}

}  // namespace

double nucleus_half_height_um(const Cell& cell) {
  return std::min(cell.nucleus_radius_um, kNucleusHeightShare * cell.semiaxes_um.z());
}

PathView path_lengths(const Colony& colony, ContactRule rule, const Frame& frame, RowRange rows, const Effort& effort) {
  CHECK(frame.width_px > 0 && frame.um_per_px > 0.0);
  const BandCells cells(colony, frame, rows);
  PathView view;
  view.frame = frame;
  view.rows = rows;
  const auto pixel_count = static_cast<std::size_t>((rows.end - rows.first) * frame.width_px);
  view.cell_um.assign(pixel_count, 0.0F);
  view.nucleus_um.assign(pixel_count, 0.0F);
  const double dz_um = level_um(colony);
  for_each_piece(cells.band_count(), effort, [&](std::size_t index) {
    scan_band(colony, rule == ContactRule::kMax, frame, dz_um, cells.band(index), cells.of_band(index),
              [&](const Lengths& lengths) {
                float* const cell_um = view.cell_um.data() + view.index(lengths.row, lengths.column);
                float* const nucleus_um = view.nucleus_um.data() + view.index(lengths.row, lengths.column);
                for (std::size_t i = 0; i < lengths.ids.size(); ++i) {
                  for (std::size_t c = 0; c < lengths.count; ++c) cell_um[c] += lengths.cell[i * kPathRun + c];
                  for (std::size_t c = 0; c < lengths.count; ++c) nucleus_um[c] += lengths.nucleus[i * kPathRun + c];
                }
              });
  });
  return view;
}

std::vector<double> path_volumes_um3(const Colony& colony, ContactRule rule, const Frame& frame, const Effort& effort) {
  CHECK(frame.width_px > 0 && frame.um_per_px > 0.0);
  const BandCells cells(colony, frame, {0, frame.height_px});
  const double dz_um = level_um(colony);
  // Bands sum for themselves; their sums are added in the order of the bands.
  std::vector<std::vector<std::pair<CellId, double>>> of_band(cells.band_count());
  for_each_piece(cells.band_count(), effort, [&](std::size_t index) {
    scan_band(colony, rule == ContactRule::kMax, frame, dz_um, cells.band(index), cells.of_band(index),
              [&](const Lengths& lengths) {
                for (std::size_t i = 0; i < lengths.ids.size(); ++i) {
                  double sum_um = 0.0;
                  for (std::size_t c = 0; c < lengths.count; ++c)
                    sum_um += static_cast<double>(lengths.cell[i * kPathRun + c]);
                  if (sum_um > 0.0) of_band[index].emplace_back(lengths.ids[i], sum_um);
                }
              });
  });
  std::vector<double> volumes_um3(colony.cells().size(), 0.0);
  const double area_um2 = frame.um_per_px * frame.um_per_px;
  for (const auto& sums : of_band) {
    for (const auto& [id, sum_um] : sums) volumes_um3[id.value - 1] += sum_um * area_um2;
  }
  return volumes_um3;
}

}  // namespace colony
