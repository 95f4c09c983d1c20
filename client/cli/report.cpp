#include "client/cli/report.hpp"

#include <algorithm>
#include <cmath>

namespace colony::client {
namespace {

constexpr double kWidth = 640, kHeight = 400, kLeft = 70, kBottom = 50, kTop = 15, kRight = 15;

constexpr std::string_view kStyle =
    "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left}"
    "td.n{text-align:right}figure{display:inline-block;margin:.5em 1em .5em 0}img{max-width:26em;border:1px solid #ccc}"
    "svg{border:1px solid #ccc;max-width:100%}code{word-break:break-all}";

std::string number(double value, int decimals = 2) { return fixed(value, decimals); }

/// 1, 2 or 5 times a power of ten, so that at most about six fit below `high`.
double tick_step(double high) {
  const double rough = std::max(high, 1e-300) / 6.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= rough) return factor * decade;
  }
  return 10.0 * decade;
}

struct Axis {
  double low = 0, high = 1;
  bool is_logarithmic = false;
  double share(double value) const {
    return is_logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  }
  std::vector<double> ticks() const {
    std::vector<double> out;
    if (is_logarithmic) {
      for (double at = low; at <= high * 1.0001; at *= 10.0) out.push_back(at);
    } else {
      const double step = tick_step(high);
      for (int i = 0; i * step <= high * 1.0001; ++i) out.push_back(i * step);
    }
    return out;
  }
};

Axis axis_of(const std::vector<Curve>& curves, bool is_x, bool is_logarithmic) {
  double least = 1e300, most = 0;
  for (const Curve& curve : curves) {
    for (const auto& [x, y] : curve.points) {
      least = std::min(least, is_x ? x : y);
      most = std::max(most, is_x ? x : y);
    }
  }
  if (!is_logarithmic) return {0, most > 0 ? most * 1.02 : 1, false};
  if (!(least > 0 && least < 1e300)) return {1, 10, true};
  const double low = std::pow(10.0, std::floor(std::log10(least)));
  return {low, std::max(most * 1.1, low * 10), true};
}

std::string table_row(const std::string& name, const std::string& value) {
  return "<tr><th>" + html_text(name) + "</th><td>" + html_text(value) + "</td></tr>";
}

/// Every leaf of an object as a row "a.b.c | value".
void add_leaves(const Json& value, const std::string& path, std::string& out) {
  if (value.is_object() && !value.empty()) {
    for (const auto& [name, member] : value.items()) add_leaves(member, path.empty() ? name : path + "." + name, out);
    return;
  }
  out += table_row(path, value.is_string() ? value.get<std::string>() : value.dump());
}

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
  const bool is_crossover = line.at("crossover").at("found").get<bool>();
  return "<tr><th>" + html_text(name) + "</th><td class=n>" + number(d0.at("value").get<double>(), 3) + "</td><td class=n>" +
         number(d0.at("se").get<double>(), 3) + "</td><td class=n>" + number(d0.at("r2").get<double>(), 4) + "</td>" +
         value_of("d0_smallest_cover") + value_of("d1") + "<td>" +
         d0.at("range_px")[0].dump() + " to " + d0.at("range_px")[1].dump() + " px</td><td>" +
         (is_crossover ? "crossover, not scaling" : "no drift found") + "</td></tr>";
}

std::string fractal_section(const Json& analysis) {
  const Json& fractal = analysis.at("fractal");
  std::vector<Curve> curves = {curve_of(fractal.at("walls"), "cell walls", "#000"),
                               curve_of(fractal.at("outline"), "colony outline", "#1f77b4")};
  std::string rows = dimension_row("cell walls", fractal.at("walls")) + dimension_row("colony outline", fractal.at("outline"));
  const char* const colours[] = {"#2ca02c", "#d62728", "#ff7f0e", "#9467bd"};
  std::size_t index = 0;
  for (const Json& control : analysis.at("controls")) {
    const std::string name = control.at("name").get<std::string>();
    curves.push_back(curve_of(control.at("walls"), "", colours[index++ % 4]));
    curves.back().name = "control " + name;
    rows += dimension_row("control " + name + ", walls", control.at("walls"));
    rows += dimension_row("control " + name + ", outline", control.at("outline"));
  }
  std::string out = "<h2>Box counting</h2><ul>";
  for (const Json& sentence : analysis.at("verdict")) out += "<li>" + html_text(sentence.get<std::string>()) + "</li>";
  out += "</ul>" + curves_svg(curves, "side of a box, px", "boxes met", true);
  return out + "<table><tr><th>line</th><th>D0</th><th>se of the line</th><th>r2</th><th>D0 of the smallest cover</th><th>D1</th><th>boxes</th><th>local slopes</th></tr>" + rows +
         "</table>";
}

