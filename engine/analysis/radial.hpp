// radial: how size, density and activity of cells change from the middle of a colony to its rim, and how cells that stand apart differ.
// Method:  rings of equal width about the centre of all labelled pixels, up to the farthest cell centre. A cell belongs to the ring of its
//          centre; the covered area of a ring is that of labelled pixels in it. Means of area and shape are over Shape::is_measured. Pixels
//          farther out than the farthest centre, the outer halves of the outermost cells, are in no ring: a ring of halves would have no density.
// Units:   pixels.
// Errors:  kInvalid: `ring_count` outside 1..200; cells that are not those of the image.
// Threads: pure.
#pragma once

#include <optional>
#include <vector>

#include "engine/analysis/morphology.hpp"
#include "engine/analysis/neighbours.hpp"

namespace colony {

struct Ring {
  double inner_px = 0.0, outer_px = 0.0;
  std::uint64_t cell_count = 0;
  std::uint64_t covered_px = 0;
  double area_mean_px = 0.0;              // of a measured cell; 0 in a ring without
  double area_se_px = 0.0;                // standard error of that mean; 0 below 2 cells
  double density_per_px = 0.0;            // cells / covered area
  std::optional<double> active_share = {};  // none without cells, or where activity is not known
};

/// Throws Stopped. `active`: labels of the active (dividing) cells, ascending; none where it is not known.
Result<std::vector<Ring>> radial_profile(const LabelImage& labels, const std::vector<Shape>& shapes,
                                         const std::optional<std::vector<std::uint32_t>>& active, int ring_count, StopFlag stop = nullptr);

/// Cells without any neighbour against the others.
struct ApartCells {
  std::uint64_t apart_count = 0, other_count = 0;
  double share = 0.0;                     // of all cells
  double apart_area_cv = 0.0;             // coefficient of variation of the area: they "differ in size"
  double apart_circularity_sd = 0.0;      // and "in shape"
  double other_area_cv = 0.0;
  double other_circularity_sd = 0.0;
};

/// Both by ascending label, of the same image.
ApartCells apart_cells(const std::vector<Shape>& shapes, const Contacts& contacts);

}  // namespace colony
