#include "client/cli/report.hpp"

#include <optional>

#include "client/cli/report_facts.hpp"

namespace colony::client {
namespace {

constexpr std::string_view kStyle =
    "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left}"
    "td.n{text-align:right}figure{display:inline-block;margin:.5em 1em .5em 0}img{max-width:26em;border:1px solid #ccc}"
    "svg{border:1px solid #ccc;max-width:100%}code{word-break:break-all}";

std::string number(double value, int decimals = 2) { return fixed(value, decimals); }

/// The leaves of a spec as rows "a.b.c | value": the names that --set takes. What is null is not set, and has no row.
void add_leaves(const Json& value, const std::string& path, std::string& out) {
  if (value.is_object() && !value.empty()) {
    for (const auto& [name, member] : value.items()) add_leaves(member, path.empty() ? name : path + "." + name, out);
    return;
  }
  if (!value.is_null()) out += table_row(path, value.is_string() ? value.get<std::string>() : value.dump());
}

std::optional<double> scale_of(const Json& object) {
  const auto at = object.find("um_per_px");
  return at != object.end() && at->is_number() ? std::optional(at->get<double>()) : std::nullopt;
}

std::string number_cell(const std::string& text) { return "<td class=n>" + html_text(text) + "</td>"; }
std::string number_cell(const Json& value) { return number_cell(value.is_number_float() ? rounded(value.get<double>()) : cell_text(value)); }

Curve curve_of(const Json& line, const char* name, const char* colour) {
  Curve curve{name, colour, {}};
  for (const Json& point : line.at("curve")) {
    curve.points.emplace_back(point.at("side_px").get<double>(), point.at("count_mean").get<double>());
  }
  return curve;
}

std::string dimension_row(const std::string& name, const Json& line) {
  const Json& d0 = line.at("d0");
  if (d0.is_null()) {
    return "<tr><th>" + html_text(name) + "</th><td colspan=7>" +
           html_text(line.at("reason").is_string() ? line.at("reason").get<std::string>() : "-") + "</td></tr>";
  }
  const auto value_of = [&](const char* member) { return "<td class=n>" + number(line.at(member).at("value").get<double>(), 3) + "</td>"; };
  return "<tr><th>" + html_text(name) + "</th><td class=n>" + number(d0.at("value").get<double>(), 3) + "</td><td class=n>" +
         number(d0.at("se").get<double>(), 3) + "</td><td class=n>" + number(d0.at("r2").get<double>(), 4) + "</td>" +
         value_of("d0_smallest_cover") + value_of("d1") + "<td>" +
         d0.at("range_px")[0].dump() + " to " + d0.at("range_px")[1].dump() + " px</td><td>" +
         html_text(finding_text(line.value("finding", ""))) + "</td></tr>";
}

std::string fractal_section(const Json& analysis, const KindNames& names) {
  const Json& fractal = analysis.at("fractal");
  std::vector<Curve> curves = {curve_of(fractal.at("walls"), names.walls.c_str(), "#000"),
                               curve_of(fractal.at("outline"), names.outline.c_str(), "#1f77b4")};
  std::string rows = dimension_row(names.walls, fractal.at("walls")) + dimension_row(names.outline, fractal.at("outline"));
  const char* const colours[] = {"#2ca02c", "#d62728", "#ff7f0e", "#9467bd"};
  std::size_t index = 0;
  for (const Json& control : analysis.at("controls")) {
    const std::string name = control.at("name").get<std::string>();
    const std::string words = title_of(name);
    curves.push_back(curve_of(control.at("walls"), "", colours[index++ % 4]));
    curves.back().name = "control " + words;
    rows += dimension_row("control " + words + ", " + names.walls, control.at("walls"));
    rows += dimension_row("control " + words + ", " + names.outline, control.at("outline"));
  }
  std::string out = "<h2>Box counting</h2><ul>";
  for (const Json& sentence : analysis.at("verdict")) out += "<li>" + html_text(sentence.get<std::string>()) + "</li>";
  out += "</ul>" + curves_svg(curves, "side of a box, px", "boxes met", true);
  return out + "<table><tr><th>line</th><th>D0</th><th>se of the line</th><th>r2</th><th>D0 of the smallest cover</th><th>D1</th><th>boxes</th><th>finding</th></tr>" + rows +
         "</table>";
}

/// Sides as seen and with small holes given away, beside Gibson's table.
std::string sides_section(const Json& neighbours, std::optional<double> um_per_px) {
  const Json& given = neighbours.at("holes_given");
  std::string out = "<h2>Neighbours of interior cells</h2><table><tr><th>sides</th><th>cells, as seen</th><th>share</th>"
                    "<th>cells, small holes given away</th><th>share</th><th>Gibson 2006</th></tr>";
  const auto cell = [](const std::string& text) { return "<td class=n>" + text + "</td>"; };
  for (std::size_t i = 0; i < neighbours.at("classes").size(); ++i) {
    const Json &seen = neighbours.at("classes")[i], &closed = given.at("classes").at(i);
    out += "<tr>" + cell(seen.at("sides").dump());
    for (const Json* row : {&seen, &closed}) out += cell(row->at("count").dump()) + cell(number(row->at("share").get<double>(), 3));
    out += cell(number(seen.at("gibson_share").get<double>(), 3)) + "</tr>";
  }
  std::string rows;
  if (neighbours.at("not_judged").is_string()) rows += table_row("not held against Gibson's table", neighbours.at("not_judged").get<std::string>());
  Json open = neighbours, closed = given;
  for (const char* member : {"classes", "holes_given", "not_judged"}) {
    open.erase(member);
    closed.erase(member);
  }
  add_facts(open, "as seen", um_per_px, rows);
  add_facts(closed, "small holes given away", um_per_px, rows);
  return out + "</table><table>" + rows + "</table>";
}

/// Members of each ring: lengths and areas in um where the scale is known.
std::string ring_section(const Json& rings, std::optional<double> um_per_px) {
  const std::string length = um_per_px ? "um" : "px", area = um_per_px ? "um2" : "px";
  const double scale = um_per_px.value_or(1.0);
  const struct {
    const char* member;
    std::string title;
    double factor;
  } kColumns[] = {{"inner_px", "from, " + length, scale},
                  {"outer_px", "to, " + length, scale},
                  {"cell_count", "cells seen", 1.0},
                  {"covered_px", "covered, " + area, scale * scale},
                  {"area_mean_px", "mean area, " + area, scale * scale},
                  {"area_se_px", "its standard error", scale * scale},
                  {"density_per_px", "cells per " + area, 1.0 / (scale * scale)},
                  {"active_share", "share of active cells", 1.0}};
  std::string out = "<h2>From the middle to the rim</h2><table><tr>";
  for (const auto& column : kColumns) out += "<th>" + html_text(column.title) + "</th>";
  out += "</tr>";
  for (const Json& ring : rings) {
    out += "<tr>";
    for (const auto& column : kColumns) {
      const Json& value = ring.at(column.member);
      out += value.is_number() ? number_cell(rounded(value.get<double>() * column.factor)) : number_cell(value);
    }
    out += "</tr>";
  }
  return out + "</table><p>Rings end at the farthest centre of a cell: the outer halves of the outermost cells are in none.</p>";
}

/// Mean, spread and range of the shapes of the cells that were measured.
std::string cell_section(const Json& cells, std::optional<double> um_per_px) {
  std::string rows, counts;
  for (const auto& [member, spread] : cells.items()) {
    if (spread.is_number()) counts += table_row(title_of(member), spread.dump());
    if (!spread.is_object()) continue;
    rows += "<tr><th>" + html_text(title_of(member)) + "</th>";
    for (const char* name : {"mean", "sd", "min", "max"}) rows += number_cell(with_unit(member, spread.at(name), um_per_px));
    rows += "</tr>";
  }
  return "<h2>Shapes of the cells</h2><table>" + counts + "</table><table><tr><th>of a cell</th><th>mean</th><th>sd</th><th>least</th><th>most</th></tr>" + rows +
         "</table>";
}

/// A row a phase that was found, its value with the 95 % interval.
std::string phase_section(const Json& growth) {
  if (growth.contains("reason") && growth.at("reason").is_string()) return "<h2>Phases of growth</h2><p>" + html_text(growth.at("reason").get<std::string>()) + "</p>";
  std::string phases, rest;
  for (const auto& [name, phase] : growth.items()) {
    if (!phase.is_object()) continue;
    for (const char* value : {"cell_count", "doubling_time_h", "speed_um_per_h"}) {
      if (!phase.contains(value)) continue;
      phases += "<tr><th>" + html_text(title_of(name)) + "</th><td>" + with_unit("from_h", phase.at("from_h"), {}) + " to " + with_unit("to_h", phase.at("to_h"), {}) +
                "</td><td>" + html_text(title_of(value)) + " " + html_text(with_unit(value, phase.at(value), {})) + "</td><td>" +
                html_text(with_unit("low", phase.at("low"), {})) + (phase.at("high").is_null() ? " and more" : " to " + html_text(with_unit("high", phase.at("high"), {}))) +
                "</td>" + number_cell(phase.at("r2")) +
                "</tr>";
    }
  }
  Json others = Json::object();
  for (const auto& [name, value] : growth.items()) {
    if (value.is_number()) others[name] = value;
  }
  add_facts(others, "", {}, rest);
  return "<h2>Phases of growth</h2><table><tr><th>phase</th><th>time</th><th>value</th><th>interval</th><th>r2</th></tr>" + phases + "</table>" + (rest.empty() ? rest : "<table>" + rest + "</table>");
}

/// The dimensions against the threshold: a curve each and the table.
std::string sweep_section(const Json& sweep, const KindNames& names) {
  Curve walls{names.walls, "#000", {}}, outline{names.outline, "#1f77b4", {}};
  std::string range;
  std::string rows;
  for (const Json& row : sweep.at("rows")) {
    const double threshold = row.at("threshold").get<double>();
    rows += "<tr><td class=n>" + row.at("threshold").dump() + "</td>";
    for (const auto& [name, curve] : {std::pair("walls", &walls), std::pair("outline", &outline)}) {
      const Json& d0 = row.at(name).at("d0");
      if (d0.is_null()) {
        rows += "<td colspan=3>" + html_text(row.at(name).at("reason").get<std::string>()) + "</td>";
        continue;
      }
      curve->points.emplace_back(threshold, d0.at("value").get<double>());
      range = "boxes of " + d0.at("range_px")[0].dump() + " to " + d0.at("range_px")[1].dump() + " px";
      rows += "<td class=n>" + number(d0.at("value").get<double>(), 3) + "</td><td class=n>" + number(d0.at("se").get<double>(), 3) +
              "</td><td>" + html_text(finding_text(row.at(name).value("finding", ""))) + "</td>";
    }
    rows += "</tr>";
  }
  const auto head = [](const std::string& name) { return "<th>" + html_text(name) + ": D0</th><th>standard error</th><th>finding</th>"; };
  return "<h2>Against the threshold</h2>" + curves_svg({walls, outline}, "threshold, grey level", "D0" + (range.empty() ? range : ", " + range), false) +
         "<p>All rows are counted with the same " + (range.empty() ? "boxes" : range) + " in one grid from the frame's corner; the answer's own grid begins at what is "
         "counted, so that at its threshold the two differ by a few hundredths.</p><table><tr><th>threshold</th>" + head(names.walls) + head(names.outline) + "</tr>" +
         rows + "</table>";
}

std::string figures(const std::vector<std::pair<std::string, std::string>>& pictures) {
  std::string out;
  for (const auto& [caption, png] : pictures) {
    out += "<figure><img alt=\"" + html_text(caption) + "\" src=\"data:image/png;base64," + base64(png) + "\"><figcaption>" +
           html_text(caption) + "</figcaption></figure>";
  }
  return out;
}

std::string page_head(const std::string& title) {
  return "<!doctype html><html lang=en><head><meta charset=utf-8><title>" + html_text(title) + "</title><style>" + std::string(kStyle) +
         "</style></head><body><h1>" + html_text(title) + "</h1>";
}

std::string shape_section(const Json& analysis) {
  const std::optional<double> um_per_px = scale_of(analysis);
  std::string rows;
  for (const auto& [member, title] : {std::pair("colony", "colony"), std::pair("apart", "cells without a neighbour"), std::pair("packing", "packing"),
                                      std::pair("sibling_straightness", "straightness of borders")}) {
    if (analysis.at(member).is_object()) add_facts(analysis.at(member), title, um_per_px, rows);
  }
  return cell_section(analysis.at("cells"), um_per_px) + "<h2>The colony as a whole</h2><table>" + rows + "</table>" + phase_section(analysis.at("growth")) +
         sides_section(analysis.at("neighbours"), um_per_px) + ring_section(analysis.at("rings"), um_per_px);
}

/// What pictures and measurements are of.
std::string moment_section(const Json& analysis) {
  const std::optional<double> um_per_px = scale_of(analysis);
  const std::string time = number(analysis.at("time_h").get<double>(), 1) + " h";
  std::string out = "<h2>The colony at " + time + "</h2><table>" + table_row("time", time) + table_row("last event", member_text(analysis, "last_seq")) +
                    table_row("cells", member_text(analysis, "cell_count")) + table_row("cells seen from above", member_text(analysis, "visible_cell_count"));
  if (um_per_px) out += table_row("scale of the measured picture", rounded(*um_per_px) + " um a pixel");
  out += table_row("diameter of a disc of the mean area seen", with_unit("diameter_px", analysis.at("px_per_cell_diameter"), um_per_px));
  return out + "<tr><th>digest</th><td><code>" + html_text(analysis.at("digest").get<std::string>()) + "</code></td></tr></table>" +
         "<p>All pictures and measurements below are of this moment.</p>";
}

std::string growth_section(const Json& series) {
  Curve cells{"cells", "#000", {}}, active{"active", "#2ca02c", {}}, radius{"radius, um", "#1f77b4", {}};
  for (const Json& row : series) {
    const double time_h = row.at("time_h").get<double>();
    cells.points.emplace_back(time_h, row.at("cell_count").get<double>());
    active.points.emplace_back(time_h, row.at("active_count").get<double>());
    radius.points.emplace_back(time_h, row.at("radius_um").get<double>());
  }
  return "<h2>Growth</h2>" + curves_svg({cells, active}, "time, h", "cells", false) +
         curves_svg({radius}, "time, h", "radius of the colony, um", false);
}

}  // namespace

std::string html_text(std::string_view text) {
  std::string out;
  for (const char c : printable(text)) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t at) { return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0U; };
    const unsigned group = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    for (int digit = 0; digit < 4; ++digit) {
      const bool is_there = i + static_cast<std::size_t>(digit) <= bytes.size();
      out += is_there ? kDigits[group >> (18 - 6 * digit) & 63] : '=';
    }
  }
  return out;
}

