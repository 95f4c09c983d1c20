// compare: a colony at a time against a picture: the same lines, the same boxes, the same pixels per object.
// Method:  the colony is drawn at the scale that the match asks for; then both are label images, and both are counted as any image. What is judged is
//          the range of boxes that both have (geometric series of one beginning and ratio, so the counts are there already): a slope over another
//          range is another number even of the same set.
// Match:   object_area: the mean visible area of a cell is that of the picture's objects, or what the caller says a cell has; nuclei are matched with
//          nuclei, and the colony's nuclei are then what is counted. um_per_px: the picture's own scale.
// Errors:  kInvalid / kLimit naming a field of the body: a picture without objects or, where it is asked for, without a scale, a colony without
//          cells, a scale beyond the picture limits.
// Threads: pure. Throws Stopped.
#pragma once

#include "engine/analysis/canvas.hpp"
#include "server/api/analyse.hpp"
#include "server/api/measure.hpp"

namespace colony::server::api {

enum class MatchBy { kObjectArea, kUmPerPx };
std::string_view name_of(MatchBy by);

/// What a caller knows of the picture. At most one of the two numbers, and only with kObjectArea.
struct MatchRequest {
  MatchBy by = MatchBy::kObjectArea;
  std::optional<std::int64_t> cell_count = {};   // cells (or nuclei) that the objects are in truth
  std::optional<double> cell_area_px = {};       // mean area of a cell
};

/// Of the picture.
struct ObjectFacts {
  ObjectKind kind = ObjectKind::kObjects;
  std::uint64_t count = 0;
  double area_mean_px = 0.0;
  std::optional<double> um_per_px = {};
};

/// What is matched with what.
struct Match {
  MatchRequest request;
  ObjectFacts real;
  ObjectKind simulated = ObjectKind::kCells;     // what is drawn and counted of the colony: cells or nuclei
  ObjectKind matched = ObjectKind::kCells;       // whose area is made `area_px`; not with kUmPerPx
  double area_px = 0.0;
};
Result<Match> match_of(const MatchRequest& request, const ObjectFacts& real);

/// The lines of one side over the boxes that both sides have, judged beside its controls over the same.
struct ComparedSide {
  LineReport lines;
  std::vector<ControlReport> controls;
  LineFindings findings;
};

struct Comparison {
  ColonyAt at;
  Match match;
  LabelledColony image;      // of the colony, at the matched scale
  double um_per_px = 0.0;
  LabelReport simulated;     // over its own range
  PictureMeasurement real;   // likewise
  ComparedSide simulated_side, real_side;
};

Result<Comparison> compare(ColonyAt at, std::string_view picture, const ImageOptions& options, const MatchRequest& match, const Effort& effort,
                           Sweep sweep = Sweep::kMake);
Json encode_comparison(const Comparison& comparison);

/// Both over the boxes that both have, line by line; a side without figures keeps its reason.
void judge_common_range(const LineReport& simulated, const std::vector<ControlReport>& simulated_controls, ObjectKind simulated_kind,
                        const LineReport& real, const std::vector<ControlReport>& real_controls, ObjectKind real_kind, ComparedSide& simulated_side,
                        ComparedSide& real_side);

/// How many pixels the colony will take at the matched scale, from its cells' smooth ellipses without their overlaps and without drawing
/// anything: too low where cells hide each other, by a third in a confluent layer.
std::int64_t compared_px_estimate(const Colony& colony, const Match& match);

/// The scale that the match asks for, um per pixel.
Result<double> matched_scale(const Colony& colony, const Match& match, const Effort& effort);

/// PNG: both contours above in one scale, below log-log plots with fitted lines, and the slopes from small to large boxes.
/// Throws Stopped when asked to, between rows of the file.
std::string comparison_figure(const Comparison& comparison, StopFlag stop = nullptr);
/// The same before it is a file.
Canvas comparison_canvas(const Comparison& comparison);

}  // namespace colony::server::api
