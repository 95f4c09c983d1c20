// controls: what a dimension is compared with before it means anything: images without the property in question, matched to a given one.
// Controls: the same colony without noise (smooth ellipsoids in the same places); as many smooth discs of the mean size in hexagonal
//           packing; as many discs of the same sizes at random places in a disc of the colony's area.
// Shapes:   label images in a frame of their own or, for a colony, in the given one.
// Units:    pixels, um for the colony.
// Errors:   kInvalid: no cells to match; kLimit: more than kControlCellsMax or a frame beyond the side limit.
// Random:   Purpose::kControl, one stream a disc.      Threads: pure.
#pragma once

#include <vector>

#include "engine/analysis/image.hpp"
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

/// `colony` seen from above with all noise left out: the label of a pixel is the id of the smooth ellipsoid that reaches highest over its
/// centre (ties: the lower id). The frame is that of the picture to compare with: left_um, top_um are x and y of its upper left corner.
Result<LabelImage> noise_free_control(const Colony& colony, std::int64_t width_px, std::int64_t height_px,
                                      double um_per_px, double left_um, double top_um);

}  // namespace colony
