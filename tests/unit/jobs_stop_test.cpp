// The job service when the store fails, a runner leaves, or a wish must end long work.
#include "tests/unit/jobs_fixture.hpp"

namespace colony::server {
namespace {

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
  ASSERT_TRUE(service_->resume(id, "someone"));
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
  ASSERT_TRUE(service_->pause(id, "someone"));
  leaving.wait_until_reached();  // paused in the store, its runner still there
  ASSERT_TRUE(service_->resume(id, "someone"));
  taken.wait_until_reached();  // by the other runner
  taken.open();
  leaving.open();
  const std::uint64_t seq = service_->show(id)->job.last_seq;
  watch.until_seq(seq + 5);
  ASSERT_TRUE(service_->pause(id, "someone"));  // which must reach the second runner
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
  const auto paused = service_->pause(id, "someone");
  ASSERT_TRUE(paused) << paused.error().message;
  EXPECT_EQ(paused->view.job.state, JobState::kPaused);
  EXPECT_EQ(paused->view.job.last_seq, 0U);
  ASSERT_TRUE(service_->resume(id, "someone"));
  watch.until(running);
  service_->drain();
  EXPECT_EQ(service_->show(id)->job.state, JobState::kRunning);
  EXPECT_EQ(service_->show(id)->job.last_seq, 0U);
  open(config);
  start();
  const auto cancelled = service_->cancel(id, "someone");
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

TEST_F(JobsTest, NoRunnersOrNoThreadsIsAnError) {
  JobsConfig config;
  config.concurrent_max = 0;
  open(config);
  EXPECT_EQ(service_->start().error().code, ErrorCode::kInvalid);
  config.concurrent_max = 1;
  config.threads_per_job = 0;
  open(config);
  EXPECT_EQ(service_->start().error().code, ErrorCode::kInvalid);
}

}  // namespace
}  // namespace colony::server
