#include "engine/analysis/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/controls.hpp"
#include "engine/analysis/line_fit.hpp"
#include "engine/analysis/morphology.hpp"

namespace colony {
namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// Of a border's points, in half pixels: at most 40,000, and fewer than 2^31 of them: no sum exceeds 63 bits.
struct BorderSums {
  std::int64_t count = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

class BorderMap {
 public:
  void add(std::uint32_t a, std::uint32_t b, std::int64_t x, std::int64_t y) {
    const Pair pair{std::min(a, b), std::max(a, b)};
    // Neighbouring edges mostly belong to the same border.
    if (last_ == nullptr || pair != last_pair_) {
      last_ = &borders_[pair];
      last_pair_ = pair;
    }
    ++last_->count;
    last_->x += x;
    last_->y += y;
    last_->xx += x * x;
    last_->xy += x * y;
    last_->yy += y * y;
  }
  const std::map<Pair, BorderSums>& all() const { return borders_; }

 private:
  std::map<Pair, BorderSums> borders_;
  Pair last_pair_{};
  BorderSums* last_ = nullptr;
};

/// Pairs along one line of pixels; `place(i)` is the index of pixel i, `point(a, b)` reports the middle between two pixels.
template <class Place, class Found>
void scan_line(const LabelImage& labels, std::int64_t count, std::int64_t gap_px, const Place& place, const Found& found) {
  std::int64_t last = -1;
  for (std::int64_t i = 0; i < count; ++i) {
    const std::uint32_t label = labels.values[place(i)];
    if (label == 0) continue;
    if (last >= 0 && i - last - 1 <= gap_px) {
      const std::uint32_t before = labels.values[place(last)];
      if (before != label) found(before, label, last + i + 1);  // twice the coordinate of the middle
    }
    last = i;
  }
}

Border border_of(const Pair& pair, const BorderSums& sums) {
  Border border{pair.first, pair.second, static_cast<std::uint64_t>(sums.count), 0.0, 0.0};
  const auto n = static_cast<double>(sums.count);
  const double x = static_cast<double>(sums.x) / n, y = static_cast<double>(sums.y) / n;
  const double xx = static_cast<double>(sums.xx) / n - x * x, yy = static_cast<double>(sums.yy) / n - y * y;
  const double xy = static_cast<double>(sums.xy) / n - x * y;
  const double spread = std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy);
  // Half pixels: a quarter of the variance.
  border.length_px = std::sqrt(12.0 * std::max(0.0, (xx + yy + spread) / 2.0) / 4.0);
  border.deviation_px = std::sqrt(std::max(0.0, (xx + yy - spread) / 2.0) / 4.0);
  return border;
}

/// Marks labels with a pixel beside the outside or at the frame's edge.
std::vector<bool> at_edge(const LabelImage& labels, const BinaryImage& outside, const std::vector<LabelArea>& areas, StopFlag stop) {
  std::vector<bool> edge(areas.size(), false);
  for (std::int64_t row = 0; row < labels.height_px; ++row) {
    throw_if_stopped(stop);
    for (std::int64_t column = 0; column < labels.width_px; ++column) {
      const std::uint32_t label = labels.at(row, column);
      if (label == 0) continue;
      if (outside.at_or(row - 1, column, 1) == 0 && outside.at_or(row + 1, column, 1) == 0 &&
          outside.at_or(row, column - 1, 1) == 0 && outside.at_or(row, column + 1, 1) == 0) {
        continue;
      }
      const auto found = std::lower_bound(areas.begin(), areas.end(), label,
                                          [](const LabelArea& area, std::uint32_t value) { return area.label < value; });
      edge[static_cast<std::size_t>(found - areas.begin())] = true;
    }
  }
  return edge;
}

StraightnessGroup group_of(const std::vector<double>& values) {
  StraightnessGroup group;
  group.count = values.size();
  if (values.empty()) return group;
  const auto n = static_cast<double>(values.size());
  double sum = 0.0, squares = 0.0;
  for (const double value : values) sum += value;
  group.mean = sum / n;
  for (const double value : values) squares += (value - group.mean) * (value - group.mean);
  if (values.size() > 1) group.standard_error = std::sqrt(squares / (n - 1.0) / n);
  return group;
}

}  // namespace

