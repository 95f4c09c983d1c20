// sides: the neighbours of interior cells held against Gibson's table, as the picture shows them and with small holes given away.
// Why both: seen from above, three cells that meet leave a hole of a few pixels where none of them reaches the surface. It parts no two cells
//          of a tissue, but takes from each border its end and from a short border all: a colony of 180 cells has 4.8 sides as it is seen, and
//          5.9 once its 200 holes are given to the cells about them. Gibson's table knows no holes.
// Method:  a hole is background that is shut in and 4-connected. One of at most half a mean cell goes, pixel by pixel, to the label that reaches it
//          in the fewest 4-steps (ties: the label whose border pixel comes first in reading order). Larger ones are open space and stay.
// Not:     a hole at a corner of four cells may join two that do not touch: the third decimal of a share means nothing.
// Errors:  as find_contacts.     Threads: pure. Throws Stopped.
#pragma once

#include <string>
#include <vector>

#include "engine/analysis/neighbours.hpp"
#include "engine/base/stop.hpp"

namespace colony {

struct GivenHoles {
  LabelImage labels;
  std::uint64_t hole_max_px = 0;          // larger ones stayed
  std::uint64_t hole_count = 0, hole_px = 0;  // of those given away
};

/// `labels` with each shut-in hole of at most hole_max_px pixels given to the cells about it. `gap_px` as in outside_of.
Result<GivenHoles> give_holes(const LabelImage& labels, std::uint64_t hole_max_px, std::int64_t gap_px = 0, StopFlag stop = nullptr);

/// The sides with holes of at most half a mean cell given away.
struct ClosedSides {
  std::uint64_t hole_max_px = 0, hole_count = 0, hole_px = 0;
  SideStatistics sides;
};

/// `cell_area_mean_px`: of the labels of the image, at least 1.
Result<ClosedSides> closed_sides(const LabelImage& labels, double cell_area_mean_px, std::int64_t gap_px = 0, StopFlag stop = nullptr);

/// What follows for Gibson's table, in words; nothing where no cell lies inside.
std::vector<std::string> judge_sides(const SideStatistics& seen, const ClosedSides& closed);

}  // namespace colony
