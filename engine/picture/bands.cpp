#include "engine/picture/bands.hpp"

#include "engine/base/check.hpp"

namespace colony {

BandCells::BandCells(const Colony& colony, const Frame& frame, RowRange rows)
    : rows_(rows), first_band_(rows.first / kBandRows_px) {
  CHECK(rows.first >= 0 && rows.first <= rows.end && rows.end <= frame.height_px);
  if (rows.first == rows.end) return;
  of_band_.resize(static_cast<std::size_t>((rows.end - 1) / kBandRows_px - first_band_ + 1));
  for (const Cell& cell : colony.cells()) {
    const Span span = rows_of(colony.body(cell.id).box(), frame, rows);
    if (span.begin >= span.end) continue;
    for (std::int64_t band = span.begin / kBandRows_px; band <= (span.end - 1) / kBandRows_px; ++band) {
      of_band_[static_cast<std::size_t>(band - first_band_)].push_back(cell.id);
    }
  }
}

}  // namespace colony
