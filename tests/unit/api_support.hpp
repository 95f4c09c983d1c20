// api_support: a JobService of fixed answers and requests without sockets, for the tests of server/api.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/version.hpp"
#include "engine/sim/simulator.hpp"
#include "server/api/api.hpp"
#include "server/http/router.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::testing {

inline constexpr const char* kJobId = "01890000-0000-7000-8000-000000000001";

/// One job with a real history, grown by the engine; every call is counted by what it would change.
class FakeJobs : public JobService {
 public:
  FakeJobs() {
    spec.seed = 3;
    spec.params = *preset("paper");
    spec.until.cells = 6;
    spec.until.time_h = 1000.0;
    Simulator simulator(spec);
    while (auto event = simulator.step()) history.push_back(*event);
    row.job_key = 1;
    row.id = kJobId;
    row.name = "fake";
    row.labels = {{"plate", "7"}};
    row.state = JobState::kSucceeded;
    row.reason = "cells";
    row.submitted_by = "local";
    row.created_at = row.started_at = row.finished_at = "2026-01-02T03:04:05.678Z";
    row.engine_version = engine_version_text();
    row.last_seq = history.back().seq;
    row.digest = history.back().digest;
    api::JobSpec job_spec;
    job_spec.run = spec;
    row.spec_json = api::to_text(api::encode_spec(job_spec));
    progress = {row.last_seq, history.back().time_h, 6, 6, 0, 0, 1.0, std::nullopt, std::nullopt};
  }

  RunSpec spec;
  std::vector<Event> history;
  std::size_t stored = SIZE_MAX;  // events visible so far
  JobRow row;
  Progress progress;
  std::vector<NewJob> submitted;
  std::map<std::string, std::string> keys;  // idempotency key to body hash
  std::optional<Error> next_error;          // answered by the next command or submission
  std::function<void()> before_acting;      // what others do just before a command or removal
  std::function<void()> waker;
  std::function<void(const JobNews&)> hearer;  // of the last follow()
  std::optional<std::int64_t> followed_key;
  int folds = 0;  // calls of colony_at and series, but for those of moment
  JobTextChange asked_change;
  std::optional<std::vector<std::uint64_t>> asked_revisions;
  std::string asked_actor;
  std::optional<std::string> asked_cursor;
  JobFilter asked_filter;
  std::size_t asked_limit = 0;
  std::string last_actor;

