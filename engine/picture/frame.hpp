// frame: where the pixels of a raster lie in the plane of the dish.
// Units: um, pixels; y up, row 0 at the top; a pixel is its centre.
#pragma once

#include <cstdint>

namespace colony {

struct Frame {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  double um_per_px = 0.0;
  double left_um = 0.0;  // x of the left edge
  double top_um = 0.0;   // y of the top edge
  double x_um(std::int64_t column) const { return left_um + (static_cast<double>(column) + 0.5) * um_per_px; }
  double y_um(std::int64_t row) const { return top_um - (static_cast<double>(row) + 0.5) * um_per_px; }
};

/// Rows [first, end) of a frame.
struct RowRange {
  std::int64_t first = 0;
  std::int64_t end = 0;
};

}  // namespace colony
