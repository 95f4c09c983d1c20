// analyses, analysis, comparisons, comparison, delete-analysis, delete-comparison: what was made of pictures, and is kept at the server.
#include <algorithm>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"

namespace colony::client {
namespace {

struct PageOptions {
  std::optional<std::string> cursor;
  std::string limit = "50";
};

struct OneOptions {
  std::string id, figure;
};

ExitCode list_rows(Session& session, const PageOptions& options, const Collection& of) {
  const std::int64_t limit = integer_option("--limit", options.limit);
  if (limit < 1) throw Failure(ExitCode::kUsage, "--limit: must be at least 1");
  std::optional<std::string> cursor = options.cursor;
  const bool is_comparison = &of == &kComparisons;
  std::vector<std::vector<std::string>> rows;
  bool more = true;
  while (more && static_cast<std::int64_t>(rows.size()) < limit) {
    // As of jobs: a page of the server holds 500; with --json its page is printed as it is.
    const std::int64_t left = limit - static_cast<std::int64_t>(rows.size());
    const std::string page = std::to_string(session.json ? limit : std::min<std::int64_t>(left, 500));
    const HttpResponse response = session.client().send({.target = Target(of.path).add("limit", page).add_if("cursor", cursor).text()});
    require_ok(response);
    if (session.json) {
      session.env.out << response.body << '\n';
      return ExitCode::kDone;
    }
    const Json body = body_json(response);
    for (const Json& row : body.at("items")) {
      const std::string source = is_comparison ? member_text(row, "job_id") : member_text(row, "media_type");
      const std::string other = is_comparison ? member_text(row, "analysis_id") : member_text(row, "image_bytes");
      rows.push_back({member_text(row, "id"), member_text(row, "state"), source, other, member_text(row, "created_at"), member_text(row, "name")});
    }
    const Json& next = body.at("next");
    more = next.is_string();
    if (more) cursor = next.get<std::string>();
  }
  if (rows.empty()) {
    session.env.err << "no " << of.command << '\n';
    return ExitCode::kDone;
  }
  session.env.out << table_text({"ID", "STATE", is_comparison ? "JOB" : "PICTURE", is_comparison ? "ANALYSIS" : "BYTES", "CREATED_AT", "NAME"}, rows);
  if (more) session.env.err << "note: there are more; --limit shows them\n";
  return ExitCode::kDone;
}

void save_figure(Session& session, const Json& row, const std::string& path) {
  HttpRequest request;
  const Json& figure = row.at("links").at("figure");
  if (!figure.is_string()) throw Failure(ExitCode::kRefused, "the comparison has no figure any more: its job or its analysis was deleted");
  request.target = figure.get<std::string>();
  request.accept = "image/png";
  Output output(session.env, path);
  require_ok(session.client().receive(request, [&](std::string_view bytes) { output.write(bytes); }));
  output.finish();
}

ExitCode show_row(Session& session, const OneOptions& options, const Collection& of) {
  const std::string id = resolve_id(session, options.id, of);
  const Json row = get_json(session.client(), std::string(of.path) + "/" + id);
  if (!options.figure.empty()) save_figure(session, row, options.figure);
  std::ostream& out = session.env.out;
  if (session.json) {
    out << row.dump() << '\n';
    return ExitCode::kDone;
  }
  for (const char* member : {"id", "name", "state", "failure_code", "detail", "created_at", "finished_at", "job_id", "analysis_id",
                             "media_type", "image_bytes"}) {
    if (row.contains(member) && !row.at(member).is_null()) out << member << ": " << member_text(row, member) << '\n';
  }
  const Json& result = row.at("result");
  if (result.is_null()) return ExitCode::kDone;
  if (result.contains("segmentation")) out << "objects: " << member_text(result.at("segmentation"), "object_count") << '\n';
  for (const Json& sentence : result.at("verdict")) out << "- " << printable(sentence.get<std::string>()) << '\n';
  out << "(--json shows the rest)\n";
  return ExitCode::kDone;
}

ExitCode delete_row(Session& session, const OneOptions& options, const Collection& of) {
  const std::string id = resolve_id(session, options.id, of);
  HttpRequest request;
  request.method = "DELETE";
  request.target = std::string(of.path) + "/" + id;
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  if (!session.json) session.env.out << id << ": deleted" << (&of == &kAnalyses ? ", with its picture" : "") << '\n';
  return ExitCode::kDone;
}

}  // namespace

void add_analysis_commands(CLI::App& app, Session& session, Action& action) {
  const auto add_list = [&](const char* text, const Collection& of) {
    auto options = std::make_shared<PageOptions>();
    CLI::App* command = app.add_subcommand(of.command, text);
    command->add_option("--limit", options->limit, "How many at most")->capture_default_str();
    command->add_option("--cursor", options->cursor, "Where to go on: `next` of the page before (with --json)");
    command->callback([&session, &action, options, &of] { action = [&session, options, &of] { return list_rows(session, *options, of); }; });
  };
  const auto add_one = [&](const char* name, const char* text, const Collection& of, ExitCode (*run)(Session&, const OneOptions&, const Collection&)) {
    auto options = std::make_shared<OneOptions>();
    CLI::App* command = app.add_subcommand(name, text);
    command->add_option("ID", options->id, "Its id, or the unique end of it")->required();
    command->callback([&session, &action, options, &of, run] { action = [&session, options, &of, run] { return run(session, *options, of); }; });
    return std::pair(command, options);
  };
  add_list("Analysed pictures, newest first", kAnalyses);
  add_one("analysis", "One analysed picture, and what follows from it", kAnalyses, show_row);
  add_one("delete-analysis", "Remove an analysis and its picture, for good", kAnalyses, delete_row);
  add_list("Comparisons, newest first", kComparisons);
  const auto [command, options] = add_one("comparison", "One comparison, and what follows from it", kComparisons, show_row);
  command->add_option("--figure", options->figure, "File for the figure (PNG)");
  add_one("delete-comparison", "Remove a comparison, for good", kComparisons, delete_row);
}

}  // namespace colony::client
