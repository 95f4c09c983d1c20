#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"

namespace colony::client {
namespace {

struct ListOptions {
  std::optional<std::string> state, kind, name, cursor;
  std::vector<std::string> labels;
  std::string limit = "50";
};

std::string progress_member(const Json& job, const char* name, int decimals) {
  const auto progress = job.find("progress");
  return progress == job.end() ? "-" : member_text(*progress, name, decimals);
}

std::string state_text(const Json& job) {
  const std::string reason = member_text(job, "reason");
  const std::string state = member_text(job, "state");
  return reason.empty() || reason == "-" || reason == state ? state : state + " (" + reason + ")";
}

void print_raw(Session& session, const std::string& body) {
  session.env.out << body << (body.ends_with('\n') ? "" : "\n");
}

ExitCode list_jobs(Session& session, const ListOptions& options) {
  const std::int64_t limit = integer_option("--limit", options.limit);
  if (limit < 1) throw Failure(ExitCode::kUsage, "--limit: must be at least 1");
  std::optional<std::string> cursor = options.cursor;
  std::vector<std::vector<std::string>> rows;
  bool more = true;
  while (more && static_cast<std::int64_t>(rows.size()) < limit) {
    // The server gives at most 500 jobs a page; with --json its page is printed as it is, so its limits hold.
    const std::int64_t left = limit - static_cast<std::int64_t>(rows.size());
    const std::string page = std::to_string(session.json ? limit : std::min<std::int64_t>(left, 500));
    HttpRequest request;
    Target target("/v1/jobs");
    target.add_if("state", options.state).add_if("kind", options.kind).add_if("name", options.name).add("limit", page);
    for (const std::string& label : options.labels) target.add("label", label);
    request.target = target.add_if("cursor", cursor).text();
    const HttpResponse response = session.client().send(request);
    require_ok(response);
    if (session.json) {
      print_raw(session, response.body);
      return ExitCode::kDone;
    }
    const Json body = body_json(response);
    for (const Json& job : body.value("items", Json::array())) {
      rows.push_back({member_text(job, "id"), state_text(job), progress_member(job, "cells", 0),
                      progress_member(job, "time_h", 1), member_text(job, "created_at"), member_text(job, "name")});
    }
    const auto next = body.find("next");
    more = next != body.end() && next->is_string();
    if (more) cursor = next->get<std::string>();
  }
  if (rows.empty()) {
    session.env.err << "no jobs\n";
    return ExitCode::kDone;
  }
  session.env.out << table_text({"ID", "STATE", "CELLS", "TIME_H", "CREATED_AT", "NAME"}, rows);
  if (more) session.env.err << "note: there are more; --limit shows them\n";
  return ExitCode::kDone;
}

/// Members one below the other; objects inside objects by their path. A list of objects is given by their names alone,
/// or their number: `--json` has the rest.
void print_members(std::ostream& out, const Json& object, const std::string& prefix) {
  for (const auto& [key, value] : object.items()) {
    const std::string name = prefix + printable(key);
    if (prefix.starts_with("origin.") && key == "spec") {
      out << name << ": (--json shows it)\n";
    } else if (value.is_object() && !value.empty()) {
      print_members(out, value, name + ".");
    } else if (value.is_array() && !value.empty() && value.front().is_object()) {
      out << name << ": ";
      if (value.front().contains("name")) {
        for (std::size_t i = 0; i < value.size(); ++i) out << (i > 0 ? ", " : "") << member_text(value[i], "name");
      } else {
        out << value.size() << " (--json shows them)";
      }
      out << '\n';
    } else {
      out << name << ": " << (value.is_number_float() ? value.dump() : cell_text(value)) << '\n';
    }
  }
}

ExitCode show_json(Session& session, const std::string& target) {
  HttpRequest request;
  request.target = target;
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  if (session.json) {
    print_raw(session, response.body);
  } else {
    print_members(session.env.out, body_json(response), "");
  }
  return ExitCode::kDone;
}

/// The job; with `wait_s` as it is after its next change of state, name or labels, or as it is after that time.
ExitCode show_job(Session& session, const std::string& text, const std::optional<std::string>& wait_s) {
  const std::string target = job_target(resolve_job_id(session, text)).text();
  if (!wait_s) return show_json(session, target);
  const std::int64_t seconds = integer_option("--wait", *wait_s);
  if (seconds < 1 || seconds > 60) throw Failure(ExitCode::kUsage, "--wait: must be within 1 to 60");
  HttpResponse response = session.client().send({.target = target});
  require_ok(response);
  if (const auto tag = response.headers.find("etag"); tag != response.headers.end()) {
    HttpRequest again;
    again.target = target;
    again.headers = {{"If-None-Match", tag->second}, {"Prefer", "wait=" + std::to_string(seconds)}};
    HttpResponse later = session.client().send(again);
    if (later.status != 304) response = std::move(later);
    require_ok(response);
  }
  if (session.json) {
    print_raw(session, response.body);
  } else {
    print_members(session.env.out, body_json(response), "");
  }
  return ExitCode::kDone;
}

ExitCode command_job(Session& session, const std::string& text, const std::string& verb) {
  const std::string id = resolve_job_id(session, text);
  HttpRequest request;
  request.method = "POST";
  request.target = job_target(id, "/" + verb).text();
  request.body = "";  // the server wants the content type of every POST; it has no body to read
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  if (session.json) {
    print_raw(session, response.body);
    return ExitCode::kDone;
  }
  const Json job = Json::parse(response.body, nullptr, false);
  const std::string state = job.is_object() ? state_text(job) : "-";
  session.env.out << id << ": " << (response.status == 200 ? "already " : "")
                  << (state == "-" ? verb + " accepted" : state) << '\n';
  return ExitCode::kDone;
}

ExitCode delete_job(Session& session, const std::string& text) {
  const std::string id = resolve_job_id(session, text);
  HttpRequest request;
  request.method = "DELETE";
  request.target = job_target(id).text();
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  if (session.json) {
    if (!response.body.empty()) print_raw(session, response.body);
  } else {
    session.env.out << id << ": deleted, with its history\n";
  }
  return ExitCode::kDone;
}

}  // namespace

void add_job_commands(CLI::App& app, Session& session, Action& action) {
  auto options = std::make_shared<ListOptions>();
  CLI::App* list = app.add_subcommand("list", "Jobs, newest first");
  list->add_option("--state", options->state, "queued, running, paused, succeeded, failed or cancelled");
  list->add_option("--kind", options->kind, "Kind of job");
  list->add_option("--name", options->name, "Exact name");
  list->add_option("--label", options->labels, "Label as key:value (repeatable: all of them)")->allow_extra_args(false);
  list->add_option("--limit", options->limit, "How many at most")->capture_default_str();
  list->add_option("--cursor", options->cursor, "Where to go on: `next` of the page before (with --json)");
  list->callback(
      [&session, &action, options] { action = [&session, options] { return list_jobs(session, *options); }; });

  CLI::App* counts = app.add_subcommand("counts", "How many jobs are in each state");
  counts->callback([&] { action = [&session] { return show_json(session, "/v1/jobs/counts"); }; });

  CLI::App* info = app.add_subcommand("info", "The server: version, limits, presets");
  info->callback([&] { action = [&session] { return show_json(session, "/v1/service-info"); }; });

  const auto with_id = [&](const char* name, const char* text, ExitCode (*run)(Session&, const std::string&)) {
    auto id = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand(name, text);
    command->add_option("ID", *id, "Job id, or its unique end")->required();
    command->callback([&session, &action, id, run] { action = [&session, id, run] { return run(session, *id); }; });
  };
  struct ShowOptions {
    std::string id;
    std::optional<std::string> wait_s;
  };
  auto shown = std::make_shared<ShowOptions>();
  CLI::App* show = app.add_subcommand("show", "One job");
  show->add_option("ID", shown->id, "Job id, or its unique end")->required();
  show->add_option("--wait", shown->wait_s, "First wait for a change of its state, name or labels, at most so many seconds (up to 60)");
  show->callback([&session, &action, shown] {
    action = [&session, shown] { return show_job(session, shown->id, shown->wait_s); };
  });
  with_id("cancel", "End a job; what it grew so far stays",
          [](Session& s, const std::string& id) { return command_job(s, id, "cancel"); });
  with_id("pause", "Stop a job until it is resumed",
          [](Session& s, const std::string& id) { return command_job(s, id, "pause"); });
  with_id("resume", "Let a paused job go on",
          [](Session& s, const std::string& id) { return command_job(s, id, "resume"); });
  with_id("delete", "Remove a job that has ended, and its history, for good", delete_job);
}

}  // namespace colony::client
