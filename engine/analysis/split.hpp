// split: touching convex objects parted where the mask between them is narrow: a watershed of the distance to the background.
// Method:  pixels are flooded from the deepest inward distance down; basins that meet are one object unless both are deeper than the saddle by more than
//          an eighth of the shallower one's depth and half a pixel at least (two equal discs of radius r part once their centres are 0.97 r apart).
//          Integer throughout, ties by reading order. Why not cv::watershed: it needs its markers from just this flooding, floods again by grey
//          differences, and leaves lines that belong to nobody, so that areas do not add up.
// Shapes:  labels has the mask's shape; 0 background, objects numbered from 1 by their first pixel in reading order.
// Memory:  about 20 bytes a foreground pixel.     Errors: CHECKs.     Threads: pure.
#pragma once

#include "engine/analysis/filters.hpp"

namespace colony {

/// `distance`: sixteenths of a pixel, 0 exactly outside the objects. Each object is 8-connected. A part below `area_min_px` stays with the neighbour
/// it is joined to most widely.
LabelImage split_touching(const Grey16Image& distance, std::int64_t area_min_px);

/// Labels numbered anew from 1 by their first pixel in reading order, leaving out those with fewer than `area_min_px` pixels; the areas that stay
/// are added to `areas_px` in that order, where it is not null.
LabelImage renumbered(const LabelImage& labels, std::int64_t area_min_px, std::vector<std::int64_t>* areas_px);

}  // namespace colony
