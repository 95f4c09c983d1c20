// founders: from a colony-tracking table (one row for each colony and time, positions in pixels) to the founders of a
// job. Method:  the rows of one time; px to um; origin at the centre; y up (image rows run down). One cell for each
// colony. Units:   um out; px in, um_per_px between them. Positions are rounded to 0.001 um. Errors:  Failure kUsage
// with `file:line:` where a line is to blame; nothing is skipped but what min_distance_um drops, and
//          that is in the report.
// Threads: pure.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/csv.hpp"
#include "client/cli/text.hpp"

namespace colony::client {

struct FounderOptions {
  std::string time_column, x_column, y_column, track_column;  // empty: found by its usual names
  bool without_time = false;                                  // the whole table is one moment
  std::optional<double> time;                                 // none: the earliest
  double um_per_px = 1.0;
  std::optional<std::pair<double, double>>
      field_px;                  // none: the centre is the mean position; else the middle of this image
  bool y_up = false;             // the table's y already runs up
  double min_distance_um = 0.0;  // 0: off
  std::optional<double> dish_radius_um;
};

struct Founder {
  double x_um = 0.0, y_um = 0.0;
  std::size_t line = 0;  // in the table
  std::string track;     // empty without a track column
};

struct DroppedFounder {
  Founder founder;
  Founder near;  // the kept one, earlier in the table
  double distance_um = 0.0;
};

struct Founders {
  std::vector<Founder> kept;  // in the table's order
  std::vector<DroppedFounder> dropped;
  std::string time_column, x_column, y_column, track_column;
  std::optional<double> time;
  std::size_t other_row_count = 0;  // rows of other times
  double centre_x_px = 0.0, centre_y_px = 0.0;
};

struct ClosestPair {
  std::size_t first = 0, second = 0;  // indices, first < second
  double distance_um = 0.0;
};

inline constexpr std::size_t kFoundersMax = 100'000;  // the server's limit, told before anything is sent

Founders select_founders(const CsvTable& table, const FounderOptions& options);

/// By a sweep over x, O(n log n); nullopt for fewer than two. Ties go to the lower indices found first.
std::optional<ClosestPair> closest_pair(const std::vector<Founder>& founders);

/// What a person should know before growing them; ends with a newline.
std::string founders_report(const Founders& founders, const FounderOptions& options);

}  // namespace colony::client
