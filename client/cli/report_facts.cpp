#include "client/cli/report_facts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "client/cli/report.hpp"

namespace colony::client {
namespace {

struct Title {
  const char* member;
  const char* title;
};

/// Where the name without its unit and underscores is no title.
constexpr Title kTitles[] = {
    {"at_frame", "cut by the frame"},
    {"apart_area_cv", "variation of their area"},
    {"apart_circularity_sd", "sd of their circularity"},
    {"apart_count", "number"},
    {"area_mean_px", "mean area"},
    {"area_mean_um2", "mean area"},
    {"area_median_px", "median area"},
    {"area_min_px", "smallest object kept"},
    {"between_share", "share of the variance between the classes"},
    {"bic", "BIC"},
    {"chi_square", "chi-square"},
    {"covered_px", "covered area"},
    {"created_at", "created"},
    {"degrees", "degrees of freedom"},
    {"density_per_mm2", "objects per mm2"},
    {"difference_max", "largest difference from Gibson's share"},
    {"excess_perimeter", "perimeter beyond that of the hull, share"},
    {"field_px", "field looked at"},
    {"finished_at", "finished"},
    {"foreground_px", "foreground"},
    {"foreground_um2", "foreground"},
    {"hole_count", "holes"},
    {"hole_max_px", "largest hole given away"},
    {"hole_px", "area of the holes"},
    {"image_bytes", "bytes of the picture"},
    {"interior_count", "interior cells"},
    {"measured_count", "cells measured"},
    {"most_pressed_cell_id", "most pressed cell, id"},
    {"object_count", "objects"},
    {"open_share", "open share of the hull"},
    {"other_area_cv", "variation of the others' area"},
    {"other_circularity_sd", "sd of the others' circularity"},
    {"other_count", "others"},
    {"p_value", "p"},
    {"partly_hidden_count", "cells seen by less than half, not measured"},
    {"piece_count", "pieces"},
    {"radius_mean_px", "mean radius"},
    {"radius_rms_px", "deviation from the mean radius (rms)"},
    {"relative_sd", "relative sd about the fit"},
    {"retained_5_percent", "retained share of a cell's volume, 5 % quantile"},
    {"retained_mean", "retained share of a cell's volume, mean"},
    {"retained_min", "retained share of a cell's volume, least"},
    {"retained_sd", "retained share of a cell's volume, sd"},
    {"se", "standard error"},
    {"sides_mean", "sides on average"},
    {"um_per_px", "um a pixel"},
    {"um_per_px_source", "scale from"},
    {"um_per_px_stated", "um a pixel, as the file says"},
    {"union_um3", "volume of all bodies together"},
    {"void_share", "void share of that volume"},
    {"void_um3", "void volume"},
};

bool ends_with(const std::string& text, std::string_view end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Pixels of an area, not of a length.
bool is_area(const std::string& member) {
  return member.find("area") != std::string::npos || member == "covered_px" || member == "hole_px" || member == "hole_max_px" ||
         member == "foreground_px" || member == "field_px";
}

/// The unit that ends a member's name, without its underscore.
std::string unit_of(const std::string& member) {
  for (const char* unit : {"um_per_h", "um3", "um2", "um", "px", "h"}) {
    if (ends_with(member, std::string("_") + unit)) return unit == std::string_view("um_per_h") ? "um/h" : unit;
  }
  return {};
}

}  // namespace

std::string rounded(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  if (size >= 1000.0 || size == 0.0) return fixed(value, 0);
  if (size >= 1.0) {
    // As many decimals as four digits leave, without zeros that say nothing.
    std::string text = fixed(value, size >= 100.0 ? 1 : size >= 10.0 ? 2 : 3);
    while (text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
    return text;
  }
  char text[40];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string counted_text(std::uint64_t count, const std::string& singular, const std::string& plural) {
  return std::to_string(count) + " " + (count == 1 ? singular : plural);
}

KindNames kind_names(const std::string& kind) {
  if (kind == "cells") return {"cell", "cells", "cell walls", "colony outline"};
  if (kind == "nuclei") return {"nucleus", "nuclei", "outlines of the nuclei", "outer outline"};
  if (kind == "regions") return {"region", "regions", "outlines of the regions", "outer outline"};
  return {"object", "objects", "outlines of the objects", "outer outline"};
}

std::string finding_text(const std::string& finding) {
  if (finding == "scaling") return "consistent with scaling";
  if (finding == "crossover") return "a crossover, not scaling";
  if (finding == "short_range") return "too small a range for a finding";
  if (finding == "wandering") return "no clear scaling";
  if (finding == "too_few") return "too few objects for a finding";
  return {};
}

std::string table_row(const std::string& title, const std::string& value) {
  return "<tr><th>" + html_text(title) + "</th><td>" + html_text(value) + "</td></tr>";
}

std::string with_unit(const std::string& member, const Json& value, std::optional<double> um_per_px) {
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (!value.is_number()) return cell_text(value);
  if (member == "um_per_px" || member == "um_per_px_stated") return rounded(value.get<double>());
  const std::string unit = unit_of(member);
  const bool is_whole = value.is_number_integer();
  if (unit != "px" || !um_per_px) {
    const std::string number = is_whole ? value.dump() : rounded(value.get<double>());
    return unit.empty() ? number : number + " " + unit;
  }
  const double scale = is_area(member) ? *um_per_px * *um_per_px : *um_per_px;
  return rounded(value.get<double>() * scale) + (is_area(member) ? " um2" : " um");
}

std::string title_of(const std::string& member) {
  const auto* const known = std::find_if(std::begin(kTitles), std::end(kTitles), [&](const Title& title) { return member == title.member; });
  if (known != std::end(kTitles)) return known->title;
  std::string text = member;
  for (const char* unit : {"_um_per_h", "_um3", "_um2", "_um", "_px", "_h"}) {
    if (!ends_with(text, unit)) continue;
    text.resize(text.size() - std::string_view(unit).size());
    break;
  }
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

void add_facts(const Json& value, const std::string& title, std::optional<double> um_per_px, std::string& rows) {
  for (const auto& [member, of] : value.items()) {
    const std::string name = title_of(member), full = title.empty() ? name : title + ": " + name;
    if (of.is_null() || (of.is_array() && of.empty())) continue;
    // In um already, under the name with that unit.
    if (um_per_px && ends_with(member, "_px")) {
      const std::string stem = member.substr(0, member.size() - 3);
      if (value.contains(stem + "_um") || value.contains(stem + "_um2")) continue;
    }
    if (of.is_object()) {
      add_facts(of, full, um_per_px, rows);
    } else if (of.is_array()) {
      std::string list;
      for (const Json& item : of) list += (list.empty() ? "" : "; ") + with_unit(member, item, um_per_px);
      rows += table_row(full, list);
    } else {
      rows += table_row(full, with_unit(member, of, um_per_px));
    }
  }
}

}  // namespace colony::client
