#include <memory>
#include <optional>
#include <utility>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/spec.hpp"

namespace colony::client {
namespace {

struct ForkOptions {
  std::string id;
  std::optional<std::string> at_h, at_seq, seed, name, until_cells, until_h, key;
  std::vector<std::string> labels, sets;
  bool watch = false, quiet = false;
};

struct VerifyOptions {
  std::string id;
  std::optional<std::string> key;
  bool watch = false, quiet = false;
};

/// As typed: 48 stays an integer, 48.5 a number.
Json number_json(const std::string& option, const std::string& text) {
  if (const auto integer = to_integer(text)) return *integer;
  return number_option(option, text);
}

ExitCode fork(Session& session, const ForkOptions& options) {
  if (options.at_h.has_value() == options.at_seq.has_value()) {
    throw Failure(ExitCode::kUsage, "exactly one of --at-h and --at-seq says where the fork begins");
  }
  std::vector<Assignment> assignments;
  if (options.at_h) assignments.push_back({{"at_h"}, number_json("--at-h", *options.at_h), "--at-h"});
  if (options.at_seq) assignments.push_back({{"at_seq"}, integer_option("--at-seq", *options.at_seq), "--at-seq"});
  if (options.seed) assignments.push_back({{"seed"}, integer_option("--seed", *options.seed), "--seed"});
  if (options.name) assignments.push_back({{"name"}, *options.name, "--name"});
  if (options.until_cells) {
    assignments.push_back({{"until", "cells"}, integer_option("--until-cells", *options.until_cells), "--until-cells"});
  }
  if (options.until_h) assignments.push_back({{"until", "time_h"}, number_json("--until-h", *options.until_h), "--until-h"});
  for (const std::string& label : options.labels) assignments.push_back(parse_label(label));
  for (const std::string& set : options.sets) assignments.push_back(parse_set(set));
  Json body = Json::object();
  client::apply(assignments, body);
  const std::string target = job_target(resolve_job_id(session, options.id), "/fork").text();
  const std::string id = post_new_job(session, target, body.dump(), options.key, "forked", options.quiet);
  return options.watch ? watch_job(session, resolve_job_id(session, id)) : ExitCode::kDone;
}

ExitCode verify(Session& session, const VerifyOptions& options) {
  const std::string target = job_target(resolve_job_id(session, options.id), "/verify").text();
  const std::string id = post_new_job(session, target, "", options.key, "verification submitted", options.quiet);
  return options.watch ? watch_job(session, resolve_job_id(session, id)) : ExitCode::kDone;
}

}  // namespace

void add_fork_commands(CLI::App& app, Session& session, Action& action) {
  auto fork_options = std::make_shared<ForkOptions>();
  CLI::App* command = app.add_subcommand("fork", "A new job that goes on from a moment of another, otherwise");
  command->add_option("ID", fork_options->id, "Job id, or its unique end")->required();
  command->add_option("--at-h", fork_options->at_h, "Begin after all events up to this model time, h");
  command->add_option("--at-seq", fork_options->at_seq, "Begin after this event");
  command->add_option("--set", fork_options->sets, "A field, as model.cycle.mean_h=10; the value is JSON, else a string (repeatable)")
      ->allow_extra_args(false);
  command->add_option("--seed", fork_options->seed, "Seed from there on (default: the origin's)");
  command->add_option("--until-h,--until-time", fork_options->until_h, "End at this model time, h");
  command->add_option("--until-cells", fork_options->until_cells, "End at this many cells");
  command->add_option("--name", fork_options->name, "Name, for people");
  command->add_option("--label", fork_options->labels, "Label as key=value (repeatable)")->allow_extra_args(false);
  command->add_option("--idempotency-key", fork_options->key, "The same key and fork never make a second job (default: a new random key)");
  command->add_flag("--watch", fork_options->watch, "Then follow it to its end");
  command->add_flag("-q,--quiet", fork_options->quiet, "Print the id alone");
  command->callback(
      [&session, &action, fork_options] { action = [&session, fork_options] { return fork(session, *fork_options); }; });

  auto verify_options = std::make_shared<VerifyOptions>();
  command = app.add_subcommand("verify", "Grow a job again and compare every event; with --watch: exit 0 identical, 1 different");
  command->add_option("ID", verify_options->id, "Job id, or its unique end")->required();
  command->add_option("--idempotency-key", verify_options->key, "The same key never makes a second job (default: a new random key)");
  command->add_flag("--watch", verify_options->watch, "Then follow it to its end");
  command->add_flag("-q,--quiet", verify_options->quiet, "Print the id alone");
  command->callback([&session, &action, verify_options] {
    action = [&session, verify_options] { return verify(session, *verify_options); };
  });
}

}  // namespace colony::client
