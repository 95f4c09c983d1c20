// top_view: what is seen of a colony from straight above, before any styling: height and owner of every pixel.
// Method:  the visible height of a column (x, y) is the largest z >= 0 where some deformed cell f~_i >= 0. There every
//          other f_j <= 0 (a positive f_j would reach higher), so f~_i = f_i: the visible surface is that of the union
//          of the bodies, whatever the contact rule, and the owner is the body that reaches highest in the column. So
//          each body is scanned alone, from above (column.hpp), and a height buffer keeps the highest. Where two
//          neighbours reach equally high is their border, the upper rim of the face f_i = f_j.
// Units:   um, pixels; y up, row 0 at the top; a pixel is its centre.
// Errors:  CHECKs the rows; throws Stopped.
// Threads: pure. Bands of rows are worked on side by side, each by one thread with its cells in ascending order; equal
//          heights go to the lower id.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/model/colony.hpp"
#include "engine/picture/frame.hpp"
#include "engine/picture/parallel.hpp"

namespace colony {

/// One entry a pixel, row-major from row `rows.first`. A picture is made of strips of rows, so that the memory is that
/// of a strip.
struct TopView {
  Frame frame;
  RowRange rows;
  std::vector<std::uint32_t> owner;  // CellId of the visible cell; 0: none
  std::vector<float> height_um;      // of the visible point; 0 where there is no cell
  std::vector<std::uint8_t>
      nucleus;  // share of the pixel that the owner's nucleus covers, 0..255; nuclei under others do not show

  bool has_row(std::int64_t row) const { return row >= rows.first && row < rows.end; }
  std::size_t index(std::int64_t row, std::int64_t column) const {
    return static_cast<std::size_t>((row - rows.first) * frame.width_px + column);
  }
};

/// The rows `rows` of the view; the same pixels whatever the rows asked for around them.
TopView top_view(const Colony& colony, const Frame& frame, RowRange rows, const Effort& effort = {});
inline TopView top_view(const Colony& colony, const Frame& frame) {
  return top_view(colony, frame, {0, frame.height_px});
}

}  // namespace colony
