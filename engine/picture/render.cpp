#include "engine/picture/render.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/picture/annotate.hpp"
#include "engine/picture/bands.hpp"
#include "engine/picture/colour.hpp"
#include "engine/picture/optics.hpp"
#include "engine/picture/styles.hpp"
#include "engine/picture/top_view.hpp"

namespace colony {
namespace {

// The golden ratio's share of kLabelColours, without a factor in common, and its inverse.
constexpr std::uint64_t kLabelFactor = 9'072'779;
constexpr std::uint64_t kLabelInverse = 13'006'627;
static_assert(kLabelFactor * kLabelInverse % kLabelColours == 1);
constexpr std::uint32_t kLowBits = 7;  // of each of three channels
constexpr double kMarginShare = 0.05;
constexpr double kEmptySide_um = 100.0;
constexpr double kUmPerPxMin = 1e-3;
constexpr double kUmPerPxMax = 1e4;
constexpr std::int64_t kStripRowsMax_px = 256;
constexpr std::int64_t kStripPixels = 4'000'000;

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

}  // namespace

Result<Frame> frame_of(const Colony& colony, const PictureSpec& spec) {
  const Extent extent = extent_of(colony);
  const double width_um = extent.right_um - extent.left_um;
  const double height_um = extent.top_um - extent.bottom_um;
  const bool by_scale = spec.um_per_px != 0.0;
  if (by_scale && !(spec.um_per_px >= kUmPerPxMin && spec.um_per_px <= kUmPerPxMax)) {
    return refuse(ErrorCode::kInvalid, "um_per_px", "must be in [0.001, 10000] um per pixel");
  }
  if (!by_scale && spec.width_px < 1) return refuse(ErrorCode::kInvalid, "width_px", "must be at least 1");
  if (spec.side_max_px < 1 || spec.side_max_px > kRasterSideMax_px) {
    return refuse(ErrorCode::kInvalid, "side_max_px", "must be in [1, " + std::to_string(kRasterSideMax_px) + "]");
  }
  const auto side_max = static_cast<double>(spec.side_max_px);
  const char* parameter = by_scale ? "um_per_px" : "width_px";
  const double um_per_px = by_scale ? spec.um_per_px : width_um / static_cast<double>(spec.width_px);
  const double width = by_scale ? sides_px(width_um, um_per_px) : static_cast<double>(spec.width_px);
  const double height = sides_px(height_um, um_per_px);
  // Compared as doubles: only what is known to be small becomes an integer.
  if (!(width <= side_max && height <= side_max)) {
    return refuse(ErrorCode::kLimit, parameter,
                  "makes a side longer than " + std::to_string(spec.side_max_px) + " pixels");
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

namespace {

bool is_of_paths(PictureStyle style) { return style == PictureStyle::kBrightfield || style == PictureStyle::kPhase; }

Ink ink_of(PictureStyle style) {
  return style == PictureStyle::kShaded ? Ink{kWhite, kDarkBackground} : Ink{kBlack, kWhite};
}

Picture empty_strip(const Frame& frame, RowRange rows) {
  Picture picture;
  picture.width_px = frame.width_px;
  picture.height_px = frame.height_px;
  picture.um_per_px = frame.um_per_px;
  picture.left_um = frame.left_um;
  picture.top_um = frame.top_um;
  picture.first_row = rows.first;
  picture.rgb.assign(static_cast<std::size_t>(3 * frame.width_px * (rows.end - rows.first)), 0);
  return picture;
}

/// paint(band) for the bands of `rows`, side by side.
template <class Paint>
void paint_bands(RowRange rows, const Effort& effort, const Paint& paint) {
  const auto count = static_cast<std::size_t>((rows.end - rows.first + kBandRows_px - 1) / kBandRows_px);
  for_each_piece(count, effort, [&](std::size_t index) {
    const std::int64_t first = rows.first + static_cast<std::int64_t>(index) * kBandRows_px;
    paint(RowRange{first, std::min(first + kBandRows_px, rows.end)});
  });
}

void paint_paths(const Colony& colony, ContactRule rule, PictureStyle style, const Frame& frame, RowRange rows,
                 const Effort& effort, Picture& strip) {
  const PathView view = path_lengths(colony, rule, frame, rows, effort);
  if (style == PictureStyle::kBrightfield) {
    paint_bands(rows, effort, [&](RowRange band) { paint_brightfield(view, band, strip); });
    return;
  }
  const std::vector<float> intensity = phase_contrast(colony, rule, view, effort);
  paint_bands(rows, effort, [&](RowRange band) { paint_phase(view, intensity, band, strip); });
}

// The contact rule cannot change what is seen from above (top_view.hpp).
void paint_surface(const Colony& colony, const PictureSpec& spec, const CellColours& colours, const Frame& frame,
                   RowRange rows, const Effort& effort, Picture& strip) {
  const RowRange read{std::max<std::int64_t>(0, rows.first - kStyleHalo_px),
                      std::min(rows.end + kStyleHalo_px, frame.height_px)};
  const TopView view = top_view(colony, frame, read, effort);
  switch (spec.style) {
    case PictureStyle::kShaded:
      return paint_shaded(view, rows, colours.of_cell, strip);
    case PictureStyle::kContours:
      return paint_contours(view, rows, spec.contour_lines, strip);
    default:
      return paint_labels(view, rows, strip);
  }
}

}  // namespace

Status render_strips(const Colony& colony, const Params& params, const PictureSpec& spec, const Effort& effort,
                     const std::function<void(const Picture&)>& take) {
  const Result<Frame> framed = frame_of(colony, spec);
  if (!framed) return framed.error();
  const Frame& frame = *framed;
  if (spec.style == PictureStyle::kLabels && colony.cells().size() >= kLabelColours) {
    return refuse(ErrorCode::kLimit, "style",
                  "labels as colours end at " + std::to_string(kLabelColours - 1) + " cells");
  }
  const bool shaded = spec.style == PictureStyle::kShaded;
  const CellColours colours = shaded ? colour_cells(colony, spec.colour_by) : CellColours{};
  // Whole bands, so that threads do not share one.
  const std::int64_t strip_rows =
      std::clamp(kStripPixels / frame.width_px / kBandRows_px * kBandRows_px, kBandRows_px, kStripRowsMax_px);
  for (std::int64_t row = 0; row < frame.height_px; row += strip_rows) {
    throw_if_stopped(effort.stop);
    const RowRange rows{row, std::min(row + strip_rows, frame.height_px)};
    Picture strip = empty_strip(frame, rows);
    if (is_of_paths(spec.style)) {
      paint_paths(colony, params.contact.rule, spec.style, frame, rows, effort, strip);
    } else {
      paint_surface(colony, spec, colours, frame, rows, effort, strip);
    }
    if (spec.scale_bar && spec.style != PictureStyle::kLabels) {
      draw_scale_bar(strip, ink_of(spec.style));
      if (shaded) draw_legend(strip, colony, colours.scale, ink_of(spec.style));
    }
    take(strip);
  }
  return Ok{};
}

Result<Picture> render(const Colony& colony, const Params& params, const PictureSpec& spec, const Effort& effort) {
  const Result<Frame> framed = frame_of(colony, spec);
  if (!framed) return framed.error();
  Picture picture = empty_strip(*framed, {0, 0});
  picture.rgb.reserve(static_cast<std::size_t>(3 * framed->width_px * framed->height_px));
  const Status status = render_strips(colony, params, spec, effort, [&](const Picture& strip) {
    picture.rgb.insert(picture.rgb.end(), strip.rgb.begin(), strip.rgb.end());
  });
  if (!status) return status.error();
  return picture;
}

Result<Picture> render(const Colony& colony, const Params& params, const PictureSpec& spec, StopFlag stop) {
  return render(colony, params, spec, Effort{1, stop});
}

// A bright colour's number: its three highest bits, 1..7 (less 1), then the low bits of red, green and blue.
std::uint32_t label_colour(CellId id) {
  if (id.value == 0) return 0;
  const auto number = static_cast<std::uint32_t>(id.value * kLabelFactor % kLabelColours);
  const std::uint32_t high = (number >> 3 * kLowBits) + 1;
  std::uint32_t rgb = 0;
  for (std::uint32_t channel = 0; channel < 3; ++channel) {
    rgb |= ((high >> channel & 1U) << kLowBits | (number >> channel * kLowBits & 127U)) << 8 * channel;
  }
  return rgb;
}

CellId label_of_colour(std::uint32_t rgb) {
  std::uint32_t high = 0, low = 0;
  for (std::uint32_t channel = 0; channel < 3; ++channel) {
    const std::uint32_t value = rgb >> 8 * channel & 255U;
    high |= value >> kLowBits << channel;
    low |= (value & 127U) << channel * kLowBits;
  }
  if (high == 0) return CellId{0};
  const std::uint64_t number = std::uint64_t{high - 1} << 3 * kLowBits | low;
  return CellId{static_cast<std::uint32_t>(number * kLabelInverse % kLabelColours)};
}

}  // namespace colony
