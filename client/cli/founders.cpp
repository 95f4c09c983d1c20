#include "client/cli/founders.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>

#include "client/cli/failure.hpp"

namespace colony::client {
namespace {

[[noreturn]] void fail(const CsvTable& table, const std::string& message) {
  throw Failure(ExitCode::kUsage, printable(table.name) + ": " + message);
}

[[noreturn]] void fail_at(const CsvTable& table, std::size_t line, const std::string& message) {
  throw Failure(ExitCode::kUsage, printable(table.name) + ":" + std::to_string(line) + ": " + message);
}

std::string column_list(const CsvTable& table) {
  std::string out;
  for (const std::string& column : table.header) out += (out.empty() ? "'" : ", '") + printable(column) + "'";
  return out;
}

/// "time [h]" and "Time_h" style headers meet in their letters: lower case, no unit in brackets, letters and digits
/// only.
std::string plain_name(const std::string& column) {
  std::string out;
  for (const char c : column) {
    if (c == '[' || c == '(') break;
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

const std::vector<std::string> kTimeNames = {"time", "timeh", "t", "hours", "hour", "h", "timepoint", "frame", "slice"};
const std::vector<std::string> kXNames = {"x",         "xpx",       "posx", "positionx", "xposition", "centroidx",
                                          "xcentroid", "locationx", "cx",   "xm",        "xcoord",    "xcoordinate"};
const std::vector<std::string> kYNames = {"y",         "ypx",       "posy", "positiony", "yposition", "centroidy",
                                          "ycentroid", "locationy", "cy",   "ym",        "ycoord",    "ycoordinate"};
const std::vector<std::string> kTrackNames = {"track",    "trackid", "tracknumber", "colony",
                                              "colonyid", "object",  "objectid",    "objectnumber",
                                              "id",       "label",   "cell",        "cellid"};

/// The index of the column asked for, or of the one with a usual name; nullopt if none has.
std::optional<std::size_t> find_column(const CsvTable& table, const std::string& asked, const std::string& option,
                                       const std::vector<std::string>& usual) {
  if (!asked.empty()) {
    const auto found = std::find(table.header.begin(), table.header.end(), asked);
    if (found == table.header.end()) {
      fail(table, option + ": no column '" + printable(asked) + "'; the columns are " + column_list(table));
    }
    return static_cast<std::size_t>(found - table.header.begin());
  }
  for (const std::string& name : usual) {
    std::vector<std::size_t> matches;
    for (std::size_t c = 0; c < table.header.size(); ++c) {
      if (plain_name(table.header[c]) == name) matches.push_back(c);
    }
    if (matches.size() > 1) {
      fail(table, "'" + printable(table.header[matches[0]]) + "' and '" + printable(table.header[matches[1]]) +
                      "' could both be meant; choose with " + option);
    }
    if (matches.size() == 1) return matches[0];
  }
  return std::nullopt;
}

std::size_t need_column(const CsvTable& table, const std::string& asked, const std::string& option,
                        const std::vector<std::string>& usual) {
  const auto found = find_column(table, asked, option, usual);
  if (!found)
    fail(table, "no column looks like " + option.substr(2) + "; name it with " + option + "; the columns are " +
                    column_list(table));
  return *found;
}

double number_in(const CsvTable& table, const CsvRow& row, std::size_t column) {
  std::string_view text = row.fields[column];
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  const auto value = to_number(text);
  if (!value) {
    fail_at(table, row.line,
            "column '" + printable(table.header[column]) + "': '" + printable(row.fields[column]) +
                "' is not a finite number");
  }
  return *value;
}

std::vector<const CsvRow*> rows_of_time(const CsvTable& table, const FounderOptions& options, Founders& out) {
  std::vector<const CsvRow*> rows;
  if (options.without_time) {
    for (const CsvRow& row : table.rows) rows.push_back(&row);
    return rows;
  }
  const auto column = find_column(table, options.time_column, "--time-column", kTimeNames);
  if (!column) {
    fail(table,
         "no column looks like a time; name it with --time-column, or say --no-time if the table is of one moment; "
         "the columns are " +
             column_list(table));
  }
  out.time_column = table.header[*column];
  std::vector<double> times(table.rows.size());
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = number_in(table, table.rows[i], *column);
  const double wanted = options.time ? *options.time : *std::min_element(times.begin(), times.end());
  out.time = wanted;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i] == wanted) rows.push_back(&table.rows[i]);
  }
  if (rows.empty()) {
    const auto [low, high] = std::minmax_element(times.begin(), times.end());
    fail(table, "no row has " + printable(out.time_column) + " = " + Json(wanted).dump() + "; times run from " +
                    Json(*low).dump() + " to " + Json(*high).dump());
  }
  out.other_row_count = table.rows.size() - rows.size();
  return rows;
}

double distance_um(const Founder& a, const Founder& b) { return std::hypot(a.x_um - b.x_um, a.y_um - b.y_um); }

double rounded(double value_um) { return std::round(value_um * 1000.0) / 1000.0 + 0.0; }

/// Keeps a founder unless an earlier kept one is nearer than `limit`. A grid with that spacing: only nine squares to
/// look at.
void drop_crowded(Founders& founders, double limit_um) {
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::size_t>> grid;
  std::vector<Founder> kept;
  for (const Founder& founder : founders.kept) {
    const auto gx = static_cast<std::int64_t>(std::floor(founder.x_um / limit_um));
    const auto gy = static_cast<std::int64_t>(std::floor(founder.y_um / limit_um));
    std::optional<std::size_t> near;
    for (std::int64_t x = gx - 1; x <= gx + 1; ++x) {
      for (std::int64_t y = gy - 1; y <= gy + 1; ++y) {
        const auto found = grid.find({x, y});
        if (found == grid.end()) continue;
        for (const std::size_t other : found->second) {
          const double gap_um = distance_um(founder, kept[other]);
          if (gap_um < limit_um && (!near || gap_um < distance_um(founder, kept[*near]))) near = other;
        }
      }
    }
    if (near) {
      founders.dropped.push_back({founder, kept[*near], distance_um(founder, kept[*near])});
    } else {
      grid[{gx, gy}].push_back(kept.size());
      kept.push_back(founder);
    }
  }
  founders.kept = std::move(kept);
}

std::string lines_of(const Founder& a, const Founder& b) {
  return "lines " + std::to_string(a.line) + " and " + std::to_string(b.line);
}

void check_positions(const CsvTable& table, const Founders& founders, const FounderOptions& options) {
  std::map<std::pair<double, double>, std::size_t> seen;
  for (const Founder& founder : founders.kept) {
    const auto [at, is_new] = seen.emplace(std::pair{founder.x_um, founder.y_um}, founder.line);
    if (!is_new) {
      fail_at(table, founder.line,
              "the same position as in line " + std::to_string(at->second) +
                  " (--min-distance-um drops the later of two that are too close)");
    }
    const double radius_um = std::hypot(founder.x_um, founder.y_um);
    if (options.dish_radius_um && radius_um >= *options.dish_radius_um) {
      fail_at(table, founder.line,
              "the colony is " + fixed(radius_um, 1) + " um from the centre, outside --dish-radius-um " +
                  fixed(*options.dish_radius_um, 1));
    }
  }
}

}  // namespace

