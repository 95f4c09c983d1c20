// The grid of mesh_grid.hpp and its tiles.
#include <algorithm>
#include <compare>

#include "engine/base/check.hpp"
#include "engine/picture/mesh_grid.hpp"
#include "engine/picture/pixels.hpp"

namespace colony {
namespace {

constexpr std::int64_t kNodesMax = std::int64_t{1} << 24;  // along x and y; keys hold no more
constexpr std::int64_t kLevelsMax = std::int64_t{1} << 10;

Box box_of(const Colony& colony) {
  CHECK(!colony.cells().empty());
  Box all = colony.body(colony.cells().front().id).box();
  for (const Cell& cell : colony.cells()) {
    const Box box = colony.body(cell.id).box();
    all.low = all.low.cwiseMin(box.low);
    all.high = all.high.cwiseMax(box.high);
  }
  return all;
}

}  // namespace

double pitch_min_um(const Colony& colony) {
  const Box all = box_of(colony);
  constexpr std::int64_t kSpare = 3 * kTileCubes;
  return std::max({(all.high.x() - all.low.x()) / static_cast<double>(kNodesMax - kSpare),
                   (all.high.y() - all.low.y()) / static_cast<double>(kNodesMax - kSpare),
                   all.high.z() / kPitchShareZ / static_cast<double>(kLevelsMax - kSpare)});
}

MeshGrid grid_of(const Colony& colony, double pitch_um) {
  const Box all = box_of(colony);
  CHECK(pitch_um > 0.0 && pitch_um >= pitch_min_um(colony));
  MeshGrid grid;
  grid.pitch_um = pitch_um;
  grid.first_x = floor_to_int(all.low.x() / pitch_um) - 1;
  grid.first_y = floor_to_int(all.low.y() / pitch_um) - 1;
  grid.levels = ceil_to_int(all.high.z() / grid.pitch_z_um()) + 3;
  return grid;
}

std::vector<TileCells> tiles_of(const Colony& colony, const MeshGrid& grid) {
  struct Entry {
    std::int64_t y, x;
    CellId id;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<Entry> entries;
  const double tile_um = grid.pitch_um * static_cast<double>(kTileCubes);
  const Vec3 origin = grid.position_um(0, 0, 0);
  for (const Cell& cell : colony.cells()) {
    const Box box = colony.body(cell.id).box();
    if (box.empty()) continue;
    // One pitch more on each side: a vertex may be asked for beside a body.
    const auto tile = [&](double at_um) { return std::max<std::int64_t>(0, floor_to_int(at_um / tile_um)); };
    const std::int64_t x_end = tile(box.high.x() + grid.pitch_um - origin.x()) + 1;
    const std::int64_t y_end = tile(box.high.y() + grid.pitch_um - origin.y()) + 1;
    for (std::int64_t y = tile(box.low.y() - grid.pitch_um - origin.y()); y < y_end; ++y) {
      for (std::int64_t x = tile(box.low.x() - grid.pitch_um - origin.x()); x < x_end; ++x)
        entries.push_back({y, x, cell.id});
    }
  }
  std::sort(entries.begin(), entries.end());
  std::vector<TileCells> tiles;
  for (const Entry& entry : entries) {
    if (tiles.empty() || tiles.back().x != entry.x || tiles.back().y != entry.y)
      tiles.push_back({entry.x, entry.y, {}});
    tiles.back().ids.push_back(entry.id);
  }
  return tiles;
}

}  // namespace colony
