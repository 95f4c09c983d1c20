#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/spec.hpp"

namespace colony::client {
namespace {

constexpr std::size_t kSpecBytesMax = 16u << 20;  // the server's own limit is lower and its error says so

struct SubmitOptions {
  std::string file;
  std::optional<std::string> preset, seed, name, until_cells, until_time, key;
  std::vector<std::string> labels, sets;
  bool dry_run = false, watch = false, quiet = false;
};

std::string random_key() {
  std::random_device device;
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x%08x%08x", device(), device(), device(), device());
  return std::string("colony-") + text.data();
}

/// A number as it was typed must arrive as that number: 1e3 cells is no integer and the server's to refuse.
Json number_text(const std::string& option, const std::string& text) {
  if (const auto integer = to_integer(text)) return *integer;
  return number_option(option, text);
}

std::vector<Assignment> assignments_of(const SubmitOptions& options) {
  std::vector<Assignment> out;
  if (options.preset) out.push_back({{"preset"}, *options.preset, "--preset"});
  if (options.seed) out.push_back({{"seed"}, integer_option("--seed", *options.seed), "--seed"});
  if (options.name) out.push_back({{"name"}, *options.name, "--name"});
  if (options.until_cells)
    out.push_back({{"until", "cells"}, integer_option("--until-cells", *options.until_cells), "--until-cells"});
  if (options.until_time)
    out.push_back({{"until", "time_h"}, number_text("--until-time", *options.until_time), "--until-time"});
  for (const std::string& label : options.labels) out.push_back(parse_label(label));
  for (const std::string& set : options.sets) out.push_back(parse_set(set));
  return out;
}

std::string spec_body(Session& session, const SubmitOptions& options) {
  const std::vector<Assignment> assignments = assignments_of(options);
  if (options.file.empty() && assignments.empty()) {
    throw Failure(ExitCode::kUsage,
                  "nothing to submit: give a SPEC file, or flags such as --preset paper --seed 1 --until-cells 180");
  }
  std::string text = options.file.empty() ? "{}" : read_input(session.env, options.file, kSpecBytesMax);
  if (assignments.empty()) return text;  // byte for byte: its mistakes are then reported at their own place
  Json spec = parse_spec(text, options.file == "-" ? "standard input" : options.file);
  apply(assignments, spec);
  return spec.dump();
}

ExitCode dry_run(Session& session, HttpRequest request) {
  request.target = Target("/v1/jobs").add("dry_run", "true").text();
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  if (session.json) {
    session.env.out << response.body << (response.body.ends_with('\n') ? "" : "\n");
  } else {
    session.env.out << pretty(body_json(response));
  }
  return ExitCode::kDone;
}

ExitCode submit(Session& session, const SubmitOptions& options) {
  HttpRequest request;
  request.method = "POST";
  request.target = "/v1/jobs";
  request.body = spec_body(session, options);
  if (options.dry_run) return dry_run(session, request);
  const std::string id = post_new_job(session, request.target, std::move(*request.body), options.key, "submitted", options.quiet);
  return options.watch ? watch_job(session, resolve_job_id(session, id)) : ExitCode::kDone;
}

}  // namespace

std::string post_new_job(Session& session, const std::string& target, std::string body, const std::optional<std::string>& given_key,
                         const char* verb, bool quiet) {
  HttpRequest request;
  request.method = "POST";
  request.target = target;
  request.body = std::move(body);
  const std::string key = given_key ? *given_key : random_key();
  for (const char c : key) {
    if (c <= ' ' || c >= '\x7f') throw Failure(ExitCode::kUsage, "--idempotency-key: visible ASCII characters only");
  }
  if (key.empty()) throw Failure(ExitCode::kUsage, "--idempotency-key: must not be empty");
  request.headers.emplace_back("Idempotency-Key", key);

  HttpResponse response;
  try {
    response = session.send_patiently(request);
  } catch (const Failure& failure) {
    if (failure.code() != ExitCode::kNotReachable && failure.code() != ExitCode::kInterrupted) throw;
    throw Failure(failure.code(),
                  std::string(failure.what()) +
                      "\n  the job may have been stored all the same; submitting again with --idempotency-key " + key +
                      " cannot make a second one");
  }
  require_ok(response);
  const Json job = body_json(response);
  const std::string id =
      job.is_object() && job.contains("id") && job["id"].is_string() ? job["id"].get<std::string>() : "";
  if (id.empty()) throw Failure(ExitCode::kRefused, "the server's answer names no job id");
  if (session.json) {
    session.env.out << job.dump() << '\n';
  } else if (quiet) {
    session.env.out << printable(id) << '\n';
  } else {
    session.env.out << verb << (response.status == 200 ? " before: " : ": ") << printable(id) << " ("
                    << member_text(job, "state") << ")\n";
  }
  flush_out(session.env);
  return id;
}

void add_submit_command(CLI::App& app, Session& session, Action& action) {
  auto options = std::make_shared<SubmitOptions>();
  CLI::App* command = app.add_subcommand("submit", "Submit a job; a SPEC and flags merge, flags win");
  command->add_option("SPEC", options->file, "Job spec, a JSON file, or - for standard input");
  command->add_option("--preset", options->preset, "Named set of parameters (`colony info` lists them)");
  command->add_option("--seed", options->seed, "Seed of all random streams");
  command->add_option("--name", options->name, "Name, for people");
  command->add_option("--label", options->labels, "Label as key=value (repeatable)")->allow_extra_args(false);
  command->add_option("--until-cells", options->until_cells, "End at this many cells");
  command->add_option("--until-time", options->until_time, "End at this model time, h");
  command
      ->add_option("--set", options->sets,
                   "A field, as model.cycle.mean_h=10; the value is JSON, else a string (repeatable)")
      ->allow_extra_args(false);
  command->add_flag("--dry-run", options->dry_run,
                    "Only check: print the complete spec and an estimate; nothing is stored");
  command->add_option("--idempotency-key", options->key,
                      "The same key and spec never make a second job (default: a new random key)");
  command->add_flag("--watch", options->watch, "Then follow it to its end");
  command->add_flag("-q,--quiet", options->quiet, "Print the id alone");
  command->callback(
      [&session, &action, options] { action = [&session, options] { return submit(session, *options); }; });
}

}  // namespace colony::client
