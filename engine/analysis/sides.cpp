#include "engine/analysis/sides.hpp"

#include <algorithm>
#include <array>

#include "engine/analysis/contour.hpp"

namespace colony {
namespace {

constexpr double kLikelyMin = 0.05;  // p from which on the table is not contradicted

/// Of a value in [0, 1000), with three decimals, without a locale.
std::string thousandths(double value) {
  const auto count = static_cast<std::uint64_t>(value * 1000.0 + 0.5);
  std::string rest = std::to_string(count % 1000);
  rest.insert(0, 3 - rest.size(), '0');
  return std::to_string(count / 1000) + "." + rest;
}

std::uint64_t counted(const SideStatistics& sides) {
  std::uint64_t sum = 0;
  for (const std::uint64_t count : sides.counts) sum += count;
  return sum;
}

std::string mean_and_test(const SideStatistics& sides) {
  std::string text = thousandths(sides.sides_mean) + " sides on average (" + std::to_string(counted(sides)) + " of 4 to 9 sides, " +
                     std::to_string(sides.other_count) + " of fewer or more)";
  if (!sides.p_value) return text + "; too few for a test against Gibson's table";
  text += *sides.p_value < 0.001 ? "; against Gibson's table p is below 0.001" : "; against Gibson's table p = " + thousandths(*sides.p_value);
  return text + (*sides.p_value < kLikelyMin ? ": they differ from it" : ": no difference that so many cells could show");
}

/// Up to four pixels beside one, in reading order. (With gap_px a closed gap may lie at the frame's edge.)
struct Beside {
  std::array<std::size_t, 4> at{};
  std::size_t count = 0;
  Beside(const LabelImage& labels, std::size_t centre) {
    const auto width = static_cast<std::size_t>(labels.width_px);
    const std::size_t column = centre % width;
    if (centre >= width) at[count++] = centre - width;
    if (column > 0) at[count++] = centre - 1;
    if (column + 1 < width) at[count++] = centre + 1;
    if (centre + width < labels.values.size()) at[count++] = centre + width;
  }
  const std::size_t* begin() const { return at.data(); }
  const std::size_t* end() const { return at.data() + count; }
};

/// The holes' pixels, one hole after the other, each in the order in which it was walked.
class HoleFinder {
 public:
  HoleFinder(const LabelImage& labels, const BinaryImage& outside) : labels_(labels), seen_(outside) {}

  /// The hole that pixel `first` belongs to; empty if it is none's, or was found before.
  const std::vector<std::size_t>& from(std::size_t first) {
    hole_.clear();
    take(first);
    for (std::size_t i = 0; i < hole_.size(); ++i) {
      for (const std::size_t next : Beside(labels_, hole_[i])) take(next);
    }
    return hole_;
  }

 private:
  void take(std::size_t at) {
    if (labels_.values[at] != 0 || seen_.values[at] != 0) return;
    seen_.values[at] = 1;
    hole_.push_back(at);
  }

  const LabelImage& labels_;
  BinaryImage seen_;  // outside, or walked over
  std::vector<std::size_t> hole_;
};

/// Gives the pixels of one hole to the labels about it, ring by ring.
void give(LabelImage& labels, std::vector<std::size_t> hole, std::vector<std::size_t>& queue) {
  std::sort(hole.begin(), hole.end());
  queue.clear();
  std::vector<std::uint32_t> found;
  for (const std::size_t at : hole) {
    for (const std::size_t next : Beside(labels, at)) {
      if (labels.values[next] == 0) continue;
      queue.push_back(at);
      found.push_back(labels.values[next]);
      break;
    }
  }
  // Only now: a pixel of the first ring must not count as a label for the next pixel of the same ring.
  for (std::size_t i = 0; i < queue.size(); ++i) labels.values[queue[i]] = found[i];
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const std::size_t at = queue[i];
    for (const std::size_t next : Beside(labels, at)) {
      // A closed gap may end at the outside, which is nobody's.
      if (labels.values[next] != 0 || !std::binary_search(hole.begin(), hole.end(), next)) continue;
      labels.values[next] = labels.values[at];
      queue.push_back(next);
    }
  }
}

}  // namespace

Result<GivenHoles> give_holes(const LabelImage& labels, std::uint64_t hole_max_px, std::int64_t gap_px, StopFlag stop) {
  const Result<BinaryImage> outside = outside_of(labels, gap_px);
  if (!outside) return outside.error();
  GivenHoles result{labels, hole_max_px, 0, 0};
  HoleFinder holes(labels, *outside);
  std::vector<std::size_t> queue;
  for (std::size_t at = 0; at < labels.values.size(); ++at) {
    if (at % static_cast<std::size_t>(labels.width_px) == 0) throw_if_stopped(stop);
    const std::vector<std::size_t>& hole = holes.from(at);
    if (hole.empty() || hole.size() > hole_max_px) continue;
    ++result.hole_count;
    result.hole_px += hole.size();
    give(result.labels, hole, queue);
  }
  return result;
}

Result<ClosedSides> closed_sides(const LabelImage& labels, double cell_area_mean_px, std::int64_t gap_px, StopFlag stop) {
  const Result<GivenHoles> given = give_holes(labels, static_cast<std::uint64_t>(cell_area_mean_px / 2.0), gap_px, stop);
  if (!given) return given.error();
  const Result<Contacts> contacts = find_contacts(given->labels, gap_px, stop);
  if (!contacts) return contacts.error();
  return ClosedSides{given->hole_max_px, given->hole_count, given->hole_px, side_statistics(*contacts)};
}

std::vector<std::string> judge_sides(const SideStatistics& seen, const ClosedSides& closed) {
  if (counted(seen) + seen.other_count == 0) return {};
  std::vector<std::string> sentences;
  sentences.push_back("The interior cells as they are seen have " + mean_and_test(seen) + ".");
  if (closed.hole_count == 0) return sentences;
  sentences.push_back("With the " + std::to_string(closed.hole_count) + " holes of at most half a mean cell (" + std::to_string(closed.hole_max_px) +
                      " px) given to the cells about them they have " + mean_and_test(closed.sides) + ".");
  if (seen.p_value && closed.sides.p_value && (*seen.p_value < kLikelyMin) != (*closed.sides.p_value < kLikelyMin)) {
    sentences.push_back(*seen.p_value < kLikelyMin
                            ? "It is the holes where cells meet that differ from Gibson's table, not the cells: the second count is the one to compare."
                            : "Only the holes where cells meet make the first count like Gibson's table: the second count is the one to compare.");
  }
  return sentences;
}

}  // namespace colony
