// neighbours: which cells of a label image share a border, how many neighbours interior cells have, how straight the borders are.
// Method:  a border between a and b is the set of pixel edges between them; with gap_px > 0 also of places where no more than that much
//          background parts them along a row or column. Cells are neighbours from kBorderEdgesMin edges on: corners do not count.
//          Interior cells touch neither the outside background nor the frame; holes do not matter.
// Straightness: principal axes of the border's points: root mean square deviation from the best line / length, where the
//          length is that of a straight segment with the same spread, sqrt(12 l1). Pixels alone give 0.2..0.4 px of deviation.
// Units:   pixels.
// Errors:  as cell_shapes; kInvalid for gap_px outside 0..8.
// Threads: pure. All sums are integers; pairs ascend.
// Source:  the table of sides: Gibson et al. 2006, stationary distribution of the proliferation model (a test solves it again).
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "engine/analysis/image.hpp"
#include "engine/base/stop.hpp"

namespace colony {

inline constexpr std::uint64_t kBorderEdgesMin = 2;
/// A border shorter than this says nothing about straightness.
inline constexpr double kStraightLengthMin_px = 8.0;

struct Border {
  std::uint32_t low = 0, high = 0;     // labels, low < high
  std::uint64_t edge_count = 0;
  double length_px = 0.0;
  double deviation_px = 0.0;           // root mean square, from the best line
};

struct CellContacts {
  std::uint32_t label = 0;
  std::uint32_t neighbour_count = 0;
  bool interior = false;
};

struct Contacts {
  std::vector<CellContacts> cells;     // by ascending label
  std::vector<Border> borders;         // by (low, high); those of kBorderEdgesMin edges and more
};

/// Throws Stopped.
Result<Contacts> find_contacts(const LabelImage& labels, std::int64_t gap_px = 0, StopFlag stop = nullptr);

inline constexpr std::uint32_t kSidesFirst = 4, kSidesLast = 9;
/// Shares of cells with 4..9 sides where cells divide and never move: mean 6.
inline constexpr std::array<double, 6> kGibsonShares{0.0, 0.28879, 0.46399, 0.20852, 0.03591, 0.00269};

struct SideStatistics {
  std::array<std::uint64_t, 6> counts{};  // interior cells with 4..9 neighbours
  std::uint64_t other_count = 0;          // interior cells with fewer or more, in no share
  std::array<double, 6> shares{};         // of the counted ones
  double sides_mean = 0.0;
  double difference_max = 0.0;            // largest |share - Gibson's|
  /// Classes 4-5, 6, 7, 8-9; 7-9 together while fewer than 5 cells are expected with 8-9. None below 20 cells.
  std::optional<double> chi_square = {};
  std::size_t degrees = 0;
  std::optional<double> p_value = {};
};

SideStatistics side_statistics(const Contacts& contacts);

struct StraightnessGroup {
  std::uint64_t count = 0;
  double mean = 0.0;                      // of deviation / length: 0 is a straight line
  double standard_error = 0.0;
};
struct SiblingStraightness {
  StraightnessGroup siblings, others;
  double difference = 0.0;                // others - siblings: above 0 where siblings have the straighter border
  double t = 0.0;                         // difference over its standard error (Welch); 0 where a group has fewer than 2
};

/// Borders of kStraightLengthMin_px and more; `siblings` are pairs of labels in any order.
SiblingStraightness sibling_straightness(const Contacts& contacts,
                                         const std::vector<std::pair<std::uint32_t, std::uint32_t>>& siblings);

}  // namespace colony
