#include "server/jobs/runner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/base/version.hpp"
#include "server/store/finished_event.hpp"

namespace colony::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kReplayPage = 2000;
constexpr std::size_t kBatchEvents = 200;
constexpr std::chrono::milliseconds kBatchAge{20};  // then a live watcher sees it, also when searches are slow

/// The store failed, or closed: not the job's fault.
struct StorageStop {};

/// The first failure among the commits of one run; shared with the writer's thread.
class Commits {
 public:
  void fail(const Error& error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = error;
  }
  /// A refused row is a bug and fails the job; anything else is the store's trouble.
  void check() const {
    const std::lock_guard lock(mutex_);
    if (!error_) return;
    if (error_->code == ErrorCode::kInternal) throw std::runtime_error(error_->message);
    throw StorageStop{};
  }

 private:
  mutable std::mutex mutex_;  // guards everything below
  std::optional<Error> error_;
};

class Run {
 public:
  Run(const RunnerEnvironment& environment, const JobRow& job, const std::shared_ptr<LiveJob>& live)
      : env_(environment), live_(live), tail_(job) {}

  RunEnd go();

 private:
  RunEnd begin();
  bool replay();  // false: asked to stop
  RunEnd grow();
  void keep_pace();
  RunEnd stop(LiveJob::Wish wish);
  RunEnd end(JobState state, const std::string& reason, const std::string& detail);
  RunEnd end_from_outside(JobState state, FinishReason reason, const std::string& detail);
  RunEnd fail_as_stored(const std::string& reason, FinishReason finish_reason, const std::string& detail);
  void take(Event event);
  void append();
  void settle_commits();
  JobRow reread();
  EventBatch take_batch();
  std::string replay_hint(std::uint64_t from) const {
    return "to replay: the job's spec, its stored events before " + std::to_string(from) + ", then one step";
  }

  const RunnerEnvironment& env_;
  const std::shared_ptr<LiveJob> live_;
  JobRow tail_;  // the row as it will be when everything taken is committed
  std::unique_ptr<Simulator> simulator_;
  std::optional<SeriesTracker> tracker_;  // at the event that was taken last; there once stored events are folded
  std::uint64_t next_hour_ = 0;           // first whole model hour without a series row
  std::vector<Event> events_;             // taken, not yet given to the store
  std::vector<SeriesRow> series_;
  Clock::time_point batch_since_{};
  Clock::time_point pace_due_{};          // of the next event, where there is a pace
  const std::shared_ptr<Commits> commits_ = std::make_shared<Commits>();
};

JobRow Run::reread() {
  auto row = env_.store.find_job(tail_.job_key);
  if (!row) throw StorageStop{};
  return std::move(*row);
}

RunEnd Run::go() {
  try {
    try {
      return begin();
    } catch (const std::exception& error) {
      // What was decided before the failure is sound, and shows how far the job came; if it cannot be stored, so be it.
      append();
      if (!env_.store.flush()) throw StorageStop{};
      return fail_as_stored("internal", FinishReason::kInternal,
                            std::string(error.what()) + "; " + replay_hint(tail_.last_seq + 1));
    }
  } catch (const StorageStop&) {
    (void)env_.store.flush();  // its answer is no news; after it no callback of ours is left
    return RunEnd::kStorage;
  }
}

RunEnd Run::begin() {
  tail_ = reread();  // with a wish that came before this run could be notified
  if (tail_.command == "cancel") live_->ask(LiveJob::Wish::kCancel);
  if (tail_.command == "pause") live_->ask(LiveJob::Wish::kPause);
  if (live_->wish() != LiveJob::Wish::kNone) return stop(live_->wish());
  if (results_version_of(tail_.engine_version) != kResultsVersion) {
    return fail_as_stored(
        "engine_changed", FinishReason::kEngineChanged,
        "begun by version " + tail_.engine_version + ", which gives other results than " + engine_version_text());
  }
  auto spec = env_.decode(tail_.spec_json);
  if (!spec)
    return fail_as_stored("internal", FinishReason::kInternal,
                          "the stored spec cannot be used: " + spec.error().message);
  simulator_ = std::make_unique<Simulator>(std::move(*spec), live_->stop_flag(), env_.config.threads_per_job);
  if (tail_.last_seq > 0 && !replay()) return stop(live_->wish());
  tracker_.emplace(simulator_->colony());
  return grow();
}

