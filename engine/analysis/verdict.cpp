#include "engine/analysis/verdict.hpp"

#include <algorithm>
#include <cmath>

#include "engine/analysis/line_fit.hpp"
#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

double decades_between(double low, double high) { return maths::log(high / low) / maths::log(10.0); }

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string course_text(const SlopeCourse& slopes) {
  const double change = slopes.last - slopes.first;
  const std::string ends = decimals(slopes.first) + " to " + decimals(slopes.last);
  if (std::abs(change) <= kPlateauBand) return "the local slopes go from " + ends;
  return std::string("the local slopes ") + (change > 0.0 ? "rise" : "fall") + " from " + ends;
}

std::string value_text(const BoxDimensions& found) {
  return "D0 = " + with_error(found.capacity) + " (smallest cover " + decimals(found.smallest_cover.value) + ")";
}

std::string finding_text(const std::string& name, const BoxDimensions& found, const LineFinding& line, std::uint64_t line_count) {
  const SlopeCourse& slopes = line.slopes;
  const std::string begin = "The " + name + ": ";
  switch (line.finding) {
    case Finding::kCrossover:
      return begin + "a crossover, not scaling. From small to large boxes " + course_text(slopes) +
             ", without a plateau: they are alike over " + decimals(slopes.plateau_decades) + " of " + decimals(slopes.decades) +
             " decades at most. So the slope of the line, " + value_text(found) + " for " + boxes_of(found) + ", hangs on the range and is no dimension.";
    case Finding::kShortRange:
      return begin + "too small a range. " + value_text(found) + " for " + boxes_of(found) + ", which is " + decimals(slopes.decades) +
             " decades: no power law can be told from another smooth curve there" +
             (found.crossover.found ? ", and even there " + course_text(slopes) + "." : ".");
    case Finding::kWandering:
      return begin + "no clear scaling. The local slopes lie between " + decimals(slopes.low) + " and " + decimals(slopes.high) +
             " and are alike over " + decimals(slopes.plateau_decades) + " of " + decimals(slopes.decades) + " decades at most. " + value_text(found) + " for " +
             boxes_of(found) + " is a mean of them.";
    case Finding::kScaling:
      return begin + "consistent with scaling: " + value_text(found) + " for " + boxes_of(found) + ", " + decimals(slopes.decades) +
             " decades, of which the local slopes are alike over " + decimals(slopes.plateau_decades) + ".";
    case Finding::kTooFew:
      return begin + "too few for a finding: " + std::to_string(line_count) + (line_count == 1 ? " object was" : " objects were") + " counted, and fewer than " +
             std::to_string(kObjectsMin) + " say something of their own shapes, nothing of how many lie together. " + value_text(found) + " for " + boxes_of(found) +
             " is the slope of these few.";
    case Finding::kNoFigures: break;
  }
  return {};
}

/// What the value alone is, where it is that of something plain.
std::string plain_text(const std::string& name, const BoxDimensions& found) {
  const double value = found.capacity.value;
  if (std::abs(value - 1.0) <= kBoxBias) return "1 is the dimension of a smooth line: no roughness of the " + name + " shows in it.";
  if (value >= 2.0 - 2.0 * kBoxBias) return "2 is the dimension of a filled area: at this resolution there is no structure in the " + name + ".";
  return {};
}

std::string conclusion(const std::string& name, const LineFinding& line, bool is_plain, bool has_controls) {
  const bool is_alike = !line.like_controls.empty();
  std::string follows, not_follows;
  switch (line.finding) {
    case Finding::kCrossover:
      follows = "the counts bend at a length of the picture, such as the size of a cell";
      not_follows = "that anything about the " + name + " is fractal, or that a picture with the same slope has the same structure";
      break;
    case Finding::kShortRange:
      follows = "nothing about scaling";
      not_follows = "that anything about the " + name + " is fractal: a picture with more pixels a cell, or more cells, is needed";
      break;
    case Finding::kWandering:
      follows = "no dimension";
      not_follows = "that anything about the " + name + " is fractal";
      break;
    default:
      follows = "a power law fits over this range";
      not_follows = is_plain ? "that anything about the " + name + " is fractal: this value needs no fractal"
                    : is_alike ? "that anything about the " + name + " is fractal: a control that is not has the same value"
                    : has_controls ? "that it goes on beyond this range: a fractal shows over more decades than a picture has"
                                   : "that it goes on beyond this range, or that smooth cells would give another value: no control was counted";
  }
  return "What follows for the " + name + ": " + follows + ". What does not: " + not_follows + ".";
}

}  // namespace

std::string_view name_of(Finding finding) {
  constexpr std::string_view kNames[] = {"no_figures", "crossover", "short_range", "wandering", "scaling", "too_few"};
  return kNames[static_cast<std::size_t>(finding)];
}

Finding finding_of(const MeasuredLine& line) {
  if (!line.dimensions) return Finding::kNoFigures;
  if (line.object_count && *line.object_count < kObjectsMin) return Finding::kTooFew;
  const SlopeCourse slopes = slope_course(*line.dimensions);
  if (slopes.decades < kDecadesMin) return Finding::kShortRange;
  if (line.dimensions->crossover.found) return Finding::kCrossover;
  const bool has_plateau = slopes.plateau_decades >= kDecadesMin && slopes.plateau_decades >= kPlateauShareMin * slopes.decades;
  return has_plateau ? Finding::kScaling : Finding::kWandering;
}

