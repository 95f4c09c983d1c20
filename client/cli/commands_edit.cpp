// edit: name and labels of a job, as one merge patch.
#include <memory>
#include <optional>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/spec.hpp"

namespace colony::client {
namespace {

struct EditOptions {
  std::string id;
  std::optional<std::string> name, revision;
  std::vector<std::string> labels, removed;
  bool drops_labels = false;
};

Json patch_of(const EditOptions& options) {
  Json patch = Json::object();
  if (options.name) patch["name"] = options.name->empty() ? Json(nullptr) : Json(*options.name);
  if (options.drops_labels) {
    patch["labels"] = nullptr;
    return patch;
  }
  for (const std::string& text : options.labels) {
    const Assignment label = parse_label(text);
    patch["labels"][label.path.back()] = label.value;
  }
  for (const std::string& key : options.removed) {
    if (patch.contains("labels") && patch["labels"].contains(key))
      throw Failure(ExitCode::kUsage, "label " + printable(key) + " is both set and removed");
    patch["labels"][key] = nullptr;
  }
  return patch;
}

ExitCode edit_job(Session& session, const EditOptions& options) {
  const Json patch = patch_of(options);
  if (patch.empty()) throw Failure(ExitCode::kUsage, "nothing to change: --name, --label, --remove-label or --remove-labels");
  HttpRequest request;
  request.method = "PATCH";
  // The server compares the part before the dot alone.
  if (options.revision) {
    const std::int64_t revision = integer_option("--revision", *options.revision);
    request.headers.emplace_back("If-Match", "\"" + std::to_string(revision) + ".0\"");
  }
  request.target = job_target(resolve_job_id(session, options.id)).text();
  request.body = patch.dump();
  request.body_type = "application/merge-patch+json";
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  if (session.json) {
    session.env.out << response.body << (response.body.ends_with('\n') ? "" : "\n");
    return ExitCode::kDone;
  }
  const Json job = body_json(response);
  session.env.out << member_text(job, "id") << ": revision " << member_text(job, "revision") << ", name "
                  << member_text(job, "name");
  const Json labels = job.value("labels", Json::object());
  for (const auto& [key, value] : labels.items()) session.env.out << ", " << printable(key) << "=" << cell_text(value);
  session.env.out << '\n';
  return ExitCode::kDone;
}

}  // namespace

void add_edit_command(CLI::App& app, Session& session, Action& action) {
  auto options = std::make_shared<EditOptions>();
  CLI::App* command = app.add_subcommand("edit", "Change name and labels of a job; what is not named stays");
  command->add_option("ID", options->id, "Job id, or its unique end")->required();
  command->add_option("--name", options->name, "New name; \"\" takes it away");
  command->add_option("--label", options->labels, "Label as key=value (repeatable)")->allow_extra_args(false);
  CLI::Option* remove = command->add_option("--remove-label", options->removed, "Label to take away (repeatable)");
  remove->allow_extra_args(false);
  command->add_flag("--remove-labels", options->drops_labels, "Take all labels away")->excludes(remove)->excludes("--label");
  command->add_option("--revision", options->revision, "Only if the job is still at this revision");
  command->callback([&session, &action, options] { action = [&session, options] { return edit_job(session, *options); }; });
}

}  // namespace colony::client
