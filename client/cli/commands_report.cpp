// report: everything about a job in one HTML file.
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/report.hpp"

namespace colony::client {
namespace {

struct ReportOptions {
  std::string id, output;
  std::optional<std::string> at_h;
};

ExitCode write_report(Session& session, const ReportOptions& options) {
  if (session.json) throw Failure(ExitCode::kUsage, "--json: a report has no JSON form");
  const std::string id = resolve_job_id(session, options.id);
  ReportInput input;
  Output output(session.env, options.output);
  input.job = get_json(session.client(), job_target(id).text());
  // One moment for all that follows: of a job that goes on, each request would else show another colony.
  const std::string at_h = options.at_h.value_or(input.job.at("progress").at("time_h").dump());
  input.series = get_json(session.client(), job_target(id, "/series").text()).at("items");
  if (input.job.at("progress").at("cells").get<std::uint64_t>() > 0) {
    input.analysis = get_json(session.client(), job_target(id, "/analysis").add("at_h", at_h).text());
  }
  for (const char* style : {"brightfield", "phase", "shaded", "contours"}) {
    HttpRequest request;
    request.target =
        job_target(id, "/image").add("style", style).add("width_px", "800").add("at_h", at_h).text();
    request.accept = "image/png";
    HttpResponse response = session.client().send(request);
    require_ok(response);
    input.pictures.emplace_back(style, std::move(response.body));
  }
  output.write(report_html(input));
  output.finish();
  if (!options.output.empty() && options.output != "-") {
    session.env.err << "wrote " << printable(options.output) << " (" << output.written_bytes() << " bytes)\n";
  }
  return ExitCode::kDone;
}

}  // namespace

void add_report_command(CLI::App& app, Session& session, Action& action) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand("report", "Everything about a job in one HTML file: pictures, curves, tables, parameters");
  command->add_option("ID", options->id, "Job id, or its unique end")->required();
  command->add_option("--at-h", options->at_h, "Model time of pictures and measurements, h (default: now, or the end)");
  command->add_option("-o,--output", options->output, "File (default: standard output); it appears whole or not at all");
  command->callback([&session, &action, options] { action = [&session, options] { return write_report(session, *options); }; });
}

}  // namespace colony::client