  /// last_seq is that of the last event visible.
  JobView view() const {
    JobView view{row, progress};
    const std::size_t visible = std::min(stored, history.size());
    view.job.last_seq = view.progress.last_seq = visible == 0 ? 0 : history[visible - 1].seq;
    return view;
  }
  Status start() override { return Ok{}; }
  void drain() override {}
  Result<Submitted> submit(const NewJob& job) override {
    if (next_error) return *std::exchange(next_error, std::nullopt);
    if (!job.idempotency_key.empty()) {
      const auto [at, is_new] = keys.emplace(job.idempotency_key, job.body_hash);
      if (!is_new && at->second != job.body_hash)
        return Error{ErrorCode::kKeyReused, "the key was used with another body"};
      if (!is_new) return Submitted{view(), false};
    }
    submitted.push_back(job);
    return Submitted{view(), true};
  }
  Result<std::optional<JobView>> submitted_before(const NewJob& job) override {
    const auto at = keys.find(job.idempotency_key);
    if (job.idempotency_key.empty() || at == keys.end()) return std::optional<JobView>();
    if (at->second != job.body_hash) return Error{ErrorCode::kKeyReused, "the key was used with another body"};
    return std::optional<JobView>(view());
  }
  Result<ForkPoint> fork_point(const std::string& id, std::optional<double> at_h,
                               std::optional<std::uint64_t> at_seq) override {
    if (id != row.id) return missing(id);
    std::uint64_t seq = at_seq.value_or(history.back().seq - 1);
    auto colony = std::make_shared<Colony>(spec.params);
    for (const Event& event : history) {
      if (event.seq <= seq && (!at_h || event.time_h <= *at_h)) colony->apply(event);
    }
    return ForkPoint{row, colony->last_seq(), {colony, std::make_shared<RunSpec>(spec), colony->time_h(), colony->digest()}};
  }
  Result<Submitted> fork(const NewJob& job, const ForkPoint&) override { return submit(job); }
  Result<JobView> show(const std::string& id) override {
    if (id != row.id) return missing(id);
    return view();
  }
  /// Tests change the row without a commit: nothing that was read stands.
  std::uint64_t commit_count() const override { return does_commit ? ++commits : commits.load(); }
  mutable std::atomic<std::uint64_t> commits{0};
  bool does_commit = true;
  Result<JobView> show(std::int64_t job_key) override {
    if (job_key != row.job_key) return missing(std::to_string(job_key));
    return view();
  }
  std::optional<Progress> live_progress(std::int64_t job_key) override {
    return job_key == row.job_key && row.state == JobState::kRunning ? std::optional(progress) : std::nullopt;
  }
  Result<Page> list(const JobFilter& filter, std::size_t limit, const std::string& cursor) override {
    asked_filter = filter;
    // What the stream of a page asks for.
    if (filter.state && !filter.kind) return *filter.state == row.state ? Page{{view()}, std::nullopt} : Page{};
    asked_limit = limit;
    asked_cursor = cursor;
    if (cursor == "made-up")
      return Error{ErrorCode::kInvalid, "the cursor is not one of ours", {{"cursor", "made up"}}};
    return Page{{view()}, cursor.empty() ? std::optional<std::string>("a cursor&") : std::nullopt};
  }
  Result<std::vector<std::uint64_t>> counts() override { return std::vector<std::uint64_t>{1, 2, 3, 4, 5, 6}; }
  Result<Commanded> cancel(const std::string& id, const std::string& actor, const RevisionCondition& condition) override {
    return command(id, actor, condition);
  }
  Result<Commanded> pause(const std::string& id, const std::string& actor, const RevisionCondition& condition) override {
    return command(id, actor, condition);
  }
  Result<Commanded> resume(const std::string& id, const std::string& actor, const RevisionCondition& condition) override {
    return command(id, actor, condition);
  }
  Result<Removed> remove(const std::string& id, const RevisionCondition& condition) override {
    const auto done = command(id, {}, condition);
    if (!done) return done.error();
    return Removed{done->view.job, done->is_current};
  }
  Result<std::vector<Event>> events(const std::string& id, const EventFilter& filter, std::size_t limit) override {
    if (id != row.id) return missing(id);
    std::vector<Event> out;
    for (std::size_t i = 0; i < std::min(stored, history.size()) && out.size() < limit; ++i) {
      const Event& event = history[i];
      const bool fits = filter.kinds.empty() ||
                        std::find(filter.kinds.begin(), filter.kinds.end(), event.kind()) != filter.kinds.end();
      if (event.seq > filter.after && fits) out.push_back(event);
    }
    return out;
  }
  Result<Edited> edit(const std::string& id, const JobTextChange& change,
                      const RevisionCondition& condition, const std::string& actor) override {
    if (id != row.id) return missing(id);
    asked_change = change;
    asked_revisions = condition.one_of;
    asked_actor = actor;
    if (next_error) return *std::exchange(next_error, std::nullopt);
    const bool fits = condition.holds(row.revision);
    if (fits) ++row.revision;
    return Edited{view(), fits, fits};
  }
  Result<std::optional<std::uint64_t>> page_end(const std::string& id, const EventFilter& filter,
                                                std::size_t limit) override {
    const auto found = events(id, filter, limit + 1);
    if (!found) return found.error();
    return found->size() > limit ? std::optional((*found)[limit - 1].seq) : std::nullopt;
  }
  Result<Moment> moment(const std::string& id, std::optional<double> at_h) override {
    const auto at = colony_at(id, at_h);  // dear here, but the same by its nature
    --folds;
    if (!at) return at.error();
    return Moment{row, at->colony->last_seq(), at->digest};
  }
  Result<std::vector<LogRow>> log(const std::string& id, std::int64_t after, std::size_t) override {
    if (id != row.id) return missing(id);
    if (after > 0) return std::vector<LogRow>{};
    return std::vector<LogRow>{{1, "2026-01-02T03:04:05.678Z", "info", "submitted", {}}};
  }
  Result<ColonyAt> colony_at(const std::string& id, std::optional<double> at_h) override {
    ++folds;
    if (id != row.id) return missing(id);
    if (at_h && *at_h > 1e6) return Error{ErrorCode::kNotReached, "not there yet", {{"at_h", "beyond"}}};
    auto colony = std::make_shared<Colony>(spec.params);
    for (const Event& event : history) {
      if (!at_h || event.time_h <= *at_h) colony->apply(event);
    }
    return ColonyAt{colony, std::make_shared<RunSpec>(spec), colony->time_h(), colony->digest()};
  }
  Result<std::vector<SeriesRow>> series(const std::string& id, std::size_t points) override {
    if (id != row.id) return missing(id);
    ++folds;
    std::vector<SeriesRow> rows(points);
    for (std::size_t i = 0; i < points; ++i) rows[i].time_h = 0.1 * static_cast<double>(i);
    return rows;
  }
  std::unique_ptr<Subscription> follow(std::optional<std::int64_t> job_key,
                                       std::function<void(const JobNews&)> hear) override {
    followed_key = job_key;
    hearer = std::move(hear);
    return std::make_unique<Subscription>();
  }
  std::unique_ptr<Subscription> subscribe(std::int64_t, std::function<void()> wake) override {
    waker = std::move(wake);
    return std::make_unique<Subscription>();
  }
  /// A real one, empty, in a folder of its own: only /readyz asks it.
  Store& store() override {
    if (!store_) {
      std::string folder = (std::filesystem::temp_directory_path() / "colony-api-XXXXXX").string();
      CHECK(mkdtemp(folder.data()) != nullptr);
      folder_ = folder;
      StoreConfig config;
      config.data_dir = folder;
      auto opened = Store::open(config);
      CHECK(static_cast<bool>(opened));
      store_ = std::move(*opened);
    }
    return *store_;
  }
  ~FakeJobs() override {
    store_.reset();
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

 private:
  std::unique_ptr<Store> store_;
  std::string folder_;

  static Error missing(const std::string& id) { return {ErrorCode::kNotFound, "there is no job '" + id + "'"}; }
  Result<Commanded> command(const std::string& id, const std::string& actor, const RevisionCondition& condition) {
    if (id != row.id) return missing(id);
    if (before_acting) before_acting();
    if (!condition.holds(row.revision)) return Commanded{view(), false, false};
    last_actor = actor;
    if (next_error) return *std::exchange(next_error, std::nullopt);
    return Commanded{view(), true};
  }
};

/// A router over the fake, and short ways to ask it.
class ApiFixture {
 public:
  explicit ApiFixture(api::ApiConfig with = config()) : api_(jobs, tokens, std::move(with)) { api_.add_routes(router_); }
  FakeJobs jobs;
  http::TokenTable tokens;
  http::Principal principal;
  std::shared_ptr<std::atomic<bool>> gives_up;  // of every request; null: nobody says

