#include "engine/analysis/split.hpp"

#include <algorithm>
#include <numeric>

namespace colony {
namespace {

constexpr std::uint32_t kNone = 0;
constexpr std::uint32_t kDepthShare =
    8;  // a basin is an object if it is deeper than the saddle by this part of its depth ...
constexpr std::uint32_t kDepthLeast = 16 / 2;  // ... and by half a pixel: less is the raster

/// Basins in the order of their first pixels; merged ones point to the one that is deeper.
struct Basins {
  std::vector<std::uint32_t> parent{0};
  std::vector<std::uint16_t> depth{0};
  std::vector<std::uint32_t> met{kNone};  // the basin met first and not merged with
  std::vector<std::int64_t> area_px{0};

  std::uint32_t start(std::uint16_t at_depth) {
    parent.push_back(static_cast<std::uint32_t>(parent.size()));
    depth.push_back(at_depth);
    met.push_back(kNone);
    area_px.push_back(0);
    return parent.back();
  }
  std::uint32_t root(std::uint32_t basin) {
    while (parent[basin] != basin) {
      parent[basin] = parent[parent[basin]];
      basin = parent[basin];
    }
    return basin;
  }
  /// The total order of basins: deeper first, then older.
  bool before(std::uint32_t a, std::uint32_t b) const { return depth[a] != depth[b] ? depth[a] > depth[b] : a < b; }
  void merge(std::uint32_t from, std::uint32_t into) {
    parent[from] = into;
    area_px[into] += area_px[from];
  }
};

}  // namespace

LabelImage split_touching(const Grey16Image& distance, std::int64_t area_min_px) {
  LabelImage labels(distance.width_px, distance.height_px, distance.um_per_px);
  // Counting sort, deepest first; within a depth in reading order.
  std::vector<std::size_t> first(65537, 0);
  for (const std::uint16_t depth : distance.values) ++first[65535 - depth + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  const std::size_t inside_count = first[65535];
  std::vector<std::uint32_t> order(inside_count);
  for (std::size_t i = 0; i < distance.values.size(); ++i) {
    const std::uint16_t depth = distance.values[i];
    if (depth > 0) order[first[65535 - depth]++] = static_cast<std::uint32_t>(i);
  }

  Basins basins;
  for (const std::uint32_t pixel : order) {
    const std::int64_t y = pixel / distance.width_px, x = pixel % distance.width_px;
    const std::uint16_t level = distance.values[pixel];
    // The basins that reach this pixel; it goes to the one of its deepest neighbour (ties: the first in reading order), as water would run.
    std::array<std::uint32_t, 8> roots{};
    std::size_t count = 0;
    std::uint32_t home = kNone;
    std::uint16_t home_level = 0;
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      for (std::int64_t dx = -1; dx <= 1; ++dx) {
        const std::uint32_t basin = labels.at_or(y + dy, x + dx, kNone);
        if (basin == kNone) continue;
        const std::uint32_t root = basins.root(basin);
        if (std::find(roots.begin(), roots.begin() + count, root) == roots.begin() + count) roots[count++] = root;
        if (distance.at(y + dy, x + dx) > home_level) {
          home_level = distance.at(y + dy, x + dx);
          home = root;
        }
      }
    }
    if (count == 0) home = basins.start(level);
    labels.values[pixel] = home;
    ++basins.area_px[home];
    for (std::size_t i = 1; i < count; ++i) {
      if (basins.before(roots[i], roots[0])) std::swap(roots[0], roots[i]);
    }
    for (std::size_t i = 1; i < count; ++i) {
      // The saddle is judged when the two meet first; later contacts are lower.
      const std::uint32_t depth = basins.depth[roots[i]];
      const std::uint32_t rise = depth - level;
      if (rise < kDepthLeast || rise * kDepthShare < depth) {
        basins.merge(roots[i], roots[0]);
      } else if (basins.met[roots[i]] == kNone) {
        basins.met[roots[i]] = roots[0];
      }
    }
  }
  // What is too small for an object goes to the neighbour it met first. Merging is always into an earlier one by `before`, so there is no circle.
  for (auto basin = static_cast<std::uint32_t>(basins.parent.size() - 1); basin > kNone; --basin) {
    const bool small = basins.parent[basin] == basin && basins.area_px[basin] < area_min_px;
    if (small && basins.met[basin] != kNone) basins.merge(basin, basins.root(basins.met[basin]));
  }
  for (std::uint32_t& label : labels.values) {
    if (label != kNone) label = basins.root(label);
  }
  return renumbered(labels, 1, nullptr);
}

LabelImage renumbered(const LabelImage& labels, std::int64_t area_min_px, std::vector<std::int64_t>* areas_px) {
  const std::uint32_t label_max =
      labels.values.empty() ? 0 : *std::max_element(labels.values.begin(), labels.values.end());
  std::vector<std::int64_t> area(std::size_t{label_max} + 1, 0);
  for (const std::uint32_t label : labels.values) ++area[label];
  std::vector<std::uint32_t> fresh(area.size(), 0);
  LabelImage result(labels.width_px, labels.height_px, labels.um_per_px);
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < labels.values.size(); ++i) {
    const std::uint32_t label = labels.values[i];
    if (label == kNone || area[label] < area_min_px) continue;
    if (fresh[label] == 0) {
      fresh[label] = ++next;
      if (areas_px != nullptr) areas_px->push_back(area[label]);
    }
    result.values[i] = fresh[label];
  }
  return result;
}

}  // namespace colony
