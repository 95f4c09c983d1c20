#include "engine/picture/render.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/picture/annotate.hpp"
#include "engine/picture/colour.hpp"
#include "engine/picture/styles.hpp"
#include "engine/picture/top_view.hpp"

namespace colony {
namespace {

constexpr double kMarginShare = 0.05;
constexpr double kEmptySide_um = 100.0;
constexpr double kUmPerPxMin = 1e-3;
constexpr double kUmPerPxMax = 1e4;
constexpr std::int64_t kStripRows_px = 256;

struct Extent {
  double left_um, right_um, bottom_um, top_um;
};

/// The boxes of all bodies and the margin: the same on every side, a share of the longer extent, so that a low wide
/// colony has room for its scale bar too.
Extent extent_of(const Colony& colony) {
  if (colony.cells().empty())
    return {-kEmptySide_um / 2.0, kEmptySide_um / 2.0, -kEmptySide_um / 2.0, kEmptySide_um / 2.0};
  const Box& first = colony.body(colony.cells().front().id).box();
  Extent extent{first.low.x(), first.high.x(), first.low.y(), first.high.y()};
  for (const Cell& cell : colony.cells()) {
    const Box& box = colony.body(cell.id).box();
    extent.left_um = std::min(extent.left_um, box.low.x());
    extent.right_um = std::max(extent.right_um, box.high.x());
    extent.bottom_um = std::min(extent.bottom_um, box.low.y());
    extent.top_um = std::max(extent.top_um, box.high.y());
  }
  const double margin_um = kMarginShare * std::max(extent.right_um - extent.left_um, extent.top_um - extent.bottom_um);
  return {extent.left_um - margin_um, extent.right_um + margin_um, extent.bottom_um - margin_um,
          extent.top_um + margin_um};
}

Error refuse(ErrorCode code, const char* parameter, std::string message) {
  return Error{code, "the picture cannot be drawn", {FieldError{parameter, std::move(message)}}};
}

/// Pixels that hold `length_um`; a length that is a whole number of pixels but for rounding is not given one more.
double sides_px(double length_um, double um_per_px) { return length_um / um_per_px - 1e-9; }

Result<Frame> frame_of(const Extent& extent, const PictureSpec& spec) {
  const double width_um = extent.right_um - extent.left_um;
  const double height_um = extent.top_um - extent.bottom_um;
  const bool by_scale = spec.um_per_px != 0.0;
  if (by_scale && !(spec.um_per_px >= kUmPerPxMin && spec.um_per_px <= kUmPerPxMax)) {
    return refuse(ErrorCode::kInvalid, "um_per_px", "must be in [0.001, 10000] um per pixel");
  }
  if (!by_scale && spec.width_px < 1) return refuse(ErrorCode::kInvalid, "width_px", "must be at least 1");
  const auto side_max = static_cast<double>(kPictureSideMax_px);
  const char* parameter = by_scale ? "um_per_px" : "width_px";
  const double um_per_px = by_scale ? spec.um_per_px : width_um / static_cast<double>(spec.width_px);
  const double width = by_scale ? sides_px(width_um, um_per_px) : static_cast<double>(spec.width_px);
  const double height = sides_px(height_um, um_per_px);
  // Compared as doubles: only what is known to be small becomes an integer.
  if (!(width <= side_max && height <= side_max)) {
    return refuse(ErrorCode::kLimit, parameter,
                  "makes a side longer than " + std::to_string(kPictureSideMax_px) + " pixels");
  }
  Frame frame;
  frame.um_per_px = um_per_px;
  frame.width_px = by_scale ? std::max<std::int64_t>(1, ceil_to_int(width)) : spec.width_px;
  frame.height_px = std::max<std::int64_t>(1, ceil_to_int(height));
  // What rounding up to whole pixels adds is shared by both sides.
  frame.left_um = (extent.left_um + extent.right_um - static_cast<double>(frame.width_px) * um_per_px) / 2.0;
  frame.top_um = (extent.top_um + extent.bottom_um + static_cast<double>(frame.height_px) * um_per_px) / 2.0;
  return frame;
}

}  // namespace

// The contact rule cannot change what is seen from above (top_view.hpp), so nothing of the parameters is read.
Result<Picture> render(const Colony& colony, const Params&, const PictureSpec& spec, StopFlag stop) {
  const Result<Frame> framed = frame_of(extent_of(colony), spec);
  if (!framed) return framed.error();
  const Frame& frame = *framed;

  Picture picture;
  picture.width_px = frame.width_px;
  picture.height_px = frame.height_px;
  picture.um_per_px = frame.um_per_px;
  picture.left_um = frame.left_um;
  picture.top_um = frame.top_um;
  picture.rgb.assign(static_cast<std::size_t>(3 * frame.width_px * frame.height_px), 0);

  const bool shaded = spec.style == PictureStyle::kShaded;
  const CellColours colours = shaded ? colour_cells(colony, spec.colour_by) : CellColours{};
  for (std::int64_t row = 0; row < frame.height_px; row += kStripRows_px) {
    throw_if_stopped(stop);
    const RowRange rows{row, std::min(row + kStripRows_px, frame.height_px)};
    const RowRange read{std::max<std::int64_t>(0, rows.first - kStyleHalo_px),
                        std::min(rows.end + kStyleHalo_px, frame.height_px)};
    const TopView view = top_view(colony, frame, read);
    if (shaded) {
      paint_shaded(view, rows, colours.of_cell, picture);
    } else {
      paint_contours(view, rows, picture);
    }
  }
  if (spec.scale_bar) {
    const Ink ink = shaded ? Ink{kWhite, kDarkBackground} : Ink{kBlack, kWhite};
    draw_scale_bar(picture, ink);
    if (shaded) draw_legend(picture, colony, colours.scale, ink);
  }
  return picture;
}

}  // namespace colony
