// events, cells and log: tables of any length, copied from the server's stream to the output with one line in memory at
// a time.
#include <algorithm>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/lines.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/sse.hpp"

namespace colony::client {
namespace {

struct DataOptions {
  std::string id, output;
  bool csv = false, ndjson = false, follow = false;
  std::optional<std::string> after, kind, cell_id, limit, at_h;
};

/// One row of a table for people. Fixed widths: a stream cannot know its widest value beforehand.
struct Column {
  const char* title;
  int width;  // negative: to the left
  std::function<std::string(const Json&)> text;
};

std::string padded(const std::string& text, int width) {
  const auto size = static_cast<std::size_t>(std::abs(width));
  const std::string pad(text.size() < size ? size - text.size() : 0, ' ');
  return width < 0 ? text + pad : pad + text;
}

std::string row_text(const std::vector<Column>& columns, const std::function<std::string(const Column&)>& text) {
  std::string line;
  for (const Column& column : columns) line += (line.empty() ? "" : "  ") + padded(text(column), column.width);
  line.erase(line.find_last_not_of(' ') + 1);
  return line + '\n';
}

std::function<std::string(const Json&)> member(const char* name, int decimals = 2) {
  return [name, decimals](const Json& object) { return member_text(object, name, decimals); };
}

std::string event_detail(const Json& event) {
  const std::string kind = member_text(event, "kind");
  const auto pair = [&](const char* label, const char* name, int decimals) {
    const std::string value = member_text(event, name, decimals);
    return value == "-" ? std::string() : std::string(label) + " " + value + "  ";
  };
  const auto place = [](const Json& cell) {
    return "at (" + member_text(cell, "x_um", 1) + ", " + member_text(cell, "y_um", 1) + ") um";
  };
  if (kind == "divided" && event.contains("cells") && event["cells"].is_array() && event["cells"].size() == 2) {
    const Json& daughter = event["cells"][1];
    return "daughter " + member_text(daughter, "cell_id") + " " + place(daughter) + "  " +
           pair("fitness", "fitness", 3);
  }
  if ((kind == "founded" || kind == "moved") && event.contains("cell")) return place(event["cell"]);
  if (kind == "inhibited")
    return pair("fitness", "fitness", 3) + pair("free share", "free_share", 3) + pair("due", "due_h", 2);
  if (kind == "settled") return pair("deformed volume", "deformed_volume_um3", 0);
  if (kind == "finished") return pair("reason", "reason", 0) + pair("cells", "cell_count", 0);
  return "";
}

const std::vector<Column>& event_columns() {
  static const std::vector<Column> columns = {{"SEQ", 9, member("seq")},
                                              {"TIME_H", 9, member("time_h", 3)},
                                              {"KIND", -9, member("kind")},
                                              {"CELL", 7, member("cell_id")},
                                              {"DETAIL", -1, event_detail}};
  return columns;
}

const std::vector<Column>& cell_columns() {
  static const std::vector<Column> columns = {
      {"CELL", 7, member("cell_id")},   {"PARENT", 7, member("parent_id")},
      {"GEN", 4, member("generation")}, {"ACTIVITY", -9, member("activity")},
      {"X_UM", 9, member("x_um", 1)},   {"Y_UM", 9, member("y_um", 1)},
      {"A_UM", 6, member("a_um", 1)},   {"B_UM", 6, member("b_um", 1)},
      {"C_UM", 6, member("c_um", 1)},   {"BORN_H", 8, member("born_h", 2)},
      {"DUE_H", 8, member("due_h", 2)}, {"VOLUME_UM3", 10, member("volume_um3", 0)}};
  return columns;
}

const std::vector<Column>& log_columns() {
  static const std::vector<Column> columns = {
      {"AT", -24, member("at")}, {"LEVEL", -7, member("level")}, {"MESSAGE", -1, member("message")}};
  return columns;
}

std::string header_row(const std::vector<Column>& columns) {
  return row_text(columns, [](const Column& column) { return std::string(column.title); });
}

std::string json_row(const std::vector<Column>& columns, std::string_view line) {
  const Json object = Json::parse(line, nullptr, false);
  if (!object.is_object()) throw Failure(ExitCode::kRefused, "the server sent a line that is not a JSON object");
  return row_text(columns, [&](const Column& column) { return column.text(object); });
}

void report_file(Session& session, const Output& output, const std::string& path) {
  if (!path.empty() && path != "-") {
    session.env.err << "wrote " << printable(path) << " (" << output.written_bytes() << " bytes)\n";
  }
}

/// Copies the server's bytes to the output in the format asked for. `json_is_whole`: its JSON form has no pages.
ExitCode fetch(Session& session, const Target& target, const DataOptions& options, const std::vector<Column>& columns,
               bool json_is_whole) {
  if (options.csv + options.ndjson + session.json > 1) {
    throw Failure(ExitCode::kUsage, "--csv, --ndjson and --json: only one of them");
  }
  HttpRequest request;
  request.target = target.text();
  const bool copy = options.csv || options.ndjson || (session.json && json_is_whole);
  request.accept = options.csv                     ? "text/csv"
                   : session.json && json_is_whole ? "application/json"
                                                   : "application/x-ndjson";
  Output output(session.env, options.output);
  const bool table = !options.csv && !options.ndjson && !session.json;

  // With --json a list that the server gives in pages is made from its line stream instead: complete, one item in
  // memory.
  bool first = true;
  LineSplitter lines([&](std::string_view line) {
    if (table) {
      if (first) output.write(header_row(columns));
      output.write(json_row(columns, line));
    } else {
      output.write(first ? "{\"items\": [\n" : ",\n");
      output.write(line);
    }
    first = false;
  });
  const HttpResponse response = session.client().receive(
      request, [&](std::string_view bytes) { copy ? output.write(bytes) : lines.feed(bytes); });
  require_ok(response);
  lines.finish();
  if (session.json && copy) output.write("\n");
  if (session.json && !copy) output.write(first ? "{\"items\": [], \"next\": null}\n" : "\n], \"next\": null}\n");
  if (table && first) session.env.err << "nothing to show\n";
  output.finish();
  report_file(session, output, options.output);
  return ExitCode::kDone;
}

struct StreamEnded {
  std::string state;
};

/// The live stream. A lost connection is made again after the last event that was written: nothing twice, nothing
/// missing.
ExitCode follow(Session& session, const std::string& id, const DataOptions& options) {
  if (options.csv || options.limit) throw Failure(ExitCode::kUsage, "--follow: not together with --csv or --limit");
  Output output(session.env, options.output);
  const bool table = !options.ndjson && !session.json;
  if (table) output.write(header_row(event_columns()));
  SseParser parser;
  int failures = 0;
  const auto on_event = [&](const SseEvent& event) {
    failures = 0;
    if (event.name == "end") {
      const Json end = Json::parse(event.data, nullptr, false);
      throw StreamEnded{member_text(end, "state")};
    }
    if (event.name == "progress" || event.name == "bye" || event.name == "lagged") return;
    output.write(table ? json_row(event_columns(), event.data) : event.data + "\n");
    if (!output.is_file()) flush_out(session.env);
  };
  std::string state;
  for (;;) {
    std::string why = "the stream ended before the job did";
    try {
      HttpRequest request;
      request.target = job_target(id, "/events")
                           .add_if("after", options.after)
                           .add_if("kind", options.kind)
                           .add_if("cell_id", options.cell_id)
                           .text();
      request.accept = "text/event-stream";
      if (!parser.last_id().empty()) request.headers.emplace_back("Last-Event-ID", parser.last_id());
      parser.reconnect();
      const HttpResponse response = session.client().receive(
          request, [&](std::string_view bytes) { parser.feed(bytes, on_event); }, std::chrono::seconds(60));
      if (response.status == 204) break;
      if (response.status != 429 && response.status != 503) require_ok(response);
      if (!response.ok()) why = "the server is busy (HTTP " + std::to_string(response.status) + ")";
    } catch (const StreamEnded& ended) {
      state = ended.state;
      break;
    } catch (const NotReachable& failure) {
      if (!failure.transient() || failures >= session.env.retry.reconnects_max) throw;
      why = failure.what();
    }
    if (failures >= session.env.retry.reconnects_max) throw Failure(ExitCode::kNotReachable, why);
    RetryPolicy policy = session.env.retry;
    if (parser.retry()) policy.first = std::min(*parser.retry(), policy.max);
    session.env.err << "note: " << why << "; connecting again" << std::endl;
    session.env.interrupt.wait(retry_delay(policy, failures++));
    if (session.env.interrupt.raised()) throw Failure(ExitCode::kInterrupted, "interrupted");
  }
  output.finish();
  report_file(session, output, options.output);
  if (!state.empty()) session.env.err << "the job has ended: " << state << '\n';
  return ExitCode::kDone;
}

CLI::App* add_table_command(CLI::App& app, const char* name, const char* text, DataOptions& options) {
  CLI::App* command = app.add_subcommand(name, text);
  command->add_option("ID", options.id, "Job id, or its unique end")->required();
  command->add_flag("--ndjson", options.ndjson, "One JSON object a line, as the server sends them");
  command->add_option("-o,--output", options.output, "File (default: standard output); it appears whole or not at all");
  return command;
}

}  // namespace

void add_data_commands(CLI::App& app, Session& session, Action& action) {
  auto events = std::make_shared<DataOptions>();
  CLI::App* command = add_table_command(app, "events", "The history of a job", *events);
  command->add_flag("--csv", events->csv, "CSV");
  command->add_option("--after", events->after, "Only events after this seq");
  command->add_option("--kind", events->kind,
                      "Only events of this kind (founded, divided, inhibited, settled, moved, senesced, finished)");
  command->add_option("--cell-id", events->cell_id, "Only events of this cell");
  command->add_option("--limit", events->limit, "At most this many");
  command->add_flag("--follow", events->follow, "Go on with events as they happen, to the end of the job");
  command->callback([&session, &action, events] {
    action = [&session, events] {
      const std::string id = resolve_job_id(session, events->id);
      if (events->follow) return follow(session, id, *events);
      return fetch(session,
                   job_target(id, "/events")
                       .add_if("after", events->after)
                       .add_if("kind", events->kind)
                       .add_if("cell_id", events->cell_id)
                       .add_if("limit", events->limit),
                   *events, event_columns(), false);
    };
  });

  auto cells = std::make_shared<DataOptions>();
  command = add_table_command(app, "cells", "The cells of a colony at a time", *cells);
  command->add_flag("--csv", cells->csv, "CSV");
  command->add_option("--at-h", cells->at_h, "Model time, h (default: now, or the end)");
  command->callback([&session, &action, cells] {
    action = [&session, cells] {
      const std::string id = resolve_job_id(session, cells->id);
      return fetch(session, job_target(id, "/cells").add_if("at_h", cells->at_h), *cells, cell_columns(), true);
    };
  });

  auto log = std::make_shared<DataOptions>();
  command = add_table_command(app, "log", "What the server noted about a job", *log);
  command->callback([&session, &action, log] {
    action = [&session, log] {
      const std::string id = resolve_job_id(session, log->id);
      return fetch(session, job_target(id, "/log"), *log, log_columns(), false);
    };
  });
}

}  // namespace colony::client