std::string boxes_of(const BoxDimensions& found) {
  return "boxes of " + std::to_string(found.side_min_px) + " to " + std::to_string(found.side_max_px) + " px";
}

std::string decimals(double value, int count) {
  CHECK(count >= 1 && count <= 6 && std::abs(value) < 1e9);
  std::int64_t unit = 1;
  for (int i = 0; i < count; ++i) unit *= 10;
  const auto parts = static_cast<std::int64_t>(std::abs(value) * static_cast<double>(unit) + 0.5);
  std::string rest = std::to_string(parts % unit);
  rest.insert(0, static_cast<std::size_t>(count) - rest.size(), '0');
  return (value < 0.0 && parts > 0 ? "-" : "") + std::to_string(parts / unit) + "." + rest;
}

std::string with_error(const Dimension& dimension) {
  return decimals(dimension.value, 3) + " +- " + decimals(dimension.standard_error, 3);
}

std::vector<LocalSlope> windowed_slopes(const BoxDimensions& found) {
  std::vector<double> log_side, log_count;
  for (const BoxCount& count : found.counts) {
    log_side.push_back(maths::log(static_cast<double>(count.side_px)));
    log_count.push_back(maths::log(count.count_mean));
  }
  const std::size_t window = std::min(kSlopeWindow, log_side.size());
  std::vector<LocalSlope> slopes;
  for (std::size_t i = 0; i + window <= log_side.size(); ++i) {
    double mean = 0.0;
    for (std::size_t k = i; k < i + window; ++k) mean += log_side[k] / static_cast<double>(window);
    slopes.push_back({maths::exp(mean), -fit_line({log_side.data() + i, window}, {log_count.data() + i, window}).slope});
  }
  return slopes;
}

SlopeCourse slope_course(const BoxDimensions& found) {
  std::vector<double> slopes;
  for (const LocalSlope& slope : windowed_slopes(found)) slopes.push_back(slope.dimension);
  const std::size_t window = std::min(kSlopeWindow, found.counts.size());
  SlopeCourse course;
  course.first = slopes.front();
  course.last = slopes.back();
  course.low = *std::min_element(slopes.begin(), slopes.end());
  course.high = *std::max_element(slopes.begin(), slopes.end());
  course.decades = decades_between(static_cast<double>(found.side_min_px), static_cast<double>(found.side_max_px));
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    double low = slopes[i], high = slopes[i];
    for (std::size_t k = i; k < slopes.size(); ++k) {
      low = std::min(low, slopes[k]);
      high = std::max(high, slopes[k]);
      if (high - low > kPlateauBand) break;
      const auto side = [&](std::size_t at) { return static_cast<double>(found.counts[at].side_px); };
      course.plateau_decades = std::max(course.plateau_decades, decades_between(side(i), side(k + window - 1)));
    }
  }
  return course;
}

bool dimensions_differ(const Dimension& a, const Dimension& b) {
  const double error = std::sqrt(a.standard_error * a.standard_error + b.standard_error * b.standard_error);
  return std::abs(a.value - b.value) > std::max(2.0 * error, kBoxBias);
}

LineFinding judge_line(const std::string& name, const MeasuredLine& line, std::span<const NamedLine> controls) {
  LineFinding result;
  if (!line.dimensions) {
    result.sentences.push_back("The " + name + ": no dimension here: " + line.reason + ".");
    return result;
  }
  const BoxDimensions& found = *line.dimensions;
  result.slopes = slope_course(found);
  result.finding = finding_of(line);
  if (result.finding == Finding::kTooFew) {  // as many discs show no more
    result.sentences.push_back(finding_text(name, found, result, *line.object_count));
    return result;
  }
  std::vector<std::string> alike, unlike;
  for (const NamedLine& control : controls) {
    if (!control.line->dimensions) continue;
    const Dimension& other = control.line->dimensions->capacity;
    const bool differs = dimensions_differ(found.capacity, other);
    (differs ? result.unlike_controls : result.like_controls).push_back(control.name);
    (differs ? unlike : alike).push_back(control.name + " (" + with_error(other) + " for " + boxes_of(*control.line->dimensions) + ")");
  }
  result.sentences.push_back(finding_text(name, found, result, 0));
  // A slope that is only a mean of others is the dimension of nothing, not even of a line.
  const bool is_one_value = result.finding == Finding::kScaling || result.finding == Finding::kShortRange;
  const std::string plain = is_one_value ? plain_text(name, found) : std::string();
  if (!plain.empty()) result.sentences.push_back(plain);
  if (!alike.empty()) {
    result.sentences.push_back("The control" + std::string(alike.size() > 1 ? "s " : " ") + joined(alike) + (alike.size() > 1 ? " give" : " gives") +
                               " the same within errors and bias, so the value says nothing about a fractal nature of the " + name + ".");
  }
  if (!unlike.empty()) {
    result.sentences.push_back("The control" + std::string(unlike.size() > 1 ? "s " : " ") + joined(unlike) +
                               (unlike.size() > 1 ? " differ" : " differs") + " by more than errors and bias: " +
                               (alike.empty() ? "number, size and cover of what is counted do not explain the value."
                                              : "with number, size and cover alike the value still hangs on how things lie."));
  }
  if (alike.empty() && unlike.empty()) {
    result.sentences.push_back("No control could be counted: nothing shows what smooth cells of this number and size would give for the " + name + ".");
  }
  result.sentences.push_back(conclusion(name, result, !plain.empty(), !alike.empty() || !unlike.empty()));
  return result;
}

}  // namespace colony
