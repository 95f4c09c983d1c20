// report: everything that is measured on one image, with its controls beside it, as plain structs for whoever encodes them.
// Method:  one pipeline for simulated and real images: the same lines (contour), the same counting (scaling), the same controls.
//          Controls are matched in number and size to the image's own cells; the same colony without noise is given by the caller, who has it.
// Meaning: `verdict` puts into words what follows from the figures and what does not.
// Units:   pixels, and um where the image has a scale (um = px x um_per_px; areas with its square).
// Errors:  what cannot be measured (a colony of three cells has no outline dimension) is a reason in its place, not a failure of the whole;
//          an image that nothing can be measured on is an Error (field `image`).
// Threads: as the parts; BoxOptions::threads. The thread count cannot matter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/analysis/morphology.hpp"
#include "engine/analysis/neighbours.hpp"
#include "engine/analysis/radial.hpp"
#include "engine/analysis/scaling.hpp"
#include "engine/analysis/sides.hpp"
#include "engine/random/stream.hpp"

namespace colony {

/// Lines that were counted, or why not.
struct MeasuredLine {
  std::optional<BoxDimensions> dimensions = {};
  std::string reason = {};                // where there are none
};

struct LineReport {
  MeasuredLine walls;                     // all borders of cells
  MeasuredLine outline;                   // of the colony alone
};

/// One control: the same measurements of another image.
struct ControlReport {
  std::string name;                       // without_noise, hexagonal, random_discs
  LineReport lines;
};

struct LabelReport {
  std::optional<double> um_per_px = {};
  std::uint64_t cell_count = 0;
  double cell_area_mean_px = 0.0;
  double px_per_cell_diameter = 0.0;      // 2 sqrt(mean area / pi): what two images are matched by
  LineReport lines;
  std::vector<ControlReport> controls;    // in the order without_noise (if given), hexagonal, random_discs
  std::vector<Shape> shapes;              // by label
  ColonyShape colony;
  Contacts contacts;
  SideStatistics sides;                   // as seen
  ClosedSides closed_sides;               // small holes given away: what Gibson's table is about
  std::optional<SiblingStraightness> siblings = {};
  std::vector<Ring> rings;
  ApartCells apart;
  std::vector<std::string> verdict;       // sentences
};

struct LabelInput {
  const LabelImage* labels = nullptr;
  const LabelImage* without_noise = nullptr;  // the same colony in the same frame; none for a photograph
  std::optional<std::vector<std::pair<std::uint32_t, std::uint32_t>>> siblings = {};
  std::optional<std::vector<std::uint32_t>> active = {};
  std::int64_t gap_px = 0;                // between touching cells, left by a segmentation
  int ring_count = 10;
  Seed control_seed = 1;
  BoxOptions boxes = {};
};

Result<LabelReport> analyse_labels(const LabelInput& input, StopFlag stop = nullptr);

/// Of a label image alone: its walls and outline.
LineReport analyse_lines(const LabelImage& labels, std::int64_t gap_px, const BoxOptions& boxes, StopFlag stop = nullptr);

/// One threshold of a sweep.
struct ThresholdRow {
  int threshold = 0;
  double foreground_share = 0.0;
  MeasuredLine set;                       // the foreground itself
  MeasuredLine boundary;                  // its boundary
};

struct ThresholdSweep {
  std::vector<std::int64_t> sides_px;     // the same for every row, from the frame's longer side: rows are comparable
  std::vector<ThresholdRow> rows;
};

/// Foreground: grey >= threshold, or < threshold if `dark_foreground`. 1..64 rising thresholds in 1..255. Errors name `thresholds`.
/// A dimension that hangs on the threshold is a property of the threshold.
Result<ThresholdSweep> threshold_sweep(const GreyImage& image, const std::vector<int>& thresholds, bool dark_foreground,
                                       const BoxOptions& boxes, StopFlag stop = nullptr);

}  // namespace colony
