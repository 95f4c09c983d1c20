// segment: a grey picture of cells to numbered objects, every step kept as an image with its name, so that a person sees what was counted.
// Choice:  who asks for nothing gets what the histogram says, and reads in `pipeline_reason` what it said and what else there is: an
//          actin picture is a light thing on an empty ground too, but its objects are no nuclei, which no histogram knows.
// Method:  nuclei: background by morphological opening, square root, Otsu, holes, parting by distance, small pieces away.
//          phase: local standard deviation, Otsu on its logarithm, the window's reach taken back, small holes and pieces away.
//          Both: a dish's wall (a thin piece around most of the picture) and what lies outside of it is left out.
//          CLAHE before either on request: it also lifts the noise of empty parts, so it is not the default.
//          contours: the ink itself; nothing is smoothed, filled or left out.
// Units:   pixels; levels are grey levels 0..255 of the step `signal`.
// Promise: the same labels on any number of threads and any x86-64 CPU for one build of OpenCV (see opencv.hpp, filters.hpp for what is integer).
// Errors:  kInvalid: nothing in the foreground, all of it, or one grey level only; limits of SegmentOptions.     Threads: pure, any thread.
// Limits of validity: nuclei parts convex objects by their outline only, so nuclei on top of each other count once. phase finds regions of cells, not cells.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/analysis/hump.hpp"
#include "engine/analysis/image.hpp"
#include "engine/base/stop.hpp"

namespace colony {

enum class Foreground { kAuto, kLight, kDark };
enum class Pipeline { kAuto, kNuclei, kPhase, kContours };

/// One step as an image; grey (1 channel) or colour (3).
struct StepImage {
  std::string name;
  std::string text;  // what it shows, in a sentence
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::int64_t channel_count = 1;
  std::vector<std::uint8_t> values;
};

/// What one level of the sweep gives: the foreground before it is parted, and the objects.
struct ThresholdView {
  int threshold = 0;
  Pipeline pipeline = Pipeline::kNuclei;  // never kAuto
  const BinaryImage& mask;
  const LabelImage& labels;
};
using ThresholdVisitor = std::function<void(const ThresholdView& view)>;

struct SegmentOptions {
  Pipeline pipeline = Pipeline::kAuto;
  Foreground foreground = Foreground::kAuto;
  std::optional<int> threshold = {};                     // 0..254, of the step `signal`; none: Otsu
  std::optional<std::int64_t> background_reach_px = {};  // 3..20,000; none: a quarter of the shorter side, at least 15
  std::int64_t window_radius_px = 3;                     // 1..50, of the local deviation
  std::optional<std::int64_t> area_min_px =
      {};  // smallest object; none: nuclei an eighth of the median piece, phase the window
  std::optional<std::int64_t> hole_max_px =
      {};              // largest hole that is filled; none: nuclei an eighth of the median piece, phase 4 windows
  bool clahe = false;  // even the local contrast first
  bool split = true;   // nuclei: part touching objects
  bool keep_steps = true;
  /// Keep only the step of this name, and end there: nothing else of the result is then made, and no sweep. Empty: all.
  std::string keep_only = {};
  bool sweep = true;           // nine levels: most of the time
  ThresholdVisitor at_threshold = {};  // called for every level of the sweep, the answer's own first, then ascending
};

/// What one threshold gives; the sweep shows how much the answer hangs on it.
struct SweepPoint {
  int threshold = 0;
  std::int64_t foreground_px = 0;
  std::int64_t object_count = 0;
};

struct Segmentation {
  Pipeline pipeline = Pipeline::kNuclei;       // what was done: never kAuto
  Foreground foreground = Foreground::kLight;  // never kAuto; of phase, which knows no sides, kLight
  bool pipeline_given = false, foreground_given = false;
  std::string pipeline_reason, foreground_reason;  // why these, in a sentence
  int threshold = 0;
  bool threshold_given = false;
  std::optional<HumpFigures> levels = {};  // of the step `signal`; none for contours
  std::string doubt = {};                  // why there may be nothing in the picture; empty: nothing says so
  std::int64_t background_reach_px = 0;  // 0: not subtracted
  std::int64_t area_min_px = 0;
  std::int64_t field_px = 0;  // pixels that were looked at: the dish, else the frame
  bool dish_found = false;
  BinaryImage mask;  // the foreground, before it is parted
  LabelImage labels;
  std::vector<std::int64_t> areas_px;  // of label i + 1
  std::int64_t foreground_px = 0;      // sum of the areas
  std::vector<SweepPoint> sweep;       // nine levels about the threshold, ascending; fewer at the ends of the scale
  std::vector<StepImage> steps;
};

/// Throws Stopped when asked to, between steps.
Result<Segmentation> segment(const GreyImage& image, const SegmentOptions& options, StopFlag stop = nullptr);

/// The picture with the outlines of the objects over it, each in one of six colours by its number.
StepImage overlay(const GreyImage& image, const LabelImage& labels);

}  // namespace colony
