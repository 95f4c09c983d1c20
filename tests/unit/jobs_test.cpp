// The job service over the real store and the real simulator: growth, commands, restarts, failures, views of the past.
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include <gtest/gtest.h>

#include "engine/base/version.hpp"
#include "server/jobs/service.hpp"
#include "tests/support/failing_store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using tests::FailingStore;
using tests::Gate;
using tests::TempDir;

/// "<seed> <cells>": preset paper to so many cells; "bad": a spec that cannot be used; "<seed> <cells> 0": a spec that the
/// decoder lets pass and the simulator does not; "<seed> <cells> 1 <founders>": so many founders in a dish with room for them.
Result<RunSpec> decode(const std::string& text) {
  RunSpec spec;
  spec.params = *preset("paper");
  unsigned long long seed = 0, cells = 0;
  int broken = 1;
  long long founders = 1;
  if (std::sscanf(text.c_str(), "%llu %llu %d %lld", &seed, &cells, &broken, &founders) < 2)
    return Error{ErrorCode::kInvalid, "not a spec"};
  spec.seed = seed;
  spec.until.cells = cells;
  if (founders > 1) {
    spec.params.founders.count = founders;
    spec.params.founders.radius_um = 10'000.0;
  }
  if (broken == 0) spec.params.cycle.mean_h = -1.0;
  return spec;
}

NewJob new_job(std::uint64_t seed, std::uint64_t cells) {
  NewJob job;
  job.name = "test";
  job.spec_json = std::to_string(seed) + " " + std::to_string(cells);
  job.until_cells = cells;
  return job;
}

/// Waits for a job by its announcements alone.
class Watch {
 public:
  Watch(JobService& service, std::string id) : service_(service), id_(std::move(id)) {
    subscription_ = service_.subscribe(service_.show(id_)->job.job_key, [this] {
      const std::lock_guard lock(mutex_);
      ++wakes_;
      changed_.notify_all();
    });
  }
  template <class Condition>
  JobView until(Condition condition) {
    for (;;) {
      std::uint64_t seen = 0;
      {
        const std::lock_guard lock(mutex_);
        seen = wakes_;
      }
      const auto view = service_.show(id_);
      EXPECT_TRUE(view);
      if (!view || condition(*view)) return *view;
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return wakes_ != seen; });
    }
  }
  JobView until_ended() {
    return until([](const JobView& view) { return is_terminal(view.job.state); });
  }
  JobView until_seq(std::uint64_t seq) {
    return until([=](const JobView& view) { return view.progress.last_seq >= seq || is_terminal(view.job.state); });
  }

 private:
  JobService& service_;
  const std::string id_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t wakes_ = 0;
  std::unique_ptr<JobService::Subscription> subscription_;
};

class JobsTest : public testing::Test {
 protected:
  void SetUp() override { open(); }
  void open(JobsConfig config = {}) {
    service_.reset();
    store_.reset();
    StoreConfig store_config;
    store_config.data_dir = dir_.path();
    auto store = Store::open(store_config);
    ASSERT_TRUE(store) << store.error().message;
    store_ = std::make_unique<FailingStore>(std::move(*store));
    config.storage_retry_ms = 1;
    service_ = JobService::create(*store_, config, decode);
  }
  void start() { ASSERT_TRUE(service_->start()); }
  std::string submit(const NewJob& job) {
    const auto submitted = service_->submit(job);
    EXPECT_TRUE(submitted) << submitted.error().message;
    return submitted->view.job.id;
  }
  std::vector<Event> events(const std::string& id) { return *service_->events(id, {}, 1'000'000); }
  /// What a simulator makes of the same spec without store, pauses or restarts.
  static std::vector<Event> undisturbed(std::uint64_t seed, std::uint64_t cells) {
    Simulator simulator(*decode(new_job(seed, cells).spec_json));
    std::vector<Event> history;
    while (auto event = simulator.step()) history.push_back(*event);
    return history;
  }

