#include "engine/picture/top_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/picture/bands.hpp"
#include "engine/picture/column.hpp"
#include "engine/picture/pixels.hpp"

namespace colony {
namespace {

/// Share of a pixel inside a disc, to first order in the distance of its centre from the rim.
std::uint8_t disc_cover(double distance_um, double radius_um, double um_per_px) {
  const double share = (radius_um - distance_um) / um_per_px + 0.5;
  return static_cast<std::uint8_t>(std::clamp(share, 0.0, 1.0) * 255.0 + 0.5);
}

void draw_body(TopView& view, RowRange band, CellId id, const Body& body) {
  const Frame& frame = view.frame;
  const Box box = body.box();
  const Span columns = columns_of(box, frame);
  const Span rows = rows_of(box, frame, band);
  const kernel::TopBody prepared = ColumnScan(body).prepared();
  std::array<double, kernel::kTopRun> x_um{}, floor_um{}, top_um{};
  constexpr auto kRun = static_cast<std::int64_t>(kernel::kTopRun);
  for (std::int64_t first = columns.begin; first < columns.end; first += kRun) {
    const auto count = static_cast<std::size_t>(std::min(kRun, columns.end - first));
    // What a vector holds beyond the last column is a copy of it.
    for (std::size_t i = 0; i < kernel::kTopRun; ++i) x_um[i] = frame.x_um(first + static_cast<std::int64_t>(std::min(i, count - 1)));
    for (std::int64_t row = rows.begin; row < rows.end; ++row) {
      float* const height_um = view.height_um.data() + view.index(row, first);
      std::uint32_t* const owner = view.owner.data() + view.index(row, first);
      for (std::size_t i = 0; i < kernel::kTopRun; ++i) floor_um[i] = static_cast<double>(height_um[std::min(i, count - 1)]);
      kernel::column_tops(prepared, x_um.data(), frame.y_um(row), floor_um.data(), count, top_um.data());
      for (std::size_t i = 0; i < count; ++i) {
        // Ids come in ascending order and only a greater height replaces: a tie stays with the lower id.
        const auto top = static_cast<float>(top_um[i]);
        if (!(top > height_um[i])) continue;
        height_um[i] = top;
        owner[i] = id.value;
      }
    }
  }
}

void draw_nucleus(TopView& view, RowRange band, const Cell& cell) {
  const Frame& frame = view.frame;
  const double reach_um = cell.nucleus_radius_um + frame.um_per_px;
  const double x_px = (cell.nucleus_um.x() - frame.left_um) / frame.um_per_px;
  const double y_px = (frame.top_um - cell.nucleus_um.y()) / frame.um_per_px;
  const double reach_px = reach_um / frame.um_per_px;
  const Span columns = centres_within(x_px - reach_px, x_px + reach_px, 0, frame.width_px);
  const Span rows = centres_within(y_px - reach_px, y_px + reach_px, band.first, band.end);
  for (std::int64_t row = rows.begin; row < rows.end; ++row) {
    const double dy_um = frame.y_um(row) - cell.nucleus_um.y();
    for (std::int64_t column = columns.begin; column < columns.end; ++column) {
      const std::size_t at = view.index(row, column);
      if (view.owner[at] != cell.id.value) continue;
      const double dx_um = frame.x_um(column) - cell.nucleus_um.x();
      view.nucleus[at] = disc_cover(std::sqrt(dx_um * dx_um + dy_um * dy_um), cell.nucleus_radius_um, frame.um_per_px);
    }
  }
}

}  // namespace

TopView top_view(const Colony& colony, const Frame& frame, RowRange rows, const Effort& effort) {
  CHECK(rows.first >= 0 && rows.first <= rows.end && rows.end <= frame.height_px);
  CHECK(frame.width_px > 0 && frame.um_per_px > 0.0);
  TopView view;
  view.frame = frame;
  view.rows = rows;
  const std::size_t pixel_count = static_cast<std::size_t>((rows.end - rows.first) * frame.width_px);
  view.owner.assign(pixel_count, 0);
  view.height_um.assign(pixel_count, 0.0f);
  view.nucleus.assign(pixel_count, 0);
  if (pixel_count == 0) return view;

  const BandCells cells(colony, frame, rows);
  for_each_piece(cells.band_count(), effort, [&](std::size_t index) {
    const RowRange band = cells.band(index);
    for (const CellId id : cells.of_band(index)) draw_body(view, band, id, colony.body(id));
    for (const CellId id : cells.of_band(index)) draw_nucleus(view, band, colony.cell(id));
  });
  return view;
}

}  // namespace colony
