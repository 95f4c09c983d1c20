#include "client/cli/app.hpp"

#include <algorithm>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/failure.hpp"
#include "client/cli/output.hpp"
#include "client/cli/session.hpp"

namespace colony::client {

std::int64_t integer_option(const std::string& option, const std::string& text) {
  const auto value = to_integer(text);
  if (!value) throw Failure(ExitCode::kUsage, option + ": '" + printable(text) + "' is not an integer");
  return *value;
}

double number_option(const std::string& option, const std::string& text) {
  const auto value = to_number(text);
  if (!value) throw Failure(ExitCode::kUsage, option + ": '" + printable(text) + "' is not a finite number");
  return *value;
}

namespace {

/// The word that stands where a command should, if it is none (CLI11 only says that a subcommand is required).
std::optional<std::string> unknown_command(const CLI::App& app, const std::vector<std::string>& arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--server" || arguments[i] == "--ca-file") {
      ++i;  // its value is no command
      continue;
    }
    if (arguments[i].empty() || arguments[i][0] == '-') continue;
    const auto has_name = [&](const CLI::App* command) { return command->get_name() == arguments[i]; };
    if (app.get_subcommands(has_name).empty()) return arguments[i];
    break;
  }
  return std::nullopt;
}

}  // namespace

int run(const std::vector<std::string>& arguments, Environment& env) {
  CLI::App app("colony: grow cell colonies on a colonyd server", "colony");
  app.require_subcommand(1);
  app.fallthrough();  // global options may stand after the subcommand
  app.footer(
      "The server: --server, else COLONY_SERVER, else ~/.config/colony/config.toml, else http://127.0.0.1:8080.\n"
      "COLONY_TOKEN is sent as a bearer token, to https or this machine only; COLONY_CA_FILE as --ca-file.\n"
      "Exit: 0 done, 1 job failed, 2 usage, 3 not reachable, 4 refused by the server, 5 job cancelled, 130 "
      "interrupted.");
  Session session(env);
  Action action;
  app.add_option("--server", session.server_flag, "URL of the server");
  app.add_option("--ca-file", session.ca_file_flag, "PEM file of certificates to trust for https");
  app.add_flag("--json", session.json, "Print the server's JSON");
  app.set_version_flag("--version", COLONY_VERSION);
  add_submit_command(app, session, action);
  add_fork_commands(app, session, action);
  add_watch_command(app, session, action);
  add_job_commands(app, session, action);
  add_edit_command(app, session, action);
  add_data_commands(app, session, action);
  add_picture_commands(app, session, action);
  add_measure_commands(app, session, action);
  add_analysis_commands(app, session, action);
  add_report_command(app, session, action);
  add_founders_command(app, session, action);
  add_token_commands(app, session, action);

  ExitCode code = ExitCode::kDone;
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());  // the order CLI11 takes them in
    app.parse(reversed);
    code = action();
    flush_out(env);
  } catch (const CLI::Success& wanted) {  // --help, --version
    app.exit(wanted, env.out, env.err);
  } catch (const CLI::ParseError& wrong) {
    const std::optional<std::string> unknown = unknown_command(app, arguments);
    env.err << "error: " << (unknown ? "there is no command '" + printable(*unknown) + "'" : wrong.what()) << "\n  `colony --help` or `colony COMMAND --help` shows what there is\n";
    code = ExitCode::kUsage;
  } catch (const Json::exception&) {  // a member of another type than the interface says
    env.err
        << "error: the server's answer is not what its interface promises (is this a colony server of this version?)"
        << std::endl;
    code = ExitCode::kRefused;
  } catch (const Failure& failure) {
    env.out.flush();
    env.err << "error: " << failure.what() << std::endl;
    code = failure.code();
  }
  return static_cast<int>(code);
}

}  // namespace colony::client