  TempDir dir_;
  std::unique_ptr<FailingStore> store_;
  std::unique_ptr<JobService> service_;
};

TEST_F(JobsTest, GrowsToItsBound) {
  start();
  const std::string id = submit(new_job(1, 20));
  const JobView view = Watch(*service_, id).until_ended();
  EXPECT_EQ(view.job.state, JobState::kSucceeded) << view.job.detail;
  EXPECT_EQ(view.job.reason, "cells");
  EXPECT_EQ(view.job.cell_count, 20U);
  EXPECT_EQ(view.job.active_count + view.job.passive_count + view.job.senescent_count, 20U);
  EXPECT_EQ(view.progress.fraction, 1.0);
  const std::vector<Event> history = events(id);
  EXPECT_EQ(history, undisturbed(1, 20));
  EXPECT_EQ(view.job.last_seq, history.size());
  EXPECT_EQ(view.job.digest, history.back().digest);
  EXPECT_EQ(history.back().kind(), EventKind::kFinished);
  const auto hourly = store_->read_series(view.job.job_key);
  ASSERT_EQ(hourly->size(), static_cast<std::size_t>(view.job.time_h) + 1);
  for (std::size_t hour = 0; hour < hourly->size(); ++hour) {
    const auto then = service_->colony_at(id, static_cast<double>(hour));
    const SeriesRow expected = measure_series(*then->colony, static_cast<double>(hour));
    EXPECT_EQ(hourly->at(hour).time_h, expected.time_h);
    EXPECT_EQ(hourly->at(hour).cell_count, expected.cell_count);
    EXPECT_EQ(hourly->at(hour).volume_mean_um3, expected.volume_mean_um3);
    EXPECT_EQ(hourly->at(hour).area_um2, expected.area_um2);
  }
}

TEST_F(JobsTest, TwoJobsAtOnceDoNotTouchEachOther) {
  JobsConfig config;
  config.concurrent_max = 2;
  open(config);
  start();
  const std::string a = submit(new_job(1, 15)), b = submit(new_job(2, 15)), c = submit(new_job(1, 15));
  for (const std::string& id : {a, b, c}) EXPECT_EQ(Watch(*service_, id).until_ended().job.state, JobState::kSucceeded);
  EXPECT_EQ(events(a), events(c));
  EXPECT_NE(service_->show(a)->job.digest, service_->show(b)->job.digest);
  EXPECT_EQ(events(b), undisturbed(2, 15));
}

TEST_F(JobsTest, PauseAndResumeChangeNothing) {
  start();
  const std::string id = submit(new_job(3, 40));
  Watch watch(*service_, id);
  watch.until_seq(5);
  const auto paused = service_->pause(id);
  ASSERT_TRUE(paused) << paused.error().message;
  EXPECT_EQ(paused->view.job.state, JobState::kPaused);
  EXPECT_EQ(paused->view.job.reason, "user");
  EXPECT_TRUE(paused->changed);
  EXPECT_FALSE(service_->pause(id)->changed);
  EXPECT_EQ(events(id).size(), paused->view.job.last_seq);
  EXPECT_TRUE(service_->resume(id)->changed);
  EXPECT_EQ(watch.until_ended().job.state, JobState::kSucceeded);
  EXPECT_EQ(events(id), undisturbed(3, 40));
  EXPECT_EQ(service_->pause(id).error().code, ErrorCode::kConflict);
  EXPECT_EQ(service_->resume(id).error().code, ErrorCode::kConflict);
  EXPECT_EQ(service_->cancel(id).error().code, ErrorCode::kConflict);
}