Founders select_founders(const CsvTable& table, const FounderOptions& options) {
  if (table.rows.empty()) fail(table, "the table has a header and no rows");
  Founders out;
  const std::vector<const CsvRow*> rows = rows_of_time(table, options, out);
  const std::size_t x = need_column(table, options.x_column, "--x-column", kXNames);
  const std::size_t y = need_column(table, options.y_column, "--y-column", kYNames);
  const auto track = find_column(table, options.track_column, "--track-column", kTrackNames);
  if (x == y) fail(table, "--x-column and --y-column name the same column");
  out.x_column = table.header[x];
  out.y_column = table.header[y];
  if (track) out.track_column = table.header[*track];
  if (rows.size() > kFoundersMax) {
    fail(table,
         std::to_string(rows.size()) + " colonies at that time; a job takes at most " + std::to_string(kFoundersMax));
  }

  std::map<std::string, std::size_t> line_of_track;
  for (const CsvRow* row : rows) {
    Founder founder;
    founder.line = row->line;
    founder.x_um = number_in(table, *row, x);  // px until the centre is known
    founder.y_um = number_in(table, *row, y);
    if (track) {
      founder.track = row->fields[*track];
      const auto [at, is_new] = line_of_track.emplace(founder.track, row->line);
      if (!is_new) {
        fail_at(table, row->line,
                "column '" + printable(out.track_column) + "': '" + printable(founder.track) +
                    "' stands for the same time in line " + std::to_string(at->second) + " already");
      }
    }
    out.kept.push_back(std::move(founder));
  }

  if (options.field_px) {
    out.centre_x_px = options.field_px->first / 2;
    out.centre_y_px = options.field_px->second / 2;
  } else {
    const auto count = static_cast<double>(out.kept.size());
    for (const Founder& founder : out.kept) {
      out.centre_x_px += founder.x_um / count;
      out.centre_y_px += founder.y_um / count;
    }
  }
  const double up = options.y_up ? 1.0 : -1.0;
  for (Founder& founder : out.kept) {
    founder.x_um = rounded((founder.x_um - out.centre_x_px) * options.um_per_px);
    founder.y_um = rounded((founder.y_um - out.centre_y_px) * options.um_per_px * up);
  }
  if (options.min_distance_um > 0) drop_crowded(out, options.min_distance_um);
  check_positions(table, out, options);
  return out;
}

