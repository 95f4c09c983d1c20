// lineage, mesh, measure, analyze, compare: what was measured on a colony or on a picture, and files that other programs read.
#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/report.hpp"
#include "client/cli/report_facts.hpp"

namespace colony::client {
namespace {

constexpr std::size_t kImageBytesMax = 1u << 30;  // the server's own limit is lower, and told by it
constexpr std::chrono::milliseconds kPollInterval{500};

struct FileOptions {
  std::string id, output;
  std::optional<std::string> at_h, triangles_max, um_per_px, width_px;
  bool no_nuclei = false, cells = false;
};

/// Copies an answer of any type to the output.
ExitCode fetch_file(Session& session, const Target& target, const std::string& accept, const std::string& path) {
  HttpRequest request;
  request.target = target.text();
  request.accept = accept;
  Output output(session.env, path);
  require_ok(session.client().receive(request, [&](std::string_view bytes) { output.write(bytes); }));
  output.finish();
  if (!path.empty() && path != "-") {
    session.env.err << "wrote " << printable(path) << " (" << output.written_bytes() << " bytes)\n";
  }
  return ExitCode::kDone;
}

ExitCode fetch_lineage(Session& session, const FileOptions& options) {
  Target target = job_target(resolve_job_id(session, options.id), "/lineage");
  target.add_if("at_h", options.at_h);
  return fetch_file(session, target, session.json ? "application/json" : "text/x-newick", options.output);
}

ExitCode fetch_mesh(Session& session, const FileOptions& options) {
  if (session.json) throw Failure(ExitCode::kUsage, "--json: a mesh has no JSON form");
  if (options.output.empty() && session.env.out_is_terminal) {
    throw Failure(ExitCode::kUsage, "a mesh is not for a terminal: give -o FILE");
  }
  Target target = job_target(resolve_job_id(session, options.id), "/mesh");
  target.add_if("at_h", options.at_h).add_if("triangles_max", options.triangles_max);
  if (options.no_nuclei) target.add("nuclei", "false");
  return fetch_file(session, target, "model/gltf-binary", options.output);
}

/// A dimension as "1.62 (se 0.01, boxes of 3 to 120 px, a crossover, not scaling)", or why there is none.
std::string line_text(const Json& line) {
  const Json& d0 = line.at("d0");
  if (d0.is_null()) return "none: " + printable(line.at("reason").get<std::string>());
  const std::string finding = finding_text(line.value("finding", ""));
  return member_text(d0, "value") + " (se " + member_text(d0, "se", 3) + ", boxes of " + d0.at("range_px")[0].dump() + " to " +
         d0.at("range_px")[1].dump() + " px" + (finding.empty() ? ")" : ", " + finding + ")");
}

void print_lines(std::ostream& out, const Json& measured, const KindNames& names) {
  out << names.walls << ": D0 " << line_text(measured.at("fractal").at("walls")) << '\n';
  out << names.outline << ": D0 " << line_text(measured.at("fractal").at("outline")) << '\n';
  for (const Json& control : measured.at("controls")) {
    out << "  control " << printable(control.at("name").get<std::string>()) << ": D0 " << line_text(control.at("walls")) << '\n';
  }
}

/// But for `told`, which was printed before.
void print_verdict(std::ostream& out, const Json& measured, const std::string& told = {}) {
  for (const Json& sentence : measured.at("verdict")) {
    if (told.empty() || sentence != told) out << "- " << printable(sentence.get<std::string>()) << '\n';
  }
}

/// The dimensions against the threshold, a line each.
void print_sweep(std::ostream& out, const Json& measured, const KindNames& names) {
  out << "against the threshold, in one grid from the frame's corner (the answer's grid begins at what is counted: at its threshold the two differ a little)\n";
  for (const Json& row : measured.at("threshold_sweep").at("rows")) {
    out << "  threshold " << row.at("threshold").dump() << ": " << names.walls << " D0 " << line_text(row.at("walls")) << ", " << names.outline
        << " D0 " << line_text(row.at("outline")) << '\n';
  }
}

ExitCode measure(Session& session, const FileOptions& options) {
  Target target = job_target(resolve_job_id(session, options.id), "/analysis");
  target.add_if("at_h", options.at_h).add_if("um_per_px", options.um_per_px).add_if("width_px", options.width_px);
  if (options.cells) {
    if (session.json) throw Failure(ExitCode::kUsage, "--json: the cells are a table; without --cells the measurements are JSON");
    return fetch_file(session, target, "text/csv", options.output);
  }
  if (!options.output.empty()) throw Failure(ExitCode::kUsage, "--output: is for --cells");
  const HttpResponse response = session.client().send({.target = target.text()});
  require_ok(response);
  if (session.json) {
    session.env.out << response.body << '\n';
    return ExitCode::kDone;
  }
  const Json measured = body_json(response);
  const auto all = measured.at("cell_count").get<std::uint64_t>(), seen = measured.at("visible_cell_count").get<std::uint64_t>();
  session.env.out << counted_text(all, "cell", "cells") << " at " << member_text(measured, "time_h") << " h";
  if (seen < all) session.env.out << ", " << seen << " of them seen from above";
  session.env.out << '\n';
  print_lines(session.env.out, measured, kind_names("cells"));
  print_verdict(session.env.out, measured);
  return ExitCode::kDone;
}

struct AnalyzeOptions {
  std::string file, steps, objects, html;
  std::optional<std::string> name, um_per_px, foreground, channel, threshold, pipeline, area_min_px, hole_max_px, background_reach_px,
      window_radius_px;
  bool clahe = false, no_split = false;
};

/// By the first bytes, as the server does; Failure kUsage for anything else.
std::string image_type(const std::string& bytes, const std::string& path) {
  const auto begins = [&](std::string_view magic) { return bytes.compare(0, magic.size(), magic) == 0; };
  if (begins("\x89PNG")) return "image/png";
  if (begins("\xff\xd8\xff")) return "image/jpeg";
  if (begins(std::string_view("II*\0", 4)) || begins(std::string_view("MM\0*", 4)) || begins(std::string_view("II+\0", 4)) ||
      begins(std::string_view("MM\0+", 4))) {
    return "image/tiff";
  }
  throw Failure(ExitCode::kUsage, printable(path) + ": is no PNG, TIFF or JPEG");
}

/// Asks until the server has done it. Failure kJobFailed if it could not.
Json when_done(Session& session, HttpResponse response) {
  require_ok(response);
  for (;;) {
    Json row = body_json(response);
    const std::string state = row.at("state").get<std::string>();
    if (state == "succeeded") return row;
    if (state == "failed") throw Failure(ExitCode::kJobFailed, printable(row.at("detail").get<std::string>()));
    session.env.interrupt.wait(kPollInterval);
    if (session.env.interrupt.raised()) {
      throw Failure(ExitCode::kInterrupted, "interrupted; it goes on at the server as " + row.at("id").get<std::string>());
    }
    response = session.client().send({.target = link_target(session, row, "self")});
    require_ok(response);
  }
}

void save_steps(Session& session, const Json& row, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Failure(ExitCode::kUsage, printable(folder) + ": " + error.message());
  int index = 0;
  for (const Json& step : row.at("result").at("steps")) {
    const std::string name = step.at("name").get<std::string>();
    const bool is_plain = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    });
    if (!is_plain) throw Failure(ExitCode::kRefused, "the server names a step that cannot be a file's name");
    const std::string number = std::to_string(++index);
    fetch_file(session, Target(link_target(session, row, "steps") + "/" + name), "image/png",
               folder + "/" + (number.size() < 2 ? "0" : "") + number + "-" + name + ".png");
  }
}

