// threshold_sweep: the dimensions of a picture's walls and outline against the threshold: what hangs on it is a property of the threshold.
// Method:  at each level of the segmentation's sweep the lines of what is found there, counted as everywhere, with one series of box sides in
//          one frame, those of the answer's own walls: so the rows can be compared. The grid begins at the frame's corner, not at the
//          foreground's, so a row of the answer's own threshold differs from the answer by what the place of a grid makes, a few hundredths:
//          the last sentence says so.
// Units:   grey levels of the step `signal`; pixels.
// Errors:  none: a row that cannot be counted says why. Throws Stopped.     Threads: as count_boxes.
#pragma once

#include "engine/analysis/report.hpp"
#include "engine/analysis/segment.hpp"

namespace colony {

struct ThresholdRow {
  int threshold = 0;
  MeasuredLine walls;                     // of what is found at this threshold, with its own number of objects (of ink: not known)
  MeasuredLine outline;
};

struct ThresholdSweep {
  std::vector<std::int64_t> sides_px;     // the same for every row; none: the answer's own walls have too few
  std::vector<ThresholdRow> rows;         // by rising threshold
  std::vector<std::string> sentences;     // whether walls and outline hang on it
};

/// Takes the levels as `segment` hands them over (SegmentOptions::at_threshold), the answer's own first.
class ThresholdLines {
 public:
  explicit ThresholdLines(const BoxOptions& boxes, StopFlag stop = nullptr) : boxes_(boxes), stop_(stop) {}
  void add(const ThresholdView& view);
  ThresholdSweep finish(ObjectKind kind = ObjectKind::kCells);

 private:
  BoxOptions boxes_;
  StopFlag stop_;
  ThresholdSweep sweep_;
};

}  // namespace colony
