// commands: what `colony` can do. Each function declares its subcommands; the chosen one sets `action`, which app.cpp
// then runs. Errors: Failure (failure.hpp). An action returns the exit code.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "client/cli/session.hpp"

namespace colony::client {

using Action = std::function<ExitCode()>;

void add_job_commands(CLI::App& app, Session& session,
                      Action& action);  // list counts show cancel pause resume delete info
void add_edit_command(CLI::App& app, Session& session, Action& action);
void add_submit_command(CLI::App& app, Session& session, Action& action);
void add_fork_commands(CLI::App& app, Session& session, Action& action);     // fork verify
void add_watch_command(CLI::App& app, Session& session, Action& action);
void add_data_commands(CLI::App& app, Session& session, Action& action);     // events cells log
void add_picture_commands(CLI::App& app, Session& session, Action& action);  // series image
void add_measure_commands(CLI::App& app, Session& session, Action& action);  // lineage mesh measure analyze compare
void add_analysis_commands(CLI::App& app, Session& session, Action& action);  // analyses comparisons, one of them, deletion
void add_report_command(CLI::App& app, Session& session, Action& action);
void add_token_commands(CLI::App& app, Session& session, Action& action);  // tokens list, create, delete
void add_founders_command(CLI::App& app, Session& session, Action& action);

/// POSTs what makes a job, with an idempotency key (a random one if none is given), patiently; prints the job after `verb`. Its id.
std::string post_new_job(Session& session, const std::string& target, std::string body, const std::optional<std::string>& key,
                         const char* verb, bool quiet);

/// Follows a job to its end. Exit code: kDone, kJobFailed or kCancelled by its state; kInterrupted leaves it running. A verification
/// that found a difference is kJobFailed too.
ExitCode watch_job(Session& session, const std::string& id);

/// An option's text as a number. Failure kUsage naming the option (CLI11 would read "010" as eight).
std::int64_t integer_option(const std::string& option, const std::string& text);
double number_option(const std::string& option, const std::string& text);

}  // namespace colony::client
