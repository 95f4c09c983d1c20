// contour: the lines that are box counted: colony outline and cell walls; one pixel wide, as binary images (0, 255).
// Rule:    of the two pixels beside a border the one with the higher label is drawn (background is 0): each border once, so the lines
//          are 8-connected, and no 4-connected path leads from one label to another, or out of one, except over a drawn pixel.
// Frame:   what lies beyond the frame is unknown, so its edge is never a border: a colony that is cut by the frame has no outline there.
// Method:  background is 4-connected and foreground 8-connected. Outside = background joined to the frame's edge (OpenCV's flood fill);
//          all other background is a hole.
// Errors:  kLimit / kInvalid as check_image, field `image`. No foreground gives an empty line, not an error: box counting says it.
// Memory:  one or two bytes a pixel.
// Threads: pure.
#pragma once

#include "engine/analysis/image.hpp"

namespace colony {

/// 255 where the pixel is background that is joined to the frame's edge, else 0. Background runs of at most `gap_px` between two different
/// labels of one row or column (lines that a segmentation leaves between touching cells) count as closed. gap_px in [0, 8].
Result<BinaryImage> outside_of(const LabelImage& labels, std::int64_t gap_px = 0);
Result<BinaryImage> outside_of(const BinaryImage& image);

/// The outer boundary of the union of all labels, holes filled.
Result<BinaryImage> colony_outline(const LabelImage& labels, std::int64_t gap_px = 0);
/// The same of a set.
Result<BinaryImage> colony_outline(const BinaryImage& image);

/// All borders between labels, and between labels and background, holes included: what a picture of cell contours shows.
Result<BinaryImage> cell_walls(const LabelImage& labels);

/// Foreground where a label is not 0.
BinaryImage foreground_of(const LabelImage& labels);

}  // namespace colony