/// Where the scale comes from, if there is one.
std::string scale_text(const Json& image) {
  const std::string source = image.at("um_per_px_source").get<std::string>();
  if (image.at("um_per_px").is_null()) return "no scale: lengths are in pixels; --um-per-px gives one";
  return "scale " + member_text(image, "um_per_px", 4) + " um a pixel, " +
         (source == "given" ? "as asked for" : source == "ome" ? "by the file's OME metadata" : "by " + printable(source));
}

/// The same as one page, with the picture of what was counted.
void save_page(Session& session, const Json& row, const std::string& path) {
  AnalysisPageInput input;
  input.analysis = row;
  for (const char* step : {"grey", "overlay"}) {
    HttpRequest request;
    request.target = row.at("links").at("steps").get<std::string>() + "/" + step;
    request.accept = "image/png";
    HttpResponse response = session.client().send(request);
    require_ok(response);
    input.pictures.emplace_back(step, std::move(response.body));
  }
  Output output(session.env, path);
  output.write(analysis_html(input));
  output.finish();
}

ExitCode analyze(Session& session, const AnalyzeOptions& options) {
  HttpRequest request;
  request.method = "POST";
  request.body = read_input(session.env, options.file, kImageBytesMax);
  request.body_type = image_type(*request.body, options.file);
  Target target("/v1/analyses");
  target.add_if("name", options.name)
      .add_if("um_per_px", options.um_per_px)
      .add_if("foreground", options.foreground)
      .add_if("channel", options.channel)
      .add_if("threshold", options.threshold)
      .add_if("pipeline", options.pipeline)
      .add_if("area_min_px", options.area_min_px)
      .add_if("hole_max_px", options.hole_max_px)
      .add_if("background_reach_px", options.background_reach_px)
      .add_if("window_radius_px", options.window_radius_px);
  if (options.clahe) target.add("clahe", "true");
  if (options.no_split) target.add("split", "false");
  request.target = target.text();
  HttpResponse answer = session.client().send(request);
  require_ok(answer, printable(options.file));
  const Json row = when_done(session, std::move(answer));
  if (!options.steps.empty()) save_steps(session, row, options.steps);
  if (!options.objects.empty()) {
    fetch_file(session, Target(row.at("links").at("objects").get<std::string>()), "text/csv", options.objects);
  }
  if (!options.html.empty()) save_page(session, row, options.html);
  std::ostream& out = session.env.out;
  if (session.json) {
    out << row.dump() << '\n';
    return ExitCode::kDone;
  }
  const Json& result = row.at("result");
  const Json& segmentation = result.at("segmentation");
  const KindNames names = kind_names(result.value("object_kind", ""));
  out << "analysis " << row.at("id").get<std::string>() << '\n'
      << counted_text(result.at("object_count").get<std::uint64_t>(), names.one, names.many) << " (" << printable(member_text(segmentation, "pipeline")) << ", threshold "
      << member_text(segmentation, "threshold") << "), mean area " << member_text(segmentation, "area_mean_px", 1) << " px, "
      << member_text(segmentation, "foreground_share", 3) << " of the field covered\n"
      << "pipeline " << printable(member_text(segmentation, "pipeline")) << ", "
      << printable(segmentation.at("pipeline_reason").get<std::string>()) << '\n'
      << "foreground " << printable(member_text(segmentation, "foreground")) << ", "
      << printable(segmentation.at("foreground_reason").get<std::string>()) << '\n'
      << scale_text(result.at("image")) << '\n';
  for (const Json& note : result.at("image").at("notes")) out << "note: " << printable(note.get<std::string>()) << '\n';
  const Json doubt = segmentation.value("doubt", Json());
  const std::string told = doubt.is_string() ? doubt.get<std::string>() : "";
  if (!told.empty()) out << printable(told) << '\n';
  print_lines(out, result, names);
  print_sweep(out, result, names);
  print_verdict(out, result, told);
  return ExitCode::kDone;
}

