#include "engine/analysis/packing.hpp"

#include <algorithm>
#include <cmath>

#include "engine/analysis/parallel.hpp"
#include "engine/random/stream.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

Error wrong(const std::string& field, const std::string& message) {
  return {ErrorCode::kInvalid, field + ": " + message, {{field, message}}};
}

struct CellShare {
  double union_um3 = 0.0, void_um3 = 0.0;
  double retained = 1.0;  // of a body without hits
};

CellShare measure(const Colony& colony, CellId id, ContactRule rule, const PointSet& points, std::size_t count) {
  const Body& body = colony.body(id);
  const Box box = body.box();
  std::vector<CellId> ids;
  colony.cells_meeting(box, ids);
  CellShare share;
  std::size_t hits = 0, kept = 0;
  double in_union = 0.0, in_void = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 point = placed_um(box, points, i);
    if (!body.contains(point)) continue;
    ++hits;
    const double own = body.field(point);
    // Those of all bodies that hold the point, this one included, in id order.
    double sum = 0.0, largest = own;
    int holders = 0;
    for (const CellId other : ids) {
      if (other != id && !colony.body(other).contains(point)) continue;
      const double f = other == id ? own : colony.body(other).field(point);
      sum += std::max(0.0, f);
      largest = std::max(largest, f);
      ++holders;
    }
    const double weight = 1.0 / holders;
    in_union += weight;
    if (rule == ContactRule::kSum) {
      if (largest < sum - largest) in_void += weight;
      if (own >= sum - own) ++kept;
    } else if (own >= largest) {
      ++kept;
    }
  }
  const double um3_per_point = box.volume() / static_cast<double>(count);
  share.union_um3 = in_union * um3_per_point;
  share.void_um3 = in_void * um3_per_point;
  if (hits > 0) share.retained = static_cast<double>(kept) / static_cast<double>(hits);
  return share;
}

}  // namespace

Result<PackingStatistics> packing_statistics(const Colony& colony, ContactRule rule, Seed seed, std::uint32_t points,
                                             int threads, StopFlag stop) {
  if (points < 64 || points > 65'536 || (points & (points - 1)) != 0) {
    return wrong("points", "must be a power of two in 64..65536");
  }
  if (colony.cells().size() == 0) return wrong("colony", "has no cells");
  const std::size_t n = colony.cells().size();
  std::vector<CellShare> shares(n);
  for_each_index(
      n, threads,
      [&](std::size_t i) {
        const CellId id{static_cast<std::uint32_t>(i + 1)};
        Stream stream(seed, id, 0, Purpose::kControl, 1);
        const PointSet set = scrambled_sobol(points, stream);
        shares[i] = measure(colony, id, rule, set, points);
      },
      stop);
  PackingStatistics result;
  const auto count = static_cast<double>(n);
  result.retained_min = 2.0;
  std::vector<double> retained;
  for (std::size_t i = 0; i < n; ++i) {
    result.union_um3 += shares[i].union_um3;
    result.void_um3 += shares[i].void_um3;
    result.retained_mean += shares[i].retained / count;
    retained.push_back(shares[i].retained);
    if (shares[i].retained < result.retained_min) {
      result.retained_min = shares[i].retained;
      result.most_pressed = CellId{static_cast<std::uint32_t>(i + 1)};
    }
  }
  if (result.union_um3 > 0.0) result.void_share = result.void_um3 / result.union_um3;
  double squares = 0.0;
  for (const double value : retained) squares += (value - result.retained_mean) * (value - result.retained_mean);
  if (n > 1) result.retained_sd = std::sqrt(squares / (count - 1.0));
  std::sort(retained.begin(), retained.end());
  result.retained_5_percent = retained[n / 20];
  return result;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> sibling_pairs(const Colony& colony) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Cell& cell : colony.cells()) {
    if (!cell.parent_id) continue;
    // One of the two keeps the parent's id; both are born at the division, and a later one of either gives it another time.
    const Cell& other = colony.cell(*cell.parent_id);
    if (other.born_h == cell.born_h) pairs.emplace_back(other.id.value, cell.id.value);
  }
  return pairs;
}

std::vector<std::uint32_t> active_labels(const Colony& colony) {
  std::vector<std::uint32_t> labels;
  for (const Cell& cell : colony.cells()) {
    if (cell.activity == Activity::kActive) labels.push_back(cell.id.value);
  }
  return labels;
}

}  // namespace colony
