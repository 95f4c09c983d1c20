// controls: what a dimension is compared with before it means anything: images without the property in question, matched to a given one.
// Controls: the same colony without noise (smooth ellipsoids in the same places); as many smooth discs of the mean size on a hexagonal
//           lattice; as many discs of the same sizes at random places.
// Places:   of objects that tile their hull (a colony): touching discs, and a disc of the colony's area. Of objects that stand apart (nuclei
//           in a field, colonies in a dish): the hull of the objects, in the picture's own frame, so that cover and extent are matched
//           too: packed together they would fill an area that the picture's objects do not.
// Shapes:   label images in a frame of their own, or in the given one: without noise, and spread over a hull.
// Units:    pixels, um for the colony.
// Errors:   kInvalid: no cells to match, a hull without pixels; kLimit: more than kControlCellsMax or a frame beyond the side limit.
// Random:   Purpose::kControl, one stream a disc.      Threads: pure.
#pragma once

#include <vector>

#include "engine/analysis/image.hpp"
#include "engine/base/stop.hpp"
#include "engine/model/colony.hpp"

namespace colony {

inline constexpr std::size_t kControlCellsMax = 200'000;

/// Pixels of each label, by ascending label; labels without pixels have none. The input of the matched controls.
struct LabelArea {
  std::uint32_t label = 0;
  std::uint64_t area_px = 0;
  friend bool operator==(const LabelArea&, const LabelArea&) = default;
};
std::vector<LabelArea> label_areas(const LabelImage& labels);

/// As many touching discs as there are areas, each of their mean area, at the points of a hexagonal lattice nearest to its middle
/// (ties: upper left first), labels 1..n in that order. A margin of one radius.
Result<LabelImage> hexagonal_control(const std::vector<LabelArea>& areas, std::optional<double> um_per_px = {});

/// One disc for each area, its centre uniform over the disc whose area is the sum of the areas. Where discs overlap the pixel
/// belongs to the one with the least d^2 - r^2: they meet in straight borders. Labels as in `areas`.
Result<LabelImage> random_disc_control(const std::vector<LabelArea>& areas, Seed seed,
                                       std::optional<double> um_per_px = {});

/// A disc in pixels: x to the right, y down from the frame's corner.
struct LabelDisc {
  std::uint32_t label = 0;
  double x = 0.0, y = 0.0, radius = 0.0;
};
/// Draws discs into `image`; a pixel is its centre, and belongs to the disc with the least d^2 - r^2 of those drawn here. The frame may cut them.
void draw_discs(const std::vector<LabelDisc>& discs, LabelImage& image);

/// The convex hull of all pixels with a label, within the frame: of each row the columns [first, end) whose centres lie in it. What is
/// called the field of a picture's objects: a frame or a dish is this where objects fill it, and a lone colony in a wide frame is not spread thin.
struct Hull {
  struct Span {
    std::int64_t first = 0, end = 0;
  };
  std::int64_t width_px = 0, height_px = 0;  // of the frame
  std::vector<Span> rows;                    // one a row of the frame
  std::int64_t area_px = 0;
};
Hull hull_of(const LabelImage& labels);

/// Objects that cover this share of their hull tile it: their controls touch. Colonies of `paper` cover 0.81 to 0.85 at 180 cells, touching discs up to
/// 0.91; nuclei of a culture 0.15, colonies in a dish 0.01.
inline constexpr double kTilingCover = 0.7;

/// As many discs as there are areas, each of their mean area, on the hexagonal lattice about the hull's centre that has just so many points in the
/// hull (the outermost of the last ring are left out), in the hull's frame, which may cut discs as it cuts objects. Labels 1..n from the centre outwards.
Result<LabelImage> hexagonal_control(const std::vector<LabelArea>& areas, const Hull& hull, std::optional<double> um_per_px = {});

/// One disc for each area, its centre uniform over the hull, in the hull's frame; overlaps as in the other form.
Result<LabelImage> random_disc_control(const std::vector<LabelArea>& areas, const Hull& hull, Seed seed,
                                       std::optional<double> um_per_px = {});

/// `colony` seen from above with all noise left out: the label of a pixel is the id of the smooth ellipsoid that reaches highest over its
/// centre (ties: the lower id). The frame is that of the picture to compare with: left_um, top_um are x and y of its upper left corner. Throws Stopped.
Result<LabelImage> noise_free_control(const Colony& colony, std::int64_t width_px, std::int64_t height_px,
                                      double um_per_px, double left_um, double top_um, StopFlag stop = nullptr);

}  // namespace colony
