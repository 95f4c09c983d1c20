// The job service over the real store and the real simulator: growth, commands, restarts, failures, views of the past.
#include <algorithm>
#include <set>

#include "tests/unit/jobs_fixture.hpp"

namespace colony::server {
namespace {

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

TEST_F(JobsTest, TheNumberOfThreadsDoesNotShowInTheHistory) {
  JobsConfig config;
  config.threads_per_job = 3;
  open(config);
  start();
  const std::string id = submit(new_job(1, 20));
  Watch(*service_, id).until_ended();
  EXPECT_EQ(events(id), undisturbed(1, 20));
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
  const auto paused = service_->pause(id, "someone");
  ASSERT_TRUE(paused) << paused.error().message;
  EXPECT_EQ(paused->view.job.state, JobState::kPaused);
  EXPECT_EQ(paused->view.job.reason, "user");
  EXPECT_TRUE(paused->changed);
  EXPECT_FALSE(service_->pause(id, "someone")->changed);
  EXPECT_EQ(events(id).size(), paused->view.job.last_seq);
  EXPECT_TRUE(service_->resume(id, "someone")->changed);
  EXPECT_EQ(watch.until_ended().job.state, JobState::kSucceeded);
  EXPECT_EQ(events(id), undisturbed(3, 40));
  EXPECT_EQ(service_->pause(id, "someone").error().code, ErrorCode::kConflict);
  EXPECT_EQ(service_->resume(id, "someone").error().code, ErrorCode::kConflict);
  EXPECT_EQ(service_->cancel(id, "someone").error().code, ErrorCode::kConflict);
}

TEST_F(JobsTest, APaceChangesNothingButTheTime) {
  JobsConfig config;
  config.events_per_s_max = 2000;
  open(config);
  start();
  const std::string id = submit(new_job(3, 15));
  Watch(*service_, id).until_ended();
  EXPECT_EQ(events(id), undisturbed(3, 15));
}

// Of a job that makes an event a second none of what is asked may wait for the next.
TEST_F(JobsTest, ASlowPaceKeepsNobodyWaiting) {
  JobsConfig config;
  config.events_per_s_max = 1;
  open(config);
  start();
  const std::string id = submit(new_job(4, 100'000));
  Watch watch(*service_, id);
  watch.until_seq(1);
  EXPECT_EQ(service_->pause(id, "tester")->view.job.state, JobState::kPaused);
  EXPECT_TRUE(service_->resume(id, "tester")->changed);
  watch.until([](const JobView& view) { return view.job.state == JobState::kRunning; });
  EXPECT_EQ(service_->cancel(id, "tester")->view.job.state, JobState::kCancelled);
}

TEST_F(JobsTest, CancelEndsARunningJob) {
  start();
  const std::string id = submit(new_job(4, 100'000));
  Watch(*service_, id).until_seq(5);
  EXPECT_EQ(service_->remove(id).error().code, ErrorCode::kConflict);
  const auto cancelled = service_->cancel(id, "someone");
  ASSERT_TRUE(cancelled) << cancelled.error().message;
  EXPECT_EQ(cancelled->view.job.state, JobState::kCancelled);
  EXPECT_FALSE(service_->cancel(id, "someone")->changed);
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
  EXPECT_TRUE(service_->cancel(id, "someone")->changed);
  EXPECT_EQ(service_->show(id)->job.state, JobState::kCancelled);
  EXPECT_EQ(events(id).size(), 1U);
  EXPECT_EQ(service_->cancel("no such job", "someone").error().code, ErrorCode::kNotFound);
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
    EXPECT_EQ(colony->time_h, std::min(at_h, job.time_h));  // beyond the end: the final state, at its own time
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
    EXPECT_EQ(row, measure_series(*then->colony, row.time_h));
  }
  EXPECT_EQ(*service_->series(job.id, 11), *rows);
  EXPECT_EQ(service_->series(job.id, 0).error().code, ErrorCode::kInvalid);
  EXPECT_EQ(service_->series(job.id, 10'001).error().code, ErrorCode::kInvalid);
}

// The curve is led on from question to question; what it says must not depend on when it was asked.
TEST_F(JobsTest, TheGrowthCurveOfAGrowingJobIsThatOfAFold) {
  start();
  const std::string id = submit(new_job(6, 60));
  Watch watch(*service_, id);
  for (const std::uint64_t seq : {3U, 10U, 11U, 60U}) {
    watch.until_seq(seq);
    ASSERT_TRUE(service_->series(id, 7));
  }
  const JobRow job = watch.until_ended().job;
  const std::vector<Event> history = events(id);
  for (const std::size_t points : {1U, 2U, 33U}) {
    const auto rows = service_->series(id, points);
    ASSERT_EQ(rows->size(), points);
    Colony colony(decode(job.spec_json)->params);
    auto event = history.begin();
    for (const SeriesRow& row : *rows) {
      for (; event != history.end() && event->time_h <= row.time_h; ++event) colony.apply(*event);
      EXPECT_EQ(row, measure_series(colony, row.time_h));
    }
    EXPECT_EQ(rows->back().time_h, job.time_h);
  }
}

}  // namespace
}  // namespace colony::server
