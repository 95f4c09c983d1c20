// hump: whether the levels that a threshold parts are two kinds of pixels at all, or one hump, as noise has it.
// Method:  three figures of the histogram of levels `from`..255: the share of the variance that lies between Otsu's two classes, skewness, kurtosis.
//          A normal distribution cut at its mean has 2 / pi = 0.637, 0 and 3, whatever its width; the local deviation of white noise is nearly normal.
//          Few things on much ground are skewed, two kinds of some size flat (kurtosis down to 1) and parted well.
// Rule:    one hump if all three are near those of noise. Limits were set after seeing noise (0.62..0.71, -0.51..0.28, 2.9..4.0) and photographs
//          (0.69 and more, with |skewness| 0.5 or a kurtosis away from it): see engine/DESIGN.md, Segmentation.
// Not:     no proof of either: a picture whose grey levels spread as evenly as noise passes for it, and noise with a scratch on it for a picture.
// Errors:  none. Fewer than two levels: no figures.     Threads: pure. Doubles, summed by level: the same everywhere.
#pragma once

#include <optional>
#include <string>

#include "engine/analysis/image.hpp"

namespace colony {

inline constexpr double kHumpBetweenMax = 0.72, kHumpSkewnessMax = 0.6, kHumpKurtosisMin = 2.8, kHumpKurtosisMax = 4.2;

struct HumpFigures {
  double between_share = 0.0;  // of the variance, between Otsu's classes
  double skewness = 0.0;
  double kurtosis = 0.0;       // 3 for a normal distribution
};

std::optional<HumpFigures> hump_figures(const GreyImage& signal, int from = 0);
bool is_one_hump(const HumpFigures& figures);
/// The warning, in words.
std::string hump_text(const HumpFigures& figures);

}  // namespace colony