/// Sides as seen and with small holes given away, beside Gibson's table.
std::string sides_section(const Json& neighbours) {
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
  for (const char* name : {"interior_count", "other_count", "sides_mean", "difference_max", "chi_square", "degrees", "p_value"}) {
    rows += table_row(std::string("as seen.") + name, neighbours.at(name).dump());
  }
  for (const char* name : {"hole_count", "hole_px", "hole_max_px", "other_count", "sides_mean", "difference_max", "chi_square", "degrees", "p_value"}) {
    rows += table_row(std::string("small holes given away.") + name, given.at(name).dump());
  }
  return out + "</table><table>" + rows + "</table>";
}

std::string ring_section(const Json& rings) {
  constexpr const char* kMembers[] = {"inner_px", "outer_px", "cell_count", "covered_px", "area_mean_px", "area_se_px", "density_per_px", "active_share"};
  std::string out = "<h2>From the middle to the rim</h2><table><tr>";
  for (const char* name : kMembers) out += "<th>" + std::string(name) + "</th>";
  out += "</tr>";
  for (const Json& ring : rings) {
    out += "<tr>";
    for (const char* name : kMembers) {
      const Json& value = ring.at(name);
      out += "<td class=n>" + (value.is_number_float() ? number(value.get<double>(), name == std::string_view("density_per_px") ? 6 : 2)
                                                       : html_text(cell_text(value))) + "</td>";
    }
    out += "</tr>";
  }
  return out + "</table><p>Rings end at the farthest centre of a cell: the outer halves of the outermost cells are in none.</p>";
}

/// The dimensions against the threshold: a curve each and the table.
std::string sweep_section(const Json& sweep) {
  Curve walls{"cell walls", "#000", {}}, outline{"colony outline", "#1f77b4", {}};
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
      rows += "<td class=n>" + number(d0.at("value").get<double>(), 3) + "</td><td class=n>" + number(d0.at("se").get<double>(), 3) +
              "</td><td>" + (row.at(name).at("crossover").get<bool>() ? "crossover" : "no drift found") + "</td>";
    }
    rows += "</tr>";
  }
  return "<h2>Against the threshold</h2>" + curves_svg({walls, outline}, "threshold, grey level", "D0", false) +
         "<table><tr><th>threshold</th><th>walls D0</th><th>se</th><th>local slopes</th><th>outline D0</th><th>se</th><th>local "
         "slopes</th></tr>" + rows + "</table>";
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
  std::string rows;
  for (const char* name : {"colony", "cells", "apart", "packing", "growth", "sibling_straightness"}) add_leaves(analysis.at(name), name, rows);
  return "<h2>Shapes, packing, growth</h2><table>" + rows + "</table>" + sides_section(analysis.at("neighbours")) +
         ring_section(analysis.at("rings"));
}

