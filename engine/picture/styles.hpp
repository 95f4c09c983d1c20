// styles: from a top view to pixels. A style reads a strip of the view and writes the rows asked for.
// Method:  shaded: diffuse light from the upper left on the height field, a dark line of kBorderHalfWidth_um along
//          every change of owner (thinning out in coarse pictures instead of drowning the cells), the nucleus through
//          the cell. contours: black where a 4-neighbour has a lower owner id (background 0), white elsewhere: so each
//          border is drawn on one side, 8-connected and one pixel wide, and no 4-connected path leads from one owner
//          to another except over it. With `colony` every cell counts as one owner; `cells` leaves out what borders on
//          the background. brightfield: transmission as a linear share of white in each colour (no gamma: a stored value
//          divided by 255 is the share). phase: grey. labels: ids as colours (render.hpp).
// Threads: pure.
#pragma once

#include "engine/picture/colour.hpp"
#include "engine/picture/paths.hpp"
#include "engine/picture/top_view.hpp"

namespace colony {

inline constexpr Rgb kDarkBackground{0x14, 0x14, 0x1c};
inline constexpr Rgb kBorderColour{0x0a, 0x0a, 0x10};
inline constexpr Rgb kNucleusColour{0x34, 0x1e, 0x64};
inline constexpr Rgb kWhite{0xff, 0xff, 0xff};
inline constexpr Rgb kBlack{0x00, 0x00, 0x00};
inline constexpr double kNucleusOpacity = 0.88;
inline constexpr double kBorderHalfWidth_um = 0.3;
inline constexpr std::int64_t kBorderHalfWidthMax_px = 3;

/// Rows beyond those written that a style reads, where the frame has them.
inline constexpr std::int64_t kStyleHalo_px = kBorderHalfWidthMax_px + 2;

void paint_shaded(const TopView& view, RowRange rows, const std::vector<Rgb>& colour_of_cell, Picture& picture);
void paint_contours(const TopView& view, RowRange rows, ContourLines lines, Picture& picture);
void paint_labels(const TopView& view, RowRange rows, Picture& picture);
void paint_brightfield(const PathView& view, RowRange rows, Picture& picture);
/// `intensity` as phase_contrast() gives it for `view`.
void paint_phase(const PathView& view, const std::vector<float>& intensity, RowRange rows, Picture& picture);

}  // namespace colony