std::string report_html(const ReportInput& input) {
  const Json& job = input.job;
  const std::string name = job.at("name").get<std::string>();
  const std::string title = name.empty() ? "Colony " + job.at("id").get<std::string>() : name;
  std::string out = page_head(title) + "<table>";
  for (const char* member : {"id", "state", "reason", "created_at", "finished_at", "engine_version"}) {
    if (!job.at(member).is_null()) out += table_row(title_of(member), cell_text(job.at(member)));
  }
  // The job's own last state, which is not what a report of an earlier time shows.
  out += table_row("latest time", number(job.at("progress").at("time_h").get<double>(), 1) + " h");
  for (const char* member : {"cells", "active", "passive", "senescent"}) {
    out += table_row(std::string("latest ") + member, member_text(job.at("progress"), member));
  }
  out += table_row("latest event", member_text(job, "last_seq"));
  out += "<tr><th>latest digest</th><td><code>" + html_text(job.at("digest").get<std::string>()) + "</code></td></tr></table>";
  if (!input.analysis.is_null()) out += moment_section(input.analysis);
  out += "<h2>Pictures</h2>" + figures(input.pictures);
  out += growth_section(input.series);
  if (!input.analysis.is_null()) out += fractal_section(input.analysis, kind_names("cells")) + shape_section(input.analysis);
  std::string rows;
  add_leaves(job.at("spec"), "", rows);
  return out + "<h2>Parameters</h2><table>" + rows + "</table></body></html>\n";
}

std::string analysis_html(const AnalysisPageInput& input) {
  const Json& analysis = input.analysis;
  const Json& result = analysis.at("result");
  const std::string name = analysis.at("name").get<std::string>();
  const KindNames names = kind_names(result.value("object_kind", ""));
  std::string rows;
  for (const char* member : {"id", "created_at", "media_type", "image_bytes"}) rows += table_row(title_of(member), cell_text(analysis.at(member)));
  const std::optional<double> um_per_px = scale_of(result.at("image"));
  add_facts(result.at("image"), "picture", um_per_px, rows);
  Json segmentation = result.at("segmentation");
  segmentation.erase("sweep");
  add_facts(segmentation, "segmentation", um_per_px, rows);
  return page_head(name.empty() ? "Analysis " + analysis.at("id").get<std::string>() : name) + figures(input.pictures) +
         fractal_section(result, names) + sweep_section(result.at("threshold_sweep"), names) + "<h2>What was done</h2><table>" + rows +
         "</table></body></html>\n";
}

}  // namespace colony::client