bool Run::replay() {
  EventFilter filter;
  while (filter.after < tail_.last_seq) {
    if (live_->wish() != LiveJob::Wish::kNone) return false;
    const auto page = env_.store.read_events(tail_.job_key, filter, kReplayPage);
    if (!page) throw StorageStop{};
    CHECK(!page->empty());  // last_seq says that there are more
    for (const Event& event : *page) {
      const FailureContext context("folding stored event " + std::to_string(event.seq) + " of job " + tail_.id);
      simulator_->replay(event);
    }
    filter.after = page->back().seq;
  }
  const Colony& colony = simulator_->colony();
  CHECK(colony.last_seq() == tail_.last_seq);
  CHECK(colony.digest() == tail_.digest);
  next_hour_ = static_cast<std::uint64_t>(std::ceil(tail_.time_h));  // every hour before the last event has its row
  const Status logged = env_.store.add_log(
      tail_.job_key, "info",
      "goes on after " + std::to_string(tail_.last_seq) + " stored events, digest " + tail_.digest.hex());
  if (!logged) throw StorageStop{};
  return true;
}

RunEnd Run::grow() {
  for (;;) {
    commits_->check();
    if (const LiveJob::Wish wish = live_->wish(); wish != LiveJob::Wish::kNone) return stop(wish);
    std::optional<Event> event;
    try {
      const FailureContext context("deciding event " + std::to_string(tail_.last_seq + 1) + " of job " + tail_.id);
      event = simulator_->step();
    } catch (const Stopped&) {
      CHECK(live_->wish() != LiveJob::Wish::kNone);  // else this loop would turn for ever
      continue;
    }
    CHECK(event.has_value());  // `finished` comes first, and ends this loop
    const bool finished = event->kind() == EventKind::kFinished;
    take(std::move(*event));
    if (finished) {
      return end(JobState::kSucceeded, std::string(name_of(simulator_->colony().finished()->reason)), "");
    }
    if (tail_.cell_count > env_.config.cells_max) {
      return end_from_outside(JobState::kFailed, FinishReason::kLimit,
                              "more than " + std::to_string(env_.config.cells_max) + " cells (limits.cells_max)");
    }
    if (tail_.last_seq >= env_.config.events_max) {
      return end_from_outside(JobState::kFailed, FinishReason::kLimit,
                              "more than " + std::to_string(env_.config.events_max) + " events (limits.events_max)");
    }
    if (events_.size() >= kBatchEvents || Clock::now() >= batch_since_ + kBatchAge) append();
    if (env_.config.events_per_s_max > 0) keep_pace();
  }
}

// Sleeps in short steps, so that neither a wish nor the batch begun waits for a slow pace. What a long search has missed is caught up with,
// but no more than a second of it.
void Run::keep_pace() {
  const auto step = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1.0 / static_cast<double>(env_.config.events_per_s_max)));
  pace_due_ = std::max(pace_due_, Clock::now() - std::chrono::seconds(1)) + step;
  while (live_->wish() == LiveJob::Wish::kNone) {
    const auto now = Clock::now();
    if (now >= pace_due_) return;
    if (!events_.empty() && now >= batch_since_ + kBatchAge) append();
    std::this_thread::sleep_until(std::min<Clock::time_point>(pace_due_, now + kBatchAge));
  }
}

