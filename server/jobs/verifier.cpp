#include "server/jobs/verifier.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <utility>

#include "engine/base/check.hpp"
#include "engine/base/version.hpp"
#include "server/store/finished_event.hpp"

namespace colony::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kPage = 1000;
constexpr std::chrono::milliseconds kTellEvery{100};

/// The store failed, or closed: not the job's fault.
struct StorageStop {};
/// The target is gone.
struct TargetGone {};
/// The next event is there and is none: the row cannot be read, and the disk is not to blame.
struct Unreadable {
  std::string message;
};

/// `finished` of a history that somebody or something ended from outside: the simulator cannot know of it.
bool is_from_outside(FinishReason reason) {
  return reason == FinishReason::kCancelled || reason == FinishReason::kLimit || reason == FinishReason::kInternal ||
         reason == FinishReason::kEngineChanged;
}

class Verification {
 public:
  Verification(const RunnerEnvironment& environment, const JobRow& job, const std::shared_ptr<LiveJob>& live)
      : env_(environment), live_(live), job_(job) {}

  RunEnd go() {
    try {
      try {
        return begin();
      } catch (const Stopped&) {
        return stop(live_->wish());
      } catch (const Unreadable& row) {
        return succeed({false, seq_, seq_ + 1, std::nullopt, std::nullopt, row.message});
      } catch (const TargetGone&) {
        return end(JobState::kFailed, FinishReason::kTargetDeleted, "job " + task_.job_id + " was deleted before it was verified");
      } catch (const std::exception& error) {
        return end(JobState::kFailed, FinishReason::kInternal, error.what());
      }
    } catch (const StorageStop&) {
      return RunEnd::kStorage;
    }
  }

 private:
  RunEnd begin();
  RunEnd compare_all(const JobRow& target);
  void fold(Simulator& simulator);
  std::optional<VerifyOutcome> compare(Simulator& simulator, const JobRow& target, const Event& stored);
  void tell(const Colony& colony);
  RunEnd stop(LiveJob::Wish wish);
  RunEnd succeed(const VerifyOutcome& outcome);
  RunEnd end(JobState state, FinishReason reason, const std::string& detail, std::string result_json = {});
  JobRow row_of(const std::string& id);
  std::vector<Event> page(std::uint64_t last);

  const RunnerEnvironment& env_;
  const std::shared_ptr<LiveJob> live_;
  JobRow job_;
  VerifyTask task_;
  std::int64_t target_key_ = 0;
  std::uint64_t seq_ = 0;  // found right so far
  Progress progress_;      // of the colony that is grown again
  Clock::time_point told_at_{};
};

RunEnd Verification::begin() {
  auto row = env_.store.find_job(job_.job_key);  // with a wish that came before this run could be notified
  if (!row) throw StorageStop{};
  job_ = std::move(*row);
  if (job_.command == "cancel") live_->ask(LiveJob::Wish::kCancel);
  if (job_.command == "pause") live_->ask(LiveJob::Wish::kPause);
  if (live_->wish() != LiveJob::Wish::kNone) return stop(live_->wish());
  const auto task = env_.verify.task(job_.spec_json);
  if (!task) throw std::runtime_error("the stored task cannot be used: " + task.error().message);
  task_ = *task;
  auto target = env_.store.find_job(task_.job_id);
  if (!target) {
    if (target.error().code == ErrorCode::kNotFound) throw TargetGone{};
    throw StorageStop{};
  }
  for (const JobRow* one : {&job_, &*target}) {
    if (results_version_of(one->engine_version) == kResultsVersion) continue;
    return end(JobState::kFailed, FinishReason::kEngineChanged,
               "job " + one->id + " was begun by version " + one->engine_version + ", which gives other results than " +
                   engine_version_text());
  }
  target_key_ = target->job_key;
  return compare_all(*target);
}

RunEnd Verification::compare_all(const JobRow& target) {
  auto stretches = env_.verify.stretches(target);
  if (!stretches) throw std::runtime_error("the stored specs cannot be used: " + stretches.error().message);
  CHECK(!stretches->empty());
  stretches->back().last_seq = task_.to_seq;
  // A fork may begin before its origin's own beginning: then it has less of the stretches before.
  for (std::size_t i = stretches->size() - 1; i > 0; --i) {
    (*stretches)[i - 1].last_seq = std::min((*stretches)[i - 1].last_seq, (*stretches)[i].last_seq);
  }
  for (Stretch& stretch : *stretches) {
    const std::uint64_t end = stretch.last_seq;
    if (seq_ >= end) continue;
    Simulator simulator(std::move(stretch.spec), live_->stop_flag(), env_.config.threads_per_job);
    fold(simulator);
    while (seq_ < end) {
      const std::vector<Event> stored = page(end);
      if (stored.empty()) {
        return succeed({false, seq_, seq_ + 1, std::nullopt, std::nullopt, "the event is missing"});
      }
      for (const Event& event : stored) {
        if (event.seq != seq_ + 1) {
          return succeed({false, seq_, seq_ + 1, std::nullopt, std::nullopt, "the event is missing"});
        }
        if (const auto difference = compare(simulator, target, event)) return succeed(*difference);
        ++seq_;
        tell(simulator.colony());
      }
    }
  }
  return succeed({true, seq_, std::nullopt, std::nullopt, std::nullopt, ""});
}

