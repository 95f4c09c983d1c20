// series and image: the growth curve and the colony's picture.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"

namespace colony::client {
namespace {

constexpr std::size_t kSparklineColumns = 60;
constexpr std::size_t kShortTableRows = 9;

struct SeriesOptions {
  std::string id, output;
  std::optional<std::string> points;
  bool csv = false, ndjson = false;
};

/// A few lines for people: the curve as a sparkline over equal time steps, and some of its rows.
std::string curve_text(const Json& items, bool all_rows, bool utf8) {
  std::vector<double> counts;
  std::vector<std::vector<std::string>> rows;
  for (const Json& item : items) {
    const auto count = item.find("cell_count");
    counts.push_back(count != item.end() && count->is_number() ? count->get<double>() : 0.0);
  }
  const std::size_t shown = all_rows ? items.size() : std::min(items.size(), kShortTableRows);
  for (std::size_t i = 0; i < shown; ++i) {
    const Json& item = items[shown < 2 ? 0 : i * (items.size() - 1) / (shown - 1)];
    rows.push_back({member_text(item, "time_h", 1), member_text(item, "cell_count"), member_text(item, "active_count"),
                    member_text(item, "passive_count"), member_text(item, "radius_um", 1),
                    member_text(item, "volume_mean_um3", 0), member_text(item, "density_per_mm2", 0)});
  }
  std::string out =
      table_text({"TIME_H", "CELLS", "ACTIVE", "PASSIVE", "RADIUS_UM", "MEAN_VOLUME_UM3", "CELLS_PER_MM2"}, rows);
  const double most = *std::max_element(counts.begin(), counts.end());
  return out + "cells  " + sparkline(counts, kSparklineColumns, utf8) + "  to " + fixed(most, 0) + "\n";
}

ExitCode show_series(Session& session, const SeriesOptions& options) {
  if (options.csv + options.ndjson + session.json > 1) {
    throw Failure(ExitCode::kUsage, "--csv, --ndjson and --json: only one of them");
  }
  const std::string id = resolve_job_id(session, options.id);
  HttpRequest request;
  request.target = job_target(id, "/series").add_if("points", options.points).text();
  if (options.csv) request.accept = "text/csv";
  Output output(session.env, options.output);
  if (options.csv || session.json) {
    require_ok(session.client().receive(request, [&](std::string_view bytes) { output.write(bytes); }));
    if (session.json) output.write("\n");
  } else {
    const Json body = get_json(session.client(), request.target);
    const auto items = body.is_object() ? body.find("items") : body.end();
    if (items == body.end() || !items->is_array())
      throw Failure(ExitCode::kRefused, "the server's series has no items");
    if (options.ndjson) {  // not a form of the server's; at most 10,000 rows, so made from its list
      for (const Json& item : *items) output.write(item.dump() + "\n");
    } else if (items->empty()) {
      session.env.err << "nothing has happened yet\n";
    } else {
      output.write(curve_text(*items, options.points.has_value(), locale_is_utf8(session.env)));
    }
  }
  output.finish();
  return ExitCode::kDone;
}

struct ImageOptions {
  std::string id, output;
  std::optional<std::string> at_h, style, width_px, um_per_px, colour_by, lines;
  bool no_scale_bar = false, tiff = false;
};

ExitCode fetch_image(Session& session, const ImageOptions& options) {
  if (session.json) throw Failure(ExitCode::kUsage, "--json: a picture has no JSON form");
  if (options.output.empty() && session.env.out_is_terminal) {
    throw Failure(ExitCode::kUsage, "a picture is not for a terminal: give -o FILE");
  }
  const std::string id = resolve_job_id(session, options.id);
  HttpRequest request;
  Target target = job_target(id, "/image");
  target.add_if("at_h", options.at_h)
      .add_if("style", options.style)
      .add_if("width_px", options.width_px)
      .add_if("um_per_px", options.um_per_px)
      .add_if("colour_by", options.colour_by)
      .add_if("lines", options.lines);
  if (options.no_scale_bar) target.add("scale_bar", "false");
  request.target = target.text();
  request.accept = options.tiff ? "image/tiff" : "image/png";
  Output output(session.env, options.output);
  const HttpResponse response = session.client().receive(request, [&](std::string_view bytes) { output.write(bytes); });
  require_ok(response);
  output.finish();
  if (!options.output.empty() && options.output != "-") {
    session.env.err << "wrote " << printable(options.output) << " (" << output.written_bytes() << " bytes)\n";
  }
  return ExitCode::kDone;
}

}  // namespace

void add_picture_commands(CLI::App& app, Session& session, Action& action) {
  auto series = std::make_shared<SeriesOptions>();
  CLI::App* command = app.add_subcommand("series", "The growth curve");
  command->add_option("ID", series->id, "Job id, or its unique end")->required();
  command->add_option("--points", series->points, "Rows in equal steps of time (all are then shown)");
  command->add_flag("--csv", series->csv, "CSV");
  command->add_flag("--ndjson", series->ndjson, "One JSON object a line");
  command->add_option("-o,--output", series->output, "File (default: standard output); it appears whole or not at all");
  command->callback(
      [&session, &action, series] { action = [&session, series] { return show_series(session, *series); }; });

  auto image = std::make_shared<ImageOptions>();
  command = app.add_subcommand("image", "The colony from above, as PNG or OME-TIFF");
  command->add_option("ID", image->id, "Job id, or its unique end")->required();
  command->add_option("-o,--output", image->output, "File; it appears whole or not at all");
  command->add_option("--at-h", image->at_h, "Model time, h (default: now, or the end)");
  command->add_option("--style", image->style, "shaded, contours, brightfield, phase or labels");
  command->add_option("--lines", image->lines, "Which borders contours draws: both, colony or cells");
  command->add_flag("--tiff", image->tiff, "OME-TIFF with all channels (brightfield, phase, nuclei, labels) instead of PNG");
  command->add_option("--width-px", image->width_px, "Width of the picture");
  command->add_option("--um-per-px", image->um_per_px, "Scale of the picture (instead of its width)");
  command->add_option("--colour-by", image->colour_by, "What the colours show: activity, generation, age or volume");
  command->add_flag("--no-scale-bar", image->no_scale_bar, "Without the scale bar");
  command->callback(
      [&session, &action, image] { action = [&session, image] { return fetch_image(session, *image); }; });
}

}  // namespace colony::client
