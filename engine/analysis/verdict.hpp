// verdict: what follows from the box counts of a line and its controls, and what does not, as a finding and in sentences.
// Method:  slopes over kSlopeWindow neighbouring sides (a line through them: single steps swing with rounding); how far they drift (Crossover),
//          over how many decades they stay on a plateau, how many decades were counted at all, and which controls give the same value.
// Findings: too_few    lines of fewer than kObjectsMin single things: what is counted is the shape of these few, no structure of many;
//          short_range less than kDecadesMin counted: no power law can be told from another smooth curve, whatever its slopes do;
//          crossover  the slopes drift: two regimes joined, the line's slope is the dimension of neither;
//          wandering  no drift, but no plateau of kDecadesMin and of kPlateauShareMin of the range either;
//          scaling    such a plateau: a power law fits there; whether it means anything the controls say.
// Meaning: none of these proves a fractal. A value that a control without the property also has says nothing about the property.
// Units:   pixels; decades of box sides.      Errors: none: a line without figures says why.      Threads: pure.
// Source:  decades: Avnir et al. 1998 (published fractals span 1.3 decades on average, which they hold to be too few); the limits are ours.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/analysis/scaling.hpp"

namespace colony {

inline constexpr std::size_t kSlopeWindow = 5;   // sides; a factor 2.9 at the usual ratio 1.3, about a period of sets that repeat in threes
inline constexpr double kPlateauBand = 0.15;     // slopes within it of each other are alike
inline constexpr double kDecadesMin = 1.0;
inline constexpr double kPlateauShareMin = 0.75;  // exact fractals 1.0, smooth outlines from 0.8, scattered colonies 0.6
inline constexpr double kBoxBias = 0.05;         // of generic boxes: a difference within it is none
inline constexpr std::uint64_t kObjectsMin = 10;  // cells, nuclei or objects from which on lines about them have a finding

/// Lines that were counted, or why not.
struct MeasuredLine {
  std::optional<BoxDimensions> dimensions = {};
  std::string reason = {};                // where there are none
  /// Single things that the lines go around; none where their number says nothing: regions of many cells, sets from elsewhere.
  std::optional<std::uint64_t> object_count = {};
};

enum class Finding { kNoFigures, kCrossover, kShortRange, kWandering, kScaling, kTooFew };
/// "no_figures", "crossover", "short_range", "wandering", "scaling", "too_few".
std::string_view name_of(Finding finding);
/// What the counts of a line say, its controls aside: the one label of a line, wherever it is shown.
Finding finding_of(const MeasuredLine& line);

/// How the dimension goes from small boxes to large ones.
struct SlopeCourse {
  double first = 0.0, last = 0.0;         // over the smallest and the largest window
  double low = 0.0, high = 0.0;           // of all windows
  double decades = 0.0;                   // of the sides counted
  double plateau_decades = 0.0;           // longest range of sides whose windows all lie within kPlateauBand of each other
};

/// Slopes of lines through kSlopeWindow neighbouring sides (through all, where there are fewer), each at the geometric mean of its sides.
std::vector<LocalSlope> windowed_slopes(const BoxDimensions& found);

/// At least kSlopeWindow sides, else one window of all.
SlopeCourse slope_course(const BoxDimensions& found);

struct NamedLine {
  std::string name;
  const MeasuredLine* line = nullptr;
};

struct LineFinding {
  Finding finding = Finding::kNoFigures;
  SlopeCourse slopes;
  std::vector<std::string> like_controls;    // no difference that box counting could show: within 2 standard errors or kBoxBias
  std::vector<std::string> unlike_controls;
  std::vector<std::string> sentences;
};

/// Of two values of one line: whether more than errors and bias parts them.
bool dimensions_differ(const Dimension& a, const Dimension& b);

/// `name` as in "cell walls".
LineFinding judge_line(const std::string& name, const MeasuredLine& line, std::span<const NamedLine> controls);

/// "boxes of 3 to 200 px": without its range a slope is no result.
std::string boxes_of(const BoxDimensions& found);
/// "1.437 +- 0.038"
std::string with_error(const Dimension& dimension);
/// Rounded to `count` decimals (1 to 6), without a locale; |value| < 1e9.
std::string decimals(double value, int count = 2);

}  // namespace colony