struct CompareOptions {
  std::string id, analysis_id, figure;
  std::optional<std::string> at_h, name, match, cell_count, cell_area_px;
};

ExitCode compare(Session& session, const CompareOptions& options) {
  Json body = {{"job_id", resolve_job_id(session, options.id)}, {"analysis_id", resolve_id(session, options.analysis_id, kAnalyses)}};
  if (options.at_h) body["at_h"] = number_option("--at-h", *options.at_h);
  if (options.name) body["name"] = *options.name;
  if (options.match) body["match"] = *options.match;
  if (options.cell_count) {
    const double count = number_option("--cell-count", *options.cell_count);
    if (!(count >= 1.0 && count <= 1e9 && count == static_cast<double>(static_cast<std::int64_t>(count)))) {
      throw Failure(ExitCode::kUsage, "--cell-count: must be a whole number");
    }
    body["cell_count"] = static_cast<std::int64_t>(count);
  }
  if (options.cell_area_px) body["cell_area_px"] = number_option("--cell-area-px", *options.cell_area_px);
  HttpRequest request;
  request.method = "POST";
  request.target = "/v1/comparisons";
  request.body = body.dump();
  const Json row = when_done(session, session.client().send(request));
  if (!options.figure.empty()) {
    fetch_file(session, Target(link_target(session, row, "figure")), "image/png", options.figure);
  }
  if (session.json) {
    session.env.out << row.dump() << '\n';
    return ExitCode::kDone;
  }
  const Json& result = row.at("result");
  session.env.out << "comparison " << row.at("id").get<std::string>() << '\n';
  for (const char* side : {"simulated", "real"}) {
    const KindNames names = kind_names(result.at(side).at("object_kind").get<std::string>());
    session.env.out << side << ", " << counted_text(result.at(side).at("object_count").get<std::uint64_t>(), names.one, names.many) << " of "
                    << member_text(result.at(side), "object_area_mean_px", 0) << " px\n";
    print_lines(session.env.out, result.at(side), names);
  }
  print_verdict(session.env.out, result);
  return ExitCode::kDone;
}

