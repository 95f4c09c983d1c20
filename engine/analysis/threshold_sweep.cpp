#include "engine/analysis/threshold_sweep.hpp"

#include <algorithm>
#include <utility>

#include "engine/analysis/contour.hpp"

namespace colony {
namespace {

const char* const kGridText =
    "Against the threshold all rows are counted with one grid from the frame's corner, the answer itself with one from the corner of what is counted: at one "
    "and the same threshold the two differ by what the place of a grid makes, a few hundredths.";

/// The extremes of one line over the rows, in words.
std::string hanging_text(const std::string& name, const ThresholdSweep& sweep, MeasuredLine ThresholdRow::* line) {
  const ThresholdRow *low = nullptr, *high = nullptr;
  std::size_t counted = 0;
  for (const ThresholdRow& row : sweep.rows) {
    if (!(row.*line).dimensions) continue;
    ++counted;
    const auto value = [&](const ThresholdRow* of) { return (of->*line).dimensions->capacity.value; };
    if (low == nullptr || value(&row) < value(low)) low = &row;
    if (high == nullptr || value(&row) > value(high)) high = &row;
  }
  const std::string begin = "Threshold " + std::to_string(sweep.rows.front().threshold) + " to " +
                            std::to_string(sweep.rows.back().threshold) + ": the " + name + " could be counted at " +
                            std::to_string(counted) + " of " + std::to_string(sweep.rows.size()) + " levels";
  if (counted < 2) return begin + ": whether the value hangs on the threshold is not known.";
  const Dimension& least = (low->*line).dimensions->capacity;
  const Dimension& most = (high->*line).dimensions->capacity;
  return begin + ", with D0 for " + boxes_of(*(low->*line).dimensions) + " from " + decimals(least.value) + " (at " + std::to_string(low->threshold) + ") to " +
         decimals(most.value) + " (at " + std::to_string(high->threshold) + "): " +
         (dimensions_differ(least, most) ? "more than errors and bias: part of the value is the threshold's."
                                         : "no more than errors and bias: the value does not hang on the threshold.");
}

}  // namespace

void ThresholdLines::add(const ThresholdView& view) {
  const bool is_ink = view.pipeline == Pipeline::kContours;  // drawn lines are counted as they are
  const Result<BinaryImage> walls = is_ink ? Result<BinaryImage>(view.mask) : cell_walls(view.labels);
  const Result<BinaryImage> outline = is_ink ? colony_outline(view.mask) : colony_outline(view.labels);
  if (sweep_.rows.empty() && walls) {
    std::vector<std::int64_t> sides = geometric_sides(foreground_box(*walls).longer_side(), boxes_);
    if (sides.size() >= kSidesMin) boxes_.sides_px = sweep_.sides_px = std::move(sides);
  }
  ThresholdRow row{view.threshold, {}, {}};
  if (sweep_.sides_px.empty()) {
    row.walls.reason = row.outline.reason = "the lines at the answer's own threshold leave fewer than " + std::to_string(kSidesMin) + " box sides";
  } else {
    row.walls = measure_line(walls, boxes_, stop_);
    row.outline = measure_line(outline, boxes_, stop_);
  }
  if (!is_ink) {
    // Numbered from 1 on.
    const auto last = std::max_element(view.labels.values.begin(), view.labels.values.end());
    row.walls.object_count = row.outline.object_count = last == view.labels.values.end() ? 0 : *last;
  }
  sweep_.rows.push_back(std::move(row));
}

ThresholdSweep ThresholdLines::finish(ObjectKind kind) {
  const LineNames names = line_names(kind);
  std::sort(sweep_.rows.begin(), sweep_.rows.end(), [](const ThresholdRow& a, const ThresholdRow& b) { return a.threshold < b.threshold; });
  if (kind == ObjectKind::kRegions) {
    for (ThresholdRow& row : sweep_.rows) row.walls.object_count = row.outline.object_count = std::nullopt;
  }
  if (!sweep_.rows.empty()) {
    sweep_.sentences = {hanging_text(names.walls, sweep_, &ThresholdRow::walls), hanging_text(names.outline, sweep_, &ThresholdRow::outline), kGridText};
  }
  return std::exchange(sweep_, {});
}

}  // namespace colony
