#include <algorithm>
#include <memory>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/output.hpp"
#include "client/cli/problem.hpp"
#include "client/cli/progress.hpp"
#include "client/cli/sse.hpp"

namespace colony::client {
namespace {

constexpr std::chrono::seconds kStreamSilenceMax{60};  // the server sends a comment every 15 s

/// Thrown out of the stream's sink: the job has ended, whatever the connection does next.
struct StreamEnded {};

bool is_terminal(const std::string& state) { return state == "succeeded" || state == "failed" || state == "cancelled"; }

class Watch {
 public:
  Watch(Session& session, std::string id) : session_(session), env_(session.env), id_(std::move(id)), printer_(env_) {}

  ExitCode run() {
    try {
      Json job =
          get_json(session_.client(), job_target(id_).text());  // at once or not at all; later losses are waited out
      while (!is_terminal(member_text(job, "state"))) {
        show(job);
        stream_to_end();
        job = fetch_job();
      }
      return finish(job);
    } catch (const Failure& failure) {
      printer_.clear();
      if (failure.code() != ExitCode::kInterrupted) throw;
      env_.err << "interrupted; the job goes on: `colony watch " << id_ << "` follows it again, `colony cancel " << id_
               << "` ends it" << std::endl;
      return ExitCode::kInterrupted;
    }
  }

 private:
  Json fetch_job() {
    HttpRequest request;
    request.target = job_target(id_).text();
    const HttpResponse response = session_.send_patiently(request);
    require_ok(response);
    return body_json(response);
  }

  void show(const Json& job) {
    Progress progress = progress_from(job.value("progress", Json()));
    progress.state = state_ = member_text(job, "state");
    if (!session_.json) printer_.show(progress, ProgressPrinter::Clock::now());
  }

  void on_event(const SseEvent& event) {
    failures_ = 0;
    if (event.name == "end") throw StreamEnded();
    if (event.name != "progress") return;  // bye and lagged: the connection closes, and the reconnect below follows
    const Json data = Json::parse(event.data, nullptr, false);
    if (!data.is_object())
      throw Failure(ExitCode::kRefused, "the server's stream holds a progress event that is not JSON");
    if (session_.json) {
      env_.out << data.dump() << '\n';
      flush_out(env_);
      return;
    }
    Progress progress = progress_from(data);
    if (progress.state.empty())
      progress.state = state_ == "queued" ? "running" : state_;  // progress is made by running jobs
    printer_.show(progress, ProgressPrinter::Clock::now());
  }

  /// Until the server says `end` (or 204, nothing left). A lost connection is made again with growing delays.
  void stream_to_end() {
    for (;;) {
      std::string why;
      std::chrono::milliseconds asked{0};
      try {
        HttpRequest request;
        request.target = job_target(id_, "/events").add("kind", "progress").text();
        request.accept = "text/event-stream";
        if (!parser_.last_id().empty()) request.headers.emplace_back("Last-Event-ID", parser_.last_id());
        parser_.reconnect();
        const auto sink = [&](std::string_view bytes) {
          parser_.feed(bytes, [&](const SseEvent& event) { on_event(event); });
        };
        const HttpResponse response = session_.client().receive(request, sink, kStreamSilenceMax);
        if (response.status == 204) return;
        if (response.status == 429 || response.status == 503) {
          why = "the server is busy (HTTP " + std::to_string(response.status) + ")";
          if (const auto after = response.headers.find("retry-after"); after != response.headers.end()) {
            asked = std::chrono::seconds(std::clamp<std::int64_t>(to_integer(after->second).value_or(0), 0, 3600));
          }
        } else {
          require_ok(response);
          why = "the stream ended before the job did";
        }
      } catch (const StreamEnded&) {
        return;
      } catch (const NotReachable& failure) {
        if (!failure.transient()) throw;
        why = failure.what();
      }
      wait_to_reconnect(why, asked);
    }
  }

  void wait_to_reconnect(const std::string& why, std::chrono::milliseconds asked) {
    if (failures_ >= env_.retry.reconnects_max) {
      throw Failure(ExitCode::kNotReachable,
                    why + "; gave up after " + std::to_string(failures_) + " attempts (the job may go on)");
    }
    RetryPolicy policy = env_.retry;
    if (parser_.retry()) policy.first = std::min(*parser_.retry(), policy.max);
    const auto delay = std::max(asked, retry_delay(policy, failures_));
    ++failures_;
    printer_.clear();
    env_.err << "note: " << why << "; connecting again" << std::endl;
    env_.interrupt.wait(delay);
    if (env_.interrupt.raised()) throw Failure(ExitCode::kInterrupted, "interrupted");
  }

  ExitCode finish(const Json& job) {
    printer_.clear();
    const std::string state = member_text(job, "state");
    const Json result = job.value("result", Json());
    const bool is_different = result.is_object() && result.value("identical", true) == false;
    if (session_.json) {
      env_.out << job.dump() << '\n';
    } else if (result.is_object()) {
      env_.out << (is_different ? "different" : "identical") << ": "
               << (is_different ? "event " + member_text(result, "first_differing_seq") + ", " + member_text(result, "message") + "; before it "
                                : "")
               << member_text(result, "events") << " events found the same\n";
    } else {
      const Progress progress = progress_from(job.value("progress", Json()));
      const std::string reason = member_text(job, "reason");
      env_.out << state << (reason == "-" || reason.empty() || reason == state ? "" : " (" + reason + ")") << ": "
               << progress.cells << (progress.cells == 1 ? " cell" : " cells") << " at " << fixed(progress.time_h, 2)
               << " h, digest " << member_text(job, "digest") << '\n';
      if (state == "failed" && member_text(job, "detail") != "-")
        env_.err << "error: " << member_text(job, "detail") << '\n';
    }
    if (state == "succeeded") return is_different ? ExitCode::kJobFailed : ExitCode::kDone;
    return state == "cancelled" ? ExitCode::kCancelled : ExitCode::kJobFailed;
  }

  Session& session_;
  Environment& env_;
  const std::string id_;
  ProgressPrinter printer_;
  SseParser parser_;
  std::string state_;
  int failures_ = 0;  // connections in a row that brought no event
};

}  // namespace

ExitCode watch_job(Session& session, const std::string& id) { return Watch(session, id).run(); }

void add_watch_command(CLI::App& app, Session& session, Action& action) {
  auto id = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("watch", "Follow a job to its end; Ctrl-C leaves it running");
  command->add_option("ID", *id, "Job id, or its unique end")->required();
  command->callback([&session, &action, id] {
    action = [&session, id] { return watch_job(session, resolve_job_id(session, *id)); };
  });
}

}  // namespace colony::client