std::optional<ClosestPair> closest_pair(const std::vector<Founder>& founders) {
  if (founders.size() < 2) return std::nullopt;
  std::vector<std::size_t> order(founders.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto before = [&](std::size_t a, std::size_t b) {
    return std::pair(founders[a].x_um, a) < std::pair(founders[b].x_um, b);
  };
  std::sort(order.begin(), order.end(), before);
  ClosestPair best{0, 1, distance_um(founders[0], founders[1])};
  // `strip` holds, by y, what lies within the best distance to the left: at most a handful near any y.
  std::set<std::pair<double, std::size_t>> strip;
  std::size_t left = 0;
  for (const std::size_t i : order) {
    for (; founders[order[left]].x_um < founders[i].x_um - best.distance_um; ++left) {
      strip.erase({founders[order[left]].y_um, order[left]});
    }
    for (auto at = strip.lower_bound({founders[i].y_um - best.distance_um, 0});
         at != strip.end() && at->first <= founders[i].y_um + best.distance_um; ++at) {
      const double gap_um = distance_um(founders[i], founders[at->second]);
      if (gap_um < best.distance_um) best = {std::min(i, at->second), std::max(i, at->second), gap_um};
    }
    strip.insert({founders[i].y_um, i});
  }
  return best;
}

std::string founders_report(const Founders& founders, const FounderOptions& options) {
  std::string out = std::to_string(founders.kept.size()) + " founders from columns '" + printable(founders.x_column) +
                    "', '" + printable(founders.y_column) + "'";
  if (!founders.track_column.empty()) out += ", one for each '" + printable(founders.track_column) + "'";
  if (founders.time) {
    out += ", at " + printable(founders.time_column) + " = " + Json(*founders.time).dump() + " (" +
           std::to_string(founders.other_row_count) + " rows of other times not used)";
  }
  out += "\n";
  double radius_um = 0.0;
  double low_x = 0, high_x = 0, low_y = 0, high_y = 0;
  for (std::size_t i = 0; i < founders.kept.size(); ++i) {
    const Founder& founder = founders.kept[i];
    radius_um = std::max(radius_um, std::hypot(founder.x_um, founder.y_um));
    low_x = i == 0 ? founder.x_um : std::min(low_x, founder.x_um);
    high_x = i == 0 ? founder.x_um : std::max(high_x, founder.x_um);
    low_y = i == 0 ? founder.y_um : std::min(low_y, founder.y_um);
    high_y = i == 0 ? founder.y_um : std::max(high_y, founder.y_um);
  }
  out += "scale " + Json(options.um_per_px).dump() + " um per px; origin at " +
         (options.field_px ? "the middle of the field" : "the mean position") + " (" + fixed(founders.centre_x_px, 1) +
         ", " + fixed(founders.centre_y_px, 1) + ") px; y " + (options.y_up ? "taken as it is" : "turned to run up") +
         "\n";
  out += "extent: x " + fixed(low_x, 0) + " to " + fixed(high_x, 0) + " um, y " + fixed(low_y, 0) + " to " +
         fixed(high_y, 0) + " um, farthest from the origin " + fixed(radius_um, 0) + " um; wall of the dish: " +
         (options.dish_radius_um ? fixed(*options.dish_radius_um, 0) + " um" : "as the preset has it") + "\n";
  if (const auto pair = closest_pair(founders.kept)) {
    out += "closest two: " + fixed(pair->distance_um, 1) + " um (" +
           lines_of(founders.kept[pair->first], founders.kept[pair->second]) + ")\n";
  }
  if (options.min_distance_um > 0) {
    for (const DroppedFounder& drop : founders.dropped) {
      out += "DROPPED line " + std::to_string(drop.founder.line) + ": " + fixed(drop.distance_um, 1) +
             " um from line " + std::to_string(drop.near.line) + "\n";
    }
    out += (founders.dropped.empty() ? "nothing dropped: none"
                                     : "DROPPED " + std::to_string(founders.dropped.size()) + " colonies that were") +
           " closer than " + fixed(options.min_distance_um, 1) + " um to an earlier one\n";
  }
  out +=
      "note: each colony of the table starts here as one cell; a tracked colony is several cells already "
      "(about 4-5 in the H3122 clonogenic data)\n";
  return out;
}

}  // namespace colony::client