/// What pictures and measurements are of.
std::string moment_section(const Json& analysis) {
  std::string out = "<h2>The colony at " + html_text(analysis.at("time_h").dump()) + " h</h2><table>";
  for (const char* member : {"time_h", "last_seq", "cell_count", "um_per_px", "px_per_cell_diameter"}) {
    out += table_row(member, member_text(analysis, member, 4));
  }
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

std::string curves_svg(const std::vector<Curve>& curves, const std::string& x_title, const std::string& y_title,
                       bool is_logarithmic) {
  const Axis x = axis_of(curves, true, is_logarithmic), y = axis_of(curves, false, is_logarithmic);
  const auto place_x = [&](double value) { return kLeft + x.share(value) * (kWidth - kLeft - kRight); };
  const auto place_y = [&](double value) { return kHeight - kBottom - y.share(value) * (kHeight - kBottom - kTop); };
  std::string out = "<svg viewBox=\"0 0 " + number(kWidth, 0) + " " + number(kHeight, 0) + "\" width=\"" + number(kWidth, 0) +
                    "\" role=\"img\" font-family=\"sans-serif\" font-size=\"12\">";
  const auto text = [&](double at_x, double at_y, const char* anchor, const std::string& what, const std::string& colour) {
    out += "<text x=\"" + number(at_x, 1) + "\" y=\"" + number(at_y, 1) + "\" text-anchor=\"" + anchor + "\" fill=\"" + colour + "\">" +
           html_text(what) + "</text>";
  };
  const auto line = [&](double x1, double y1, double x2, double y2) {
    out += "<path d=\"M" + number(x1, 1) + " " + number(y1, 1) + "L" + number(x2, 1) + " " + number(y2, 1) + "\" stroke=\"#ddd\"/>";
  };
  for (const double tick : x.ticks()) {
    line(place_x(tick), kTop, place_x(tick), kHeight - kBottom);
    text(place_x(tick), kHeight - kBottom + 16, "middle", number(tick, tick < 1 && tick > 0 ? 2 : 0), "#444");
  }
  for (const double tick : y.ticks()) {
    line(kLeft, place_y(tick), kWidth - kRight, place_y(tick));
    text(kLeft - 6, place_y(tick) + 4, "end", number(tick, tick < 1 && tick > 0 ? 2 : 0), "#444");
  }
  text((kLeft + kWidth) / 2, kHeight - 10, "middle", x_title, "#000");
  text(kLeft, kTop - 3, "start", y_title, "#000");
  // Where curves usually are not: log-log ones fall to the right, the others rise or lie high.
  double legend = is_logarithmic ? kTop + 16 : kHeight - kBottom - 6 - 15 * (static_cast<double>(curves.size()) - 1);
  for (const Curve& curve : curves) {
    if (curve.points.empty()) continue;
    std::string path;
    for (const auto& [at_x, at_y] : curve.points) {
      if (is_logarithmic && !(at_x > 0 && at_y > 0)) continue;
      path += (path.empty() ? "M" : "L") + number(place_x(at_x), 1) + " " + number(place_y(at_y), 1);
    }
    out += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + curve.colour + "\" stroke-width=\"1.5\"/>";
    text(kWidth - kRight - 6, legend, "end", curve.name, curve.colour);
    legend += 15;
  }
  return out + "</svg>";
}

std::string report_html(const ReportInput& input) {
  const Json& job = input.job;
  const std::string name = job.at("name").get<std::string>();
  const std::string title = name.empty() ? "Colony " + job.at("id").get<std::string>() : name;
  std::string out = page_head(title) + "<table>";
  for (const char* member : {"id", "state", "reason", "created_at", "finished_at", "engine_version"}) {
    out += table_row(member, cell_text(job.at(member)));
  }
  // The job's own last state, which is not what a report of an earlier time shows.
  for (const char* member : {"time_h", "cells", "active", "passive", "senescent"}) {
    out += table_row(std::string("latest ") + member, member_text(job.at("progress"), member));
  }
  out += table_row("latest event", member_text(job, "last_seq"));
  out += "<tr><th>latest digest</th><td><code>" + html_text(job.at("digest").get<std::string>()) + "</code></td></tr></table>";
  if (!input.analysis.is_null()) out += moment_section(input.analysis);
  out += "<h2>Pictures</h2>" + figures(input.pictures);
  out += growth_section(input.series);
  if (!input.analysis.is_null()) out += fractal_section(input.analysis) + shape_section(input.analysis);
  std::string rows;
  add_leaves(job.at("spec"), "", rows);
  return out + "<h2>Parameters</h2><table>" + rows + "</table></body></html>\n";
}

std::string analysis_html(const AnalysisPageInput& input) {
  const Json& analysis = input.analysis;
  const Json& result = analysis.at("result");
  const std::string name = analysis.at("name").get<std::string>();
  std::string rows;
  for (const char* member : {"id", "created_at", "media_type", "image_bytes"}) rows += table_row(member, cell_text(analysis.at(member)));
  add_leaves(result.at("image"), "image", rows);
  Json segmentation = result.at("segmentation");
  segmentation.erase("sweep");
  add_leaves(segmentation, "segmentation", rows);
  return page_head(name.empty() ? "Analysis " + analysis.at("id").get<std::string>() : name) + figures(input.pictures) +
         fractal_section(result) + sweep_section(result.at("threshold_sweep")) + "<h2>What was done</h2><table>" + rows +
         "</table></body></html>\n";
}

}  // namespace colony::client
