#include "engine/analysis/hump.hpp"

#include <cmath>

#include "engine/analysis/filters.hpp"
#include "engine/analysis/verdict.hpp"

namespace colony {

std::optional<HumpFigures> hump_figures(const GreyImage& signal, int from) {
  const int threshold = otsu(signal, from);
  if (threshold < 0) return std::nullopt;
  const auto counts = histogram(signal);
  double all = 0.0, above = 0.0, sum = 0.0, sum_above = 0.0;
  for (int level = from; level < 256; ++level) {
    const auto count = static_cast<double>(counts[static_cast<std::size_t>(level)]);
    all += count;
    sum += count * level;
    if (level <= threshold) continue;
    above += count;
    sum_above += count * level;
  }
  const double mean = sum / all;
  double moments[5] = {};  // central ones
  for (int level = from; level < 256; ++level) {
    const double count = static_cast<double>(counts[static_cast<std::size_t>(level)]) / all, apart = level - mean;
    double power = count;
    for (double& moment : moments) {
      moment += power;
      power *= apart;
    }
  }
  const double difference = sum_above / above - (sum - sum_above) / (all - above);
  HumpFigures figures;
  figures.between_share = above / all * (1.0 - above / all) * difference * difference / moments[2];
  figures.skewness = moments[3] / (moments[2] * std::sqrt(moments[2]));
  figures.kurtosis = moments[4] / (moments[2] * moments[2]);
  return figures;
}

bool is_one_hump(const HumpFigures& figures) {
  return figures.between_share <= kHumpBetweenMax && std::abs(figures.skewness) <= kHumpSkewnessMax && figures.kurtosis >= kHumpKurtosisMin &&
         figures.kurtosis <= kHumpKurtosisMax;
}

std::string hump_text(const HumpFigures& figures) {
  return "Warning: there may be nothing in this picture. What the threshold parts is one hump of levels, as noise has it: " + decimals(figures.between_share) +
         " of their variance lies between the two classes, their skewness is " + decimals(figures.skewness) + ", their kurtosis " +
         decimals(figures.kurtosis) + " (a normal distribution: 0.64, 0 and 3). What was counted may be the noise; the step signal shows it.";
}

}  // namespace colony