/// The events before this stretch, which were found right: as stored they lead to where it begins.
void Verification::fold(Simulator& simulator) {
  EventFilter filter;
  while (filter.after < seq_) {
    throw_if_stopped(live_->stop_flag());
    const auto events = env_.store.read_events(target_key_, filter, std::min<std::uint64_t>(kPage, seq_ - filter.after));
    if (!events) {
      if (events.error().code == ErrorCode::kNotFound) throw TargetGone{};
      throw StorageStop{};
    }
    CHECK(!events->empty());
    for (const Event& event : *events) {
      const FailureContext context("folding stored event " + std::to_string(event.seq) + " of job " + task_.job_id);
      simulator.replay(event);
    }
    filter.after = events->back().seq;
  }
}

std::vector<Event> Verification::page(std::uint64_t last) {
  EventFilter filter;
  filter.after = seq_;
  auto events = env_.store.read_events(target_key_, filter, std::min<std::uint64_t>(kPage, last - seq_));
  if (!events && events.error().code == ErrorCode::kStorage && env_.store.check_writable(0)) {
    events = env_.store.read_events(target_key_, filter, 1);  // a page with a row that is none: which one?
    if (!events && events.error().code == ErrorCode::kStorage) throw Unreadable{events.error().message};
  }
  if (events) return std::move(*events);
  if (events.error().code == ErrorCode::kNotFound) throw TargetGone{};
  throw StorageStop{};
}

std::optional<VerifyOutcome> Verification::compare(Simulator& simulator, const JobRow& target, const Event& stored) {
  const FailureContext context("deciding event " + std::to_string(stored.seq) + " of job " + task_.job_id + " again");
  const Digest before = simulator.colony().digest();
  const auto* finished = std::get_if<Finished>(&stored.body);
  std::optional<Event> made;
  if (finished != nullptr && is_from_outside(finished->reason)) {
    made = simulator.finish(finished->reason);
  } else {
    made = simulator.step();
  }
  const auto differs = [&](std::string message) -> VerifyOutcome {
    // A digest stored beside a changed content is what it was: what the content gives is then the telling one.
    const bool is_stored_digest = !made || stored.digest != made->digest;
    return {false,
            seq_,
            stored.seq,
            made ? std::optional<Digest>(made->digest) : std::nullopt,
            is_stored_digest ? stored.digest : digest_after(before, stored),
            std::move(message)};
  };
  if (!made) return differs("the history should have ended before this event");
  if (made->digest != stored.digest) return differs("the stored digest is not the one that was made again");
  if (*made != stored) return differs("the stored content is not what was made again, and does not belong to the digest beside it");
  const bool is_end_of_row = finished != nullptr && is_terminal(target.state) && target.last_seq == stored.seq;
  if (is_end_of_row && target.reason != name_of(finished->reason)) return differs("the job's row gives another reason of its end");
  return std::nullopt;
}

void Verification::tell(const Colony& colony) {
  const Clock::time_point now = Clock::now();
  if (now < told_at_ + kTellEvery && seq_ < task_.to_seq) return;
  told_at_ = now;
  progress_.time_h = colony.time_h();
  progress_.cells = colony.cells().size();
  progress_.active = colony.count(Activity::kActive);
  progress_.passive = colony.count(Activity::kPassive);
  progress_.senescent = colony.count(Activity::kSenescent);
  progress_.fraction = static_cast<double>(seq_) / static_cast<double>(task_.to_seq);
  live_->progressed(progress_);
  env_.hub.announce({job_.job_key, JobNews::Kind::kCommit});
}

RunEnd Verification::stop(LiveJob::Wish wish) {
  CHECK(wish != LiveJob::Wish::kNone);
  if (wish == LiveJob::Wish::kDrain) return RunEnd::kDrained;
  if (wish == LiveJob::Wish::kCancel) return end(JobState::kCancelled, FinishReason::kCancelled, "");
  const auto paused = env_.store.set_state(job_.job_key, {JobState::kRunning}, JobState::kPaused, "user", "");
  if (paused) return RunEnd::kDone;
  if (paused.error().code != ErrorCode::kConflict) throw StorageStop{};
  return end(JobState::kCancelled, FinishReason::kCancelled, "");  // a cancel forbids the pause: it came meanwhile
}

RunEnd Verification::succeed(const VerifyOutcome& outcome) {
  return end(JobState::kSucceeded, outcome.identical ? FinishReason::kIdentical : FinishReason::kDifferent,
             outcome.identical ? "" : "event " + std::to_string(*outcome.first_differing_seq) + ": " + outcome.message,
             env_.verify.result(outcome));
}

RunEnd Verification::end(JobState state, FinishReason reason, const std::string& detail, std::string result_json) {
  EventBatch last;
  last.job_key = job_.job_key;
  last.result_json = std::move(result_json);
  Event event = finished_event(job_, reason);
  event.time_h = progress_.time_h;
  event.body = Finished{reason, progress_.cells};
  last.events = {std::move(event)};
  last.cell_count = progress_.cells;
  last.active_count = progress_.active;
  last.passive_count = progress_.passive;
  last.senescent_count = progress_.senescent;
  const auto ended = env_.store.finish_job(last, state, std::string(name_of(reason)), detail);
  if (ended) return RunEnd::kDone;
  if (ended.error().code == ErrorCode::kInternal) throw std::runtime_error(ended.error().message);
  throw StorageStop{};
}

}  // namespace

RunEnd verify_job(const RunnerEnvironment& environment, const JobRow& job, const std::shared_ptr<LiveJob>& live) {
  return Verification(environment, job, live).go();
}

}  // namespace colony::server