TEST_F(JobsTest, CancelEndsARunningJob) {
  start();
  const std::string id = submit(new_job(4, 100'000));
  Watch(*service_, id).until_seq(5);
  EXPECT_EQ(service_->remove(id).error().code, ErrorCode::kConflict);
  const auto cancelled = service_->cancel(id);
  ASSERT_TRUE(cancelled) << cancelled.error().message;
  EXPECT_EQ(cancelled->view.job.state, JobState::kCancelled);
  EXPECT_FALSE(service_->cancel(id)->changed);
  const std::vector<Event> history = events(id);
  ASSERT_EQ(history.size(), cancelled->view.job.last_seq);
  EXPECT_EQ(std::get<Finished>(history.back().body).reason, FinishReason::kCancelled);
  EXPECT_EQ(history.back().digest, history[history.size() - 2].digest);
  const auto end = service_->colony_at(id, std::nullopt);  // `finished` folds too
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(end->colony->cells().size(), cancelled->view.job.cell_count);
  EXPECT_TRUE(service_->remove(id));
  EXPECT_EQ(service_->show(id).error().code, ErrorCode::kNotFound);
}

TEST_F(JobsTest, CancelsAQueuedJobWithoutARunner) {
  const std::string id = submit(new_job(4, 10));  // not started: nobody takes it
  EXPECT_TRUE(service_->cancel(id)->changed);
  EXPECT_EQ(service_->show(id)->job.state, JobState::kCancelled);
  EXPECT_EQ(events(id).size(), 1U);
  EXPECT_EQ(service_->cancel("no such job").error().code, ErrorCode::kNotFound);
}

TEST_F(JobsTest, GoesOnAfterADrainWithTheSameBytes) {
  const std::string id = submit(new_job(5, 60));
  std::uint64_t seq = 0;
  int rounds = 0;
  for (; !is_terminal(service_->show(id)->job.state); ++rounds) {
    start();
    seq = Watch(*service_, id).until_seq(seq + 25).progress.last_seq;
    service_->drain();
    const JobRow row = service_->show(id)->job;
    EXPECT_TRUE(row.state == JobState::kRunning || row.state == JobState::kSucceeded);
    open();
  }
  EXPECT_GT(rounds, 2);
  EXPECT_EQ(events(id), undisturbed(5, 60));
  std::set<double> hours;
  const auto hourly = store_->read_series(service_->show(id)->job.job_key);
  for (const SeriesRow& row : *hourly) hours.insert(row.time_h);
  EXPECT_EQ(hours.size(),
            static_cast<std::size_t>(service_->show(id)->job.time_h) + 1);  // none missing after a restart
}

TEST_F(JobsTest, AWishOutlivesTheProcess) {
  const std::string to_cancel = submit(new_job(6, 30)), to_pause = submit(new_job(7, 30));
  for (const JobCommand command :
       {JobCommand::kCancel, JobCommand::kPause}) {  // recorded, but no runner was there to hear it
    const std::int64_t job_key = (*store_->take_queued_job())->job_key;
    EXPECT_TRUE(store_->command_job(job_key, command)->pending);
  }
  start();
  EXPECT_EQ(Watch(*service_, to_cancel).until_ended().job.state, JobState::kCancelled);
  const JobView paused =
      Watch(*service_, to_pause).until([](const JobView& v) { return v.job.state != JobState::kRunning; });
  EXPECT_EQ(paused.job.state, JobState::kPaused);
  EXPECT_EQ(paused.job.last_seq, 0U);
}

TEST_F(JobsTest, ABadSpecFailsTheJobAndTheServerGoesOn) {
  start();
  NewJob bad = new_job(1, 10);
  bad.spec_json = "bad";
  NewJob broken = new_job(1, 10);
  broken.spec_json = "1 10 0";
  const std::string a = submit(bad), b = submit(broken), good = submit(new_job(1, 5));
  for (const std::string& id : {a, b}) {
    const JobRow job = Watch(*service_, id).until_ended().job;
    EXPECT_EQ(job.state, JobState::kFailed);
    EXPECT_EQ(job.reason, "internal");
    EXPECT_NE(job.detail, "");
    EXPECT_EQ(std::get<Finished>(events(id).back().body).reason, FinishReason::kInternal);
  }
  EXPECT_NE(service_->show(b)->job.detail.find("stored events before 1,"), std::string::npos);
  EXPECT_EQ(Watch(*service_, good).until_ended().job.state, JobState::kSucceeded);
}

TEST_F(JobsTest, LimitsEndAJob) {
  JobsConfig config;
  config.cells_max = 8;
  open(config);
  start();
  const JobRow job = Watch(*service_, submit(new_job(1, 20))).until_ended().job;
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_EQ(job.reason, "limit");
  EXPECT_EQ(job.detail, "more than 8 cells (limits.cells_max)");
  EXPECT_EQ(std::get<Finished>(events(job.id).back().body).reason, FinishReason::kLimit);
  config = {};
  config.events_max = 30;
  open(config);
  start();
  const JobRow long_job = Watch(*service_, submit(new_job(1, 1000))).until_ended().job;
  EXPECT_EQ(long_job.reason, "limit");
  EXPECT_EQ(long_job.detail, "more than 30 events (limits.events_max)");
  config = {};
  config.queued_max = 1;
  open(config);
  submit(new_job(1, 5));
  EXPECT_EQ(service_->submit(new_job(1, 5)).error().code, ErrorCode::kBusy);
}

TEST_F(JobsTest, AnotherResultsVersionIsNotContinued) {
  const std::string id = submit(new_job(1, 20));
  store_->engine_version_seen = "0.0.9/" + std::to_string(kResultsVersion + 1);
  start();
  const JobRow job = Watch(*service_, id).until_ended().job;
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_EQ(job.reason, "engine_changed");
}

TEST_F(JobsTest, AStorageErrorPausesAndHealsByItself) {
  start();
  store_->appends_until_failure = 2;
  const std::string id = submit(new_job(8, 40));
  Watch watch(*service_, id);
  const JobView stopped = watch.until(
      [](const JobView& view) { return view.job.state == JobState::kPaused || is_terminal(view.job.state); });
  EXPECT_EQ(stopped.job.state, JobState::kPaused);
  EXPECT_EQ(stopped.job.reason, "storage");
  store_->heal();
  EXPECT_EQ(watch.until_ended().job.state, JobState::kSucceeded);
  EXPECT_EQ(events(id), undisturbed(8, 40));
}

TEST_F(JobsTest, AJobResumedBeforeItsRetryHasOneRunner) {
  JobsConfig config;
  config.concurrent_max = 2;
  open(config);
  // The retry is held before it looks at the row, until a person has resumed the job and it runs again.
  Gate retry;
  std::atomic<bool> hold_next_find{false};
  store_->after_set_state = [&](JobState, const std::string& reason) { hold_next_find = reason == "storage"; };
  store_->before_find = [&] {
    if (hold_next_find.exchange(false)) retry.pass();
  };
  store_->appends_until_failure = 2;
  start();
  const std::string id = submit(new_job(8, 150));
  Watch watch(*service_, id);
  retry.wait_until_reached();
  const JobView stopped = *service_->show(id);
  EXPECT_EQ(stopped.job.reason, "storage");
  store_->heal();
  ASSERT_TRUE(service_->resume(id));
  watch.until_seq(stopped.job.last_seq + 5);
  EXPECT_EQ(service_->show(id)->job.state, JobState::kRunning);
  retry.open();
  EXPECT_EQ(watch.until_ended().job.state, JobState::kSucceeded);
  service_->drain();
  int takes = 0, goes_on = 0;
  const auto log = service_->log(id, 0, 1000);
  for (const LogRow& line : *log) {
    takes += line.message.starts_with("queued -> running") ? 1 : 0;
    goes_on += line.message.starts_with("goes on") ? 1 : 0;
  }
  EXPECT_EQ(takes, 2);
  EXPECT_EQ(goes_on, 1);  // the first began with nothing
  EXPECT_EQ(events(id), undisturbed(8, 150));
}

TEST_F(JobsTest, ARunnerThatLeavesDoesNotTakeTheNextOnesPlace) {
  JobsConfig config;
  config.concurrent_max = 2;
  config.command_wait_ms = 0;  // pause answers while its runner is held
  open(config);
  Gate leaving, taken;
  std::atomic<int> pauses{0}, takes{0};
  store_->after_set_state = [&](JobState to, const std::string&) {
    if (to == JobState::kPaused && ++pauses == 1) leaving.pass();
  };
  store_->after_take = [&] {
    if (++takes == 2) taken.pass();
  };
  start();
  const std::string id = submit(new_job(3, 100'000));
  Watch watch(*service_, id);
  watch.until_seq(5);
  ASSERT_TRUE(service_->pause(id));
  leaving.wait_until_reached();  // paused in the store, its runner still there
  ASSERT_TRUE(service_->resume(id));
  taken.wait_until_reached();  // by the other runner
  taken.open();
  leaving.open();
  const std::uint64_t seq = service_->show(id)->job.last_seq;
  watch.until_seq(seq + 5);
  ASSERT_TRUE(service_->pause(id));  // which must reach the second runner
  EXPECT_EQ(watch.until([](const JobView& view) { return view.job.state != JobState::kRunning; }).job.state,
            JobState::kPaused);
}

TEST_F(JobsTest, AWishStopsAStepThatTakesLong) {
  JobsConfig config;
  config.command_wait_ms = 600'000;
  open(config);
  start();
  NewJob crowd = new_job(1, 1'000'000);
  crowd.spec_json += " 1 20000";  // placing them is one step, and a long one
  const std::string id = submit(crowd);
  const auto running = [](const JobView& view) { return view.job.state == JobState::kRunning; };
  Watch watch(*service_, id);
  watch.until(running);
  const auto paused = service_->pause(id);
  ASSERT_TRUE(paused) << paused.error().message;
  EXPECT_EQ(paused->view.job.state, JobState::kPaused);
  EXPECT_EQ(paused->view.job.last_seq, 0U);
  ASSERT_TRUE(service_->resume(id));
  watch.until(running);
  service_->drain();
  EXPECT_EQ(service_->show(id)->job.state, JobState::kRunning);
  EXPECT_EQ(service_->show(id)->job.last_seq, 0U);
  open(config);
  start();
  const auto cancelled = service_->cancel(id);
  ASSERT_TRUE(cancelled) << cancelled.error().message;
  EXPECT_EQ(cancelled->view.job.state, JobState::kCancelled);
  EXPECT_EQ(cancelled->view.job.last_seq, 1U);
}

TEST_F(JobsTest, DrainEndsAFold) {
  start();
  const std::string id = submit(new_job(2, 30));
  Watch(*service_, id).until_ended();
  service_->drain();
  open();
  Gate reading;
  store_->before_read_events = [&] { reading.pass(); };
  Result<ColonyAt> colony = Error{ErrorCode::kInternal, "not asked"};
  std::thread asking([&] { colony = service_->colony_at(id, std::nullopt); });
  reading.wait_until_reached();
  service_->drain();
  reading.open();
  asking.join();
  ASSERT_FALSE(colony);
  EXPECT_EQ(colony.error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(service_->series(id, 5).error().code, ErrorCode::kUnavailable);
}

TEST_F(JobsTest, KeptColoniesAreBoundedByTheirCells) {
  JobsConfig config;
  config.cached_cells_max = 35;
  open(config);
  start();
  const JobRow large = Watch(*service_, submit(new_job(2, 30))).until_ended().job;
  const JobRow small = Watch(*service_, submit(new_job(1, 10))).until_ended().job;
  const JobRow too_large = Watch(*service_, submit(new_job(1, 40))).until_ended().job;
  const auto is_kept = [&](const JobRow& job) {
    const int before = store_->event_reads;
    EXPECT_EQ(service_->colony_at(job.id, std::nullopt)->colony->cells().size(), job.cell_count);
    return store_->event_reads == before;
  };
  EXPECT_FALSE(is_kept(large));
  EXPECT_TRUE(is_kept(large));
  EXPECT_FALSE(is_kept(too_large));
  EXPECT_FALSE(is_kept(too_large));
  EXPECT_TRUE(is_kept(large));  // nothing went for what was not kept
  EXPECT_FALSE(is_kept(small));
  EXPECT_TRUE(is_kept(small));
  EXPECT_FALSE(is_kept(large));  // went for the small one
  EXPECT_FALSE(is_kept(small));  // and came back for it
}

TEST_F(JobsTest, NoRunnersIsAnError) {
  JobsConfig config;
  config.concurrent_max = 0;
  open(config);
  EXPECT_EQ(service_->start().error().code, ErrorCode::kInvalid);
}

TEST_F(JobsTest, NothingIsAnnouncedBeforeItsCommit) {
  start();
  const std::string id = submit(new_job(9, 20));
  Watch watch(*service_, id);
  std::uint64_t last = 0;
  watch.until([&](const JobView& view) {
    EXPECT_GE(view.progress.last_seq, last);
    last = view.progress.last_seq;
    EXPECT_GE(events(id).size(), last);
    return is_terminal(view.job.state);
  });
}

TEST_F(JobsTest, ThePastIsAFoldOfTheEvents) {
  const std::string empty = submit(new_job(2, 30));
  EXPECT_EQ(service_->colony_at(empty, 0.5).error().code, ErrorCode::kNotReached);
  EXPECT_EQ(service_->colony_at(empty, 0.5).error().fields.at(0).pointer, "at_h");
  EXPECT_EQ(service_->colony_at(empty, -1.0).error().code, ErrorCode::kInvalid);
  EXPECT_TRUE(service_->colony_at(empty, std::nullopt)->colony->cells().empty());
  start();
  const JobRow job = Watch(*service_, empty).until_ended().job;
  const std::vector<Event> history = events(job.id);
  const RunSpec spec = *decode(job.spec_json);
  // Backwards, forwards and twice: from nothing, from a kept earlier fold, and from the kept fold itself.
  for (const double at_h : {job.time_h, 20.0, 3.0, 25.0, 20.0, 1e6}) {
    Colony expected(spec.params);
    for (const Event& event : history) {
      if (event.time_h <= at_h) expected.apply(event);
    }
    const auto colony = service_->colony_at(job.id, at_h);
    ASSERT_TRUE(colony) << colony.error().message;
    EXPECT_EQ(colony->digest, expected.digest());
    EXPECT_EQ(colony->time_h, at_h);
    EXPECT_EQ(std::vector<Cell>(colony->colony->cells().begin(), colony->colony->cells().end()),
              std::vector<Cell>(expected.cells().begin(), expected.cells().end()));
  }
  const auto rows = service_->series(job.id, 11);
  ASSERT_TRUE(rows) << rows.error().message;
  ASSERT_EQ(rows->size(), 11U);
  EXPECT_EQ(rows->front().cell_count, 1U);
  EXPECT_EQ(rows->back().time_h, job.time_h);
  EXPECT_EQ(rows->back().cell_count, 30U);
  for (const SeriesRow& row : *rows) {
    const auto then = service_->colony_at(job.id, row.time_h);
    EXPECT_EQ(row.cell_count, then->colony->cells().size());
    EXPECT_EQ(row.radius_um, measure_series(*then->colony, row.time_h).radius_um);
  }
  EXPECT_EQ(service_->series(job.id, 11)->size(), 11U);
  EXPECT_EQ(service_->series(job.id, 0).error().code, ErrorCode::kInvalid);
  EXPECT_EQ(service_->series(job.id, 10'001).error().code, ErrorCode::kInvalid);
}

}  // namespace
}  // namespace colony::server
