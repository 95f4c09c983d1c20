#include "engine/picture/colour.hpp"

#include <algorithm>
#include <array>

#include "engine/base/check.hpp"

namespace colony {
namespace {

// Lightness rises about evenly from point to point; the first is still clearly lighter than the background.
constexpr std::array<Rgb, 6> kMap = {
    Rgb{0x54, 0x2a, 0x7e}, Rgb{0x4a, 0x56, 0x9e}, Rgb{0x30, 0x80, 0xa0},
    Rgb{0x3a, 0xa8, 0x8a}, Rgb{0x96, 0xcc, 0x56}, Rgb{0xf8, 0xe6, 0x4c},
};

double value_of(const Cell& cell, ColourBy colour_by, double time_h) {
  switch (colour_by) {
    case ColourBy::kGeneration:
      return static_cast<double>(cell.generation);
    case ColourBy::kAge:
      return time_h - cell.born_h;
    case ColourBy::kVolume:
      return cell.volume_um3;
    case ColourBy::kActivity:
      break;
  }
  CHECK(false);
  return 0.0;
}

/// A value >= 0 with one decimal, rounded.
std::string with_tenth(double value) {
  const std::int64_t tenths = floor_to_int(value * 10.0 + 0.5);
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10);
}

ColourScale scale_of(ColourBy colour_by, double low, double high) {
  const auto whole = [](double value) { return std::to_string(floor_to_int(value + 0.5)); };
  switch (colour_by) {
    case ColourBy::kGeneration:
      return {"generation", whole(low), whole(high)};
    case ColourBy::kAge:
      return {"age", with_tenth(low) + " h", with_tenth(high) + " h"};
    case ColourBy::kVolume:
      return {"volume", whole(low) + " µm³", whole(high) + " µm³"};
    case ColourBy::kActivity:
      break;
  }
  return {};
}

}  // namespace

Rgb activity_colour(Activity activity) {
  switch (activity) {
    case Activity::kActive:
      return kActiveColour;
    case Activity::kPassive:
      return kPassiveColour;
    case Activity::kSenescent:
      return kSenescentColour;
  }
  CHECK(false);
  return {};
}

Rgb map_colour(double share) {
  const double position = std::clamp(share, 0.0, 1.0) * static_cast<double>(kMap.size() - 1);
  const std::size_t index = std::min(static_cast<std::size_t>(position), kMap.size() - 2);
  return blend(kMap[index], kMap[index + 1], position - static_cast<double>(index));
}

CellColours colour_cells(const Colony& colony, ColourBy colour_by) {
  CellColours colours;
  colours.of_cell.reserve(colony.cells().size());
  if (colour_by == ColourBy::kActivity) {
    for (const Cell& cell : colony.cells()) colours.of_cell.push_back(activity_colour(cell.activity));
    return colours;
  }
  if (colony.cells().empty()) return colours;
  const auto value = [&](const Cell& cell) { return value_of(cell, colour_by, colony.time_h()); };
  double low = colour_by == ColourBy::kVolume ? value(colony.cells().front()) : 0.0;
  double high = value(colony.cells().front());
  for (const Cell& cell : colony.cells()) {
    low = std::min(low, value(cell));
    high = std::max(high, value(cell));
  }
  for (const Cell& cell : colony.cells()) {
    colours.of_cell.push_back(map_colour(high > low ? (value(cell) - low) / (high - low) : 0.0));
  }
  colours.scale = scale_of(colour_by, low, high);
  return colours;
}

}  // namespace colony