Result<Contacts> find_contacts(const LabelImage& labels, std::int64_t gap_px, StopFlag stop) {
  const Result<BinaryImage> outside = outside_of(labels, gap_px);
  if (!outside) return outside.error();
  const std::vector<LabelArea> areas = label_areas(labels);
  if (areas.empty() || areas.size() > kLabelsMax) {
    const std::string message = areas.empty() ? "has no labels: there is nothing to measure"
                                              : "more than " + std::to_string(kLabelsMax) + " labels";
    return Error{areas.empty() ? ErrorCode::kInvalid : ErrorCode::kLimit, "image: " + message, {{"image", message}}};
  }
  BorderMap borders;
  for (std::int64_t row = 0; row < labels.height_px; ++row) {
    throw_if_stopped(stop);
    scan_line(labels, labels.width_px, gap_px, [&](std::int64_t i) { return labels.index(row, i); },
              [&](std::uint32_t a, std::uint32_t b, std::int64_t twice) { borders.add(a, b, twice, 2 * row + 1); });
  }
  for (std::int64_t column = 0; column < labels.width_px; ++column) {
    throw_if_stopped(stop);
    scan_line(labels, labels.height_px, gap_px, [&](std::int64_t i) { return labels.index(i, column); },
              [&](std::uint32_t a, std::uint32_t b, std::int64_t twice) { borders.add(a, b, 2 * column + 1, twice); });
  }
  Contacts contacts;
  const std::vector<bool> edge = at_edge(labels, *outside, areas, stop);
  for (std::size_t i = 0; i < areas.size(); ++i) contacts.cells.push_back({areas[i].label, 0, !edge[i]});
  const auto cell_of = [&](std::uint32_t label) {
    return std::lower_bound(contacts.cells.begin(), contacts.cells.end(), label,
                            [](const CellContacts& cell, std::uint32_t value) { return cell.label < value; });
  };
  for (const auto& [pair, sums] : borders.all()) {
    if (static_cast<std::uint64_t>(sums.count) < kBorderEdgesMin) continue;
    contacts.borders.push_back(border_of(pair, sums));
    ++cell_of(pair.first)->neighbour_count;
    ++cell_of(pair.second)->neighbour_count;
  }
  return contacts;
}

SideStatistics side_statistics(const Contacts& contacts) {
  SideStatistics result;
  std::uint64_t total = 0, sides = 0;
  for (const CellContacts& cell : contacts.cells) {
    if (!cell.interior) continue;
    if (cell.neighbour_count < kSidesFirst || cell.neighbour_count > kSidesLast) {
      ++result.other_count;
      continue;
    }
    ++result.counts[cell.neighbour_count - kSidesFirst];
    ++total;
    sides += cell.neighbour_count;
  }
  if (total == 0) return result;
  const auto n = static_cast<double>(total);
  result.sides_mean = static_cast<double>(sides) / n;
  for (std::size_t i = 0; i < result.counts.size(); ++i) {
    result.shares[i] = static_cast<double>(result.counts[i]) / n;
    result.difference_max = std::max(result.difference_max, std::abs(result.shares[i] - kGibsonShares[i]));
  }
  if (total < 20) return result;
  const auto& share = kGibsonShares;
  const auto& count = result.counts;
  // (observed, expected share): first and last index of each class.
  std::vector<std::pair<std::size_t, std::size_t>> classes{{0, 1}, {2, 2}, {3, 3}, {4, 5}};
  if (n * (share[4] + share[5]) < 5.0) classes = {{0, 1}, {2, 2}, {3, 5}};
  double all = 0.0, statistic = 0.0;
  for (const double s : share) all += s;
  for (const auto& [first, last] : classes) {
    double observed = 0.0, expected = 0.0;
    for (std::size_t i = first; i <= last; ++i) {
      observed += static_cast<double>(count[i]);
      expected += n * share[i] / all;
    }
    statistic += (observed - expected) * (observed - expected) / expected;
  }
  result.chi_square = statistic;
  result.degrees = classes.size() - 1;
  result.p_value = chi_square_tail(statistic, result.degrees);
  return result;
}

SiblingStraightness sibling_straightness(const Contacts& contacts, const std::vector<Pair>& siblings) {
  std::vector<Pair> sorted;
  for (const Pair& pair : siblings) sorted.emplace_back(std::min(pair.first, pair.second), std::max(pair.first, pair.second));
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> of_siblings, of_others;
  for (const Border& border : contacts.borders) {
    if (border.length_px < kStraightLengthMin_px) continue;
    const bool sibling = std::binary_search(sorted.begin(), sorted.end(), Pair{border.low, border.high});
    (sibling ? of_siblings : of_others).push_back(border.deviation_px / border.length_px);
  }
  SiblingStraightness result{group_of(of_siblings), group_of(of_others), 0.0, 0.0};
  if (of_siblings.empty() || of_others.empty()) return result;
  result.difference = result.others.mean - result.siblings.mean;
  const double a = result.siblings.standard_error, b = result.others.standard_error;
  if (of_siblings.size() > 1 && of_others.size() > 1 && a + b > 0.0) result.t = result.difference / std::sqrt(a * a + b * b);
  return result;
}

}  // namespace colony