CLI::App* add_file_command(CLI::App& app, const char* name, const char* text, FileOptions& options, bool has_output) {
  CLI::App* command = app.add_subcommand(name, text);
  command->add_option("ID", options.id, "Job id, or its unique end")->required();
  command->add_option("--at-h", options.at_h, "Model time, h (default: now, or the end)");
  if (has_output) command->add_option("-o,--output", options.output, "File; it appears whole or not at all");
  return command;
}

}  // namespace

void add_measure_commands(CLI::App& app, Session& session, Action& action) {
  auto lineage = std::make_shared<FileOptions>();
  CLI::App* command = add_file_command(app, "lineage", "Who came from whom, as Newick trees (--json: a table)", *lineage, true);
  command->callback([&session, &action, lineage] { action = [&session, lineage] { return fetch_lineage(session, *lineage); }; });

  auto mesh = std::make_shared<FileOptions>();
  command = add_file_command(app, "mesh", "The surfaces of cells and nuclei, as binary glTF (GLB)", *mesh, true);
  command->add_option("--triangles-max", mesh->triangles_max, "Most triangles (default: 400 for each cell, within 200,000 to 4,000,000)");
  command->add_flag("--no-nuclei", mesh->no_nuclei, "Without nuclei");
  command->callback([&session, &action, mesh] { action = [&session, mesh] { return fetch_mesh(session, *mesh); }; });

  auto measured = std::make_shared<FileOptions>();
  command = add_file_command(app, "measure", "Measurements of a colony, with controls, and what follows from them", *measured, true);
  command->add_flag("--cells", measured->cells, "The shape of each cell instead, as CSV");
  command->add_option("--um-per-px", measured->um_per_px, "Scale of the measured picture (instead of its width)");
  command->add_option("--width-px", measured->width_px, "Width of the measured picture");
  command->callback([&session, &action, measured] { action = [&session, measured] { return measure(session, *measured); }; });

  auto picture = std::make_shared<AnalyzeOptions>();
  command = app.add_subcommand("analyze", "Count and measure what a picture shows");
  command->add_option("FILE", picture->file, "PNG, TIFF or JPEG")->required();
  command->add_option("--name", picture->name, "A name for people");
  command->add_option("--um-per-px", picture->um_per_px, "Size of a pixel (else lengths are in pixels)");
  command->add_option("--foreground", picture->foreground, "auto, light or dark");
  command->add_option("--channel", picture->channel, "Which channel, from 0");
  command->add_option("--threshold", picture->threshold, "0 to 254 (default: by Otsu)");
  command->add_option("--pipeline", picture->pipeline, "auto, nuclei, phase or contours");
  command->add_flag("--clahe", picture->clahe, "Even the local contrast first");
  command->add_flag("--no-split", picture->no_split, "nuclei: leave touching objects together");
  command->add_option("--area-min-px", picture->area_min_px, "Smallest object (default: by the picture)");
  command->add_option("--hole-max-px", picture->hole_max_px, "Largest hole that is filled (default: by the picture)");
  command->add_option("--background-reach-px", picture->background_reach_px, "nuclei: wider than any object (default: a quarter of the shorter side)");
  command->add_option("--window-radius-px", picture->window_radius_px, "phase: of the local deviation (default: 3)");
  command->add_option("--steps", picture->steps, "Folder for a picture of every step");
  command->add_option("--objects", picture->objects, "File for the shape of each object (CSV)");
  command->add_option("--html", picture->html, "File for everything on one page");
  command->callback([&session, &action, picture] { action = [&session, picture] { return analyze(session, *picture); }; });

  auto both = std::make_shared<CompareOptions>();
  command = app.add_subcommand("compare", "A colony against an analysed picture");
  command->add_option("ID", both->id, "Job id, or its unique end")->required();
  command->add_option("ANALYSIS", both->analysis_id, "Analysis id, or its unique end (`colony analyses` shows them)")->required();
  command->add_option("--at-h", both->at_h, "Model time, h (default: now, or the end)");
  command->add_option("--name", both->name, "A name for people");
  command->add_option("--match", both->match, "object_area or um_per_px (default: object_area)");
  command->add_option("--cell-count", both->cell_count, "How many cells the picture's objects are, if they are no cells");
  command->add_option("--cell-area-px", both->cell_area_px, "Or the mean area of a cell in the picture");
  command->add_option("--figure", both->figure, "File for the figure (PNG)");
  command->callback([&session, &action, both] { action = [&session, both] { return compare(session, *both); }; });
}

}  // namespace colony::client