  static api::ApiConfig config() {
    api::ApiConfig config;
    config.version = "0.1.0";
    return config;
  }

  api::Api& api() { return api_; }

  http::Response ask(std::string method, const std::string& target,
                     std::vector<std::pair<std::string, std::string>> headers = {}, std::string body = {}) {
    http::Request request;
    request.method = std::move(method);
    const std::size_t mark = target.find('?');
    request.path = target.substr(0, mark);
    if (mark != std::string::npos) {
      for (const std::string& pair : api::split(target.substr(mark + 1), '&')) {
        const std::size_t equals = pair.find('=');
        request.query.emplace_back(pair.substr(0, equals), equals == std::string::npos ? "" : pair.substr(equals + 1));
      }
    }
    for (const auto& [name, value] : headers) request.headers.add(name, value);
    request.body = std::move(body);
    request.request_id = "request-1";
    request.principal = principal;
    request.gives_up = gives_up;
    return router_.dispatch(request);
  }
  http::Response get(const std::string& target, std::vector<std::pair<std::string, std::string>> headers = {}) {
    return ask("GET", target, std::move(headers));
  }
  http::Response post(const std::string& target, std::string body,
                      std::vector<std::pair<std::string, std::string>> headers = {}) {
    headers.emplace_back("Content-Type", "application/json");
    return ask("POST", target, std::move(headers), std::move(body));
  }

 private:
  api::Api api_;
  http::Router router_;
};

/// The whole body; CHECKs that a stream does not wait.
inline std::string body_of(http::Response& response) {
  if (!response.stream) return response.body;
  std::string out;
  for (;;) {
    const auto pulled = response.stream->pull(out);
    CHECK(pulled != http::BodySource::Pull::kWait);
    if (pulled == http::BodySource::Pull::kEnd) return out;
  }
}

inline api::Json json_of(http::Response& response) { return api::Json::parse(body_of(response)); }

/// What a problem points at.
inline std::vector<std::string> faults(http::Response& response) {
  std::vector<std::string> out;
  const api::Json problem = json_of(response);
  if (!problem.contains("errors")) return out;
  for (const api::Json& error : problem["errors"]) {
    out.push_back(error.contains("pointer") ? error["pointer"] : error["parameter"]);
  }
  return out;
}

inline std::string header(const http::Response& response, std::string_view name) {
  return std::string(response.headers.get(name).value_or(""));
}

/// `text` cut at every `end`.
inline std::vector<std::string> split_lines(const std::string& text, const std::string& end) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t stop = text.find(end, at);
    lines.push_back(text.substr(at, stop - at));
    at = stop == std::string::npos ? text.size() : stop + end.size();
  }
  return lines;
}

/// The path of the fixture's job.
inline const std::string kJob = std::string("/v1/jobs/") + kJobId;

}  // namespace colony::server::testing
