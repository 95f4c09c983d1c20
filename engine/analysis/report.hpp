// report: everything that is measured on one image, with its controls beside it, as plain structs for whoever encodes them.
// Method:  one pipeline for simulated and real images: the same lines (contour), the same counting (scaling), the same controls.
//          Controls are matched in number, size and, where the objects stand apart, cover and extent to the image's own objects, and counted with
//          the boxes of the line they stand beside; the same colony without noise is given by the caller, who has it.
// Meaning: `verdict` puts into words what follows from the figures and what does not.
// Units:   pixels, and um where the image has a scale (um = px x um_per_px; areas with its square).
// Errors:  what cannot be measured (a colony of three cells has no outline dimension) is a reason in its place, not a failure of the whole;
//          an image that nothing can be measured on is an Error (field `image`).
// Threads: as the parts; BoxOptions::threads. The thread count cannot matter.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/analysis/controls.hpp"
#include "engine/analysis/morphology.hpp"
#include "engine/analysis/neighbours.hpp"
#include "engine/analysis/radial.hpp"
#include "engine/analysis/scaling.hpp"
#include "engine/analysis/sides.hpp"
#include "engine/analysis/verdict.hpp"
#include "engine/random/stream.hpp"

namespace colony {

/// What the labels of an image are. Lines of nuclei or of regions are no cell walls, and are not called so.
enum class ObjectKind { kCells, kNuclei, kRegions, kObjects };
/// "cells", "nuclei", "regions", "objects".
std::string_view name_of(ObjectKind kind);
/// One of them: "cell", "nucleus", ...
std::string_view singular_of(ObjectKind kind);
/// "cell walls" and "colony outline"; "outlines of the nuclei" and "outer outline"; ...
struct LineNames {
  std::string walls, outline;
};
LineNames line_names(ObjectKind kind);

struct LineReport {
  MeasuredLine walls;                     // all borders of cells
  MeasuredLine outline;                   // of the colony alone
};

/// One control: the same measurements of another image.
enum class Placement { kSamePlaces, kTouching, kSpread };
/// "same_places", "touching", "spread".
std::string_view name_of(Placement placement);
struct ControlReport {
  std::string name;                       // without_noise, hexagonal, random_discs
  LineReport lines;
  Placement placement = Placement::kSamePlaces;
};

/// hexagonal and random_discs, in this order, for the objects of `labels`, counted with the boxes of `lines`.
struct MatchedControls {
  std::vector<ControlReport> reports;
  double cover = 0.0;                     // share of their hull that the objects take; from kTilingCover on controls touch
};
MatchedControls matched_controls(const LabelImage& labels, const LineReport& lines, Seed seed, const BoxOptions& boxes, StopFlag stop = nullptr);
/// What the controls are, and, where objects stand apart, that their walls are outlines; below kObjectsMin objects that controls show nothing.
std::vector<std::string> control_sentences(ObjectKind kind, double cover, std::uint64_t object_count);

/// Says of lines and controls around how many single things they go: too few have no finding.
void set_object_count(std::uint64_t count, LineReport& lines, std::vector<ControlReport>& controls);

/// What follows from walls and outline, each beside the controls'.
struct LineFindings {
  LineFinding walls, outline;
};
LineFindings judge_lines(const LineReport& lines, const std::vector<ControlReport>& controls, ObjectKind kind = ObjectKind::kCells);
/// Both in words, the walls first.
std::vector<std::string> sentences_of(const LineFindings& findings);

struct LabelReport {
  std::optional<double> um_per_px = {};
  ObjectKind objects = ObjectKind::kCells;
  std::uint64_t cell_count = 0;           // all there are, seen or not; of a photograph those seen
  std::uint64_t visible_count = 0;        // of labels: what all figures of the image are about
  std::uint64_t partly_hidden_count = 0;  // of them, seen by less than kSeenShareMin: in no mean of shapes
  std::uint64_t measured_count = 0;       // of them, the others of kShapePxMin pixels and more
  double cell_area_mean_px = 0.0;         // covered pixels / visible_count
  double object_cover = 0.0;              // of their hull
  double px_per_cell_diameter = 0.0;      // 2 sqrt(mean area / pi): what two images are matched by
  LineReport lines;
  std::vector<ControlReport> controls;    // in the order without_noise (if given), hexagonal, random_discs
  std::vector<Shape> shapes;              // by label
  ColonyShape colony;
  Contacts contacts;
  SideStatistics sides;                   // as seen
  ClosedSides closed_sides;               // small holes given away: what Gibson's table is about
  std::string sides_reason = {};          // why the sides are not judged by the table; empty: they are
  std::optional<SiblingStraightness> siblings = {};
  std::vector<Ring> rings;
  ApartCells apart;
  LineFindings findings;
  std::vector<std::string> verdict;       // sentences
};

/// Of its own outline: a cell of which less is seen has the shape of what lies over it.
inline constexpr double kSeenShareMin = 0.5;
/// A picture is one of a sheet where no cell is hidden and at most this share of them is so by more than half.
inline constexpr double kSheetHiddenMax = 0.05;

struct LabelInput {
  const LabelImage* labels = nullptr;
  const LabelImage* without_noise = nullptr;  // the same colony in the same frame; none for a photograph
  /// All cells there are, seen or not, by ascending label, with the pixels each would have alone; none for a photograph: it hides what it hides.
  std::optional<std::vector<LabelArea>> whole = {};
  std::optional<std::vector<std::pair<std::uint32_t, std::uint32_t>>> siblings = {};
  std::optional<std::vector<std::uint32_t>> active = {};
  ObjectKind objects = ObjectKind::kCells;
  std::int64_t gap_px = 0;                // between touching cells, left by a segmentation
  int ring_count = 10;
  Seed control_seed = 1;
  BoxOptions boxes = {};
};

/// How many cells are hidden, wholly or by more than half, and what that means for the figures; nothing where none is.
std::vector<std::string> hidden_sentences(const LabelReport& report);

Result<LabelReport> analyse_labels(const LabelInput& input, StopFlag stop = nullptr);

/// Of a label image alone: its walls and outline.
LineReport analyse_lines(const LabelImage& labels, std::int64_t gap_px, const BoxOptions& boxes, StopFlag stop = nullptr);

/// The same of a control, each line with the boxes of the one it stands beside: slopes over other ranges could not be compared. A line that
/// `like` could not count is counted by its own extent.
LineReport analyse_lines_like(const LineReport& like, const LabelImage& labels, const BoxOptions& boxes, StopFlag stop = nullptr);

/// `line` counted with boxes up to `side_max_px` only; a reason where fewer than kSidesMin sides are left.
MeasuredLine up_to(const MeasuredLine& line, std::int64_t side_max_px);

/// Counts a line, or says why it cannot be counted.
MeasuredLine measure_line(const Result<BinaryImage>& line, const BoxOptions& boxes, StopFlag stop = nullptr);

}  // namespace colony