void Run::take(Event event) {
  const Colony& colony = simulator_->colony();
  const bool finished = event.kind() == EventKind::kFinished;
  const auto passed = [&](std::uint64_t hour) {
    return static_cast<double>(hour) < event.time_h || (finished && static_cast<double>(hour) == event.time_h);
  };
  // A row belongs to the last state at or before its hour. This event has destroyed that state; the tracker still holds it.
  for (; passed(next_hour_); ++next_hour_) series_.push_back(tracker_->row(static_cast<double>(next_hour_)));
  tracker_->follow(event, colony);
  tail_.last_seq = event.seq;
  tail_.time_h = event.time_h;
  tail_.digest = event.digest;
  tail_.cell_count = colony.cells().size();
  tail_.active_count = colony.count(Activity::kActive);
  tail_.passive_count = colony.count(Activity::kPassive);
  tail_.senescent_count = colony.count(Activity::kSenescent);
  if (events_.empty()) {
    events_.reserve(kBatchEvents);
    batch_since_ = Clock::now();
  }
  events_.push_back(std::move(event));
}

EventBatch Run::take_batch() {
  EventBatch batch;
  batch.job_key = tail_.job_key;
  batch.events = std::exchange(events_, {});
  batch.series = std::exchange(series_, {});
  batch.cell_count = tail_.cell_count;
  batch.active_count = tail_.active_count;
  batch.passive_count = tail_.passive_count;
  batch.senescent_count = tail_.senescent_count;
  return batch;
}

void Run::append() {
  if (events_.empty()) return;
  // The run settles its commits before it returns, so the hub is there as long as this callback can come.
  env_.store.append_events(take_batch(),
                           [commits = commits_, live = live_, &hub = env_.hub, stored = tail_](const Status& status) {
                             if (!status) {
                               commits->fail(status.error());
                               return;
                             }
                             live->committed(stored);
                             hub.announce({stored.job_key, JobNews::Kind::kCommit});
                           });
}

void Run::settle_commits() {
  const Status flushed = env_.store.flush();
  if (!flushed) throw StorageStop{};
  commits_->check();
}

RunEnd Run::stop(LiveJob::Wish wish) {
  if (wish == LiveJob::Wish::kCancel) return end_from_outside(JobState::kCancelled, FinishReason::kCancelled, "");
  append();
  settle_commits();
  if (wish == LiveJob::Wish::kDrain) return RunEnd::kDrained;
  const auto paused = env_.store.set_state(tail_.job_key, {JobState::kRunning}, JobState::kPaused, "user", "");
  if (paused) return RunEnd::kDone;
  if (paused.error().code != ErrorCode::kConflict) throw StorageStop{};
  CHECK(reread().command == "cancel");  // the one thing that forbids a pause, and it came meanwhile
  return end_from_outside(JobState::kCancelled, FinishReason::kCancelled, "");
}

RunEnd Run::end_from_outside(JobState state, FinishReason reason, const std::string& detail) {
  events_.push_back(finished_event(tail_, reason));
  ++tail_.last_seq;
  return end(state, std::string(name_of(reason)), detail);
}

RunEnd Run::end(JobState state, const std::string& reason, const std::string& detail) {
  const auto ended = env_.store.finish_job(take_batch(), state, reason, detail);
  if (ended) {
    live_->committed(*ended);
    return RunEnd::kDone;
  }
  if (ended.error().code == ErrorCode::kInternal) throw std::runtime_error(ended.error().message);
  throw StorageStop{};
}

/// Ends the job at its last stored event, whatever became of the simulator.
RunEnd Run::fail_as_stored(const std::string& reason, FinishReason finish_reason, const std::string& detail) {
  tail_ = reread();
  EventBatch last;
  last.job_key = tail_.job_key;
  last.events = {finished_event(tail_, finish_reason)};
  last.cell_count = tail_.cell_count;
  last.active_count = tail_.active_count;
  last.passive_count = tail_.passive_count;
  last.senescent_count = tail_.senescent_count;
  const auto ended = env_.store.finish_job(last, JobState::kFailed, reason, detail);
  if (!ended) throw StorageStop{};
  live_->committed(*ended);
  return RunEnd::kDone;
}

}  // namespace

RunEnd run_job(const RunnerEnvironment& environment, const JobRow& job, const std::shared_ptr<LiveJob>& live) {
  return Run(environment, job, live).go();
}

}  // namespace colony::server
