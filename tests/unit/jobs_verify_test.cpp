// Verification: right histories are found identical, a changed number is found where it stands, and stops cost nothing but time.
#include "tests/unit/jobs_fixture.hpp"

namespace colony::server {
namespace {

TEST_F(JobsTest, AForkOfAForkIsVerifiedByEachSpecOnItsStretch) {
  start();
  const std::string id = submit(new_job(1, 20));
  const std::uint64_t n = Watch(*service_, id).until_ended().job.last_seq;
  const std::string child = fork(id, n / 2, 2, 30);
  const std::uint64_t m = Watch(*service_, child).until_ended().job.last_seq;
  const std::string grandchild = fork(child, n / 2 + (m - n / 2) / 2, 3, 40);
  Watch(*service_, grandchild).until_ended();
  const std::string elder = fork(child, n / 4, 4, 25);  // from before the child's own beginning
  Watch(*service_, elder).until_ended();
  for (const std::string& one : {id, child, grandchild, elder}) {
    const JobRow target = service_->show(one)->job;
    const JobView verified = Watch(*service_, submit(verification_of(target))).until_ended();
    EXPECT_EQ(verified.job.state, JobState::kSucceeded) << verified.job.detail;
    EXPECT_EQ(verified.job.reason, "identical");
    EXPECT_EQ(verified.job.result_json, "identical " + std::to_string(target.last_seq));
    EXPECT_EQ(verified.job.last_seq, 1U);
    EXPECT_EQ(verified.progress.fraction, 1.0);
    const std::vector<Event> own = events(verified.job.id);
    ASSERT_EQ(own.size(), 1U);
    EXPECT_EQ(std::get<Finished>(own[0].body), (Finished{FinishReason::kIdentical, target.cell_count}));
    EXPECT_EQ(service_->colony_at(verified.job.id, std::nullopt).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(service_->series(verified.job.id, 10).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(service_->fork_point(verified.job.id, std::nullopt, 1).error().code, ErrorCode::kNotFound);
  }
}

TEST_F(JobsTest, ChangedContentIsFoundBesideAnUnchangedDigest) {
  start();
  const std::string id = submit(new_job(1, 20));
  const JobRow target = Watch(*service_, id).until_ended().job;
  const std::vector<Event> history = events(id);
  std::uint64_t seq = history.size() / 2;
  while (history[seq - 1].kind() != EventKind::kDivided) ++seq;
  service_->drain();
  open();
  store_->tamper = [&](Event& event) {  // one bit of one double: less than any print shows
    if (event.seq == seq) std::get<Divided>(event.body).cells[1].volume_um3 += 1e-12;
  };
  start();
  JobRow verified = Watch(*service_, submit(verification_of(target))).until_ended().job;
  EXPECT_EQ(verified.state, JobState::kSucceeded);
  EXPECT_EQ(verified.reason, "different");
  EXPECT_EQ(verified.result_json, "different at " + std::to_string(seq));
  service_->drain();
  open();
  store_->tamper = [&](Event& event) {  // the last event is outside the chain
    if (event.kind() == EventKind::kFinished) std::get<Finished>(event.body).reason = FinishReason::kCancelled;
  };
  start();
  verified = Watch(*service_, submit(verification_of(target))).until_ended().job;
  EXPECT_EQ(verified.result_json, "different at " + std::to_string(target.last_seq));
}

TEST_F(JobsTest, HistoriesThatEndedFromOutsideAndLiveOnesAreVerifiedToo) {
  start();
  const std::string cancelled = submit(new_job(4, 100'000));
  Watch(*service_, cancelled).until_seq(30);
  ASSERT_TRUE(service_->cancel(cancelled, "tester"));
  const std::string live = submit(new_job(5, 100'000));
  Watch(*service_, live).until_seq(30);
  ASSERT_TRUE(service_->pause(live, "tester"));
  const std::string empty = submit(new_job(6, 10));
  NewJob nothing = verification_of(service_->show(empty)->job);
  nothing.spec_json = empty + " 0";
  for (const NewJob& job : {verification_of(service_->show(cancelled)->job), verification_of(service_->show(live)->job), nothing}) {
    const JobRow verified = Watch(*service_, submit(job)).until_ended().job;
    EXPECT_EQ(verified.reason, "identical") << verified.detail;
  }
}

TEST_F(JobsTest, AVerificationStopsAsOtherJobsDoAndBeginsAgain) {
  start();
  const std::string id = submit(new_job(1, 25));
  const JobRow target = Watch(*service_, id).until_ended().job;
  service_->drain();
  open();
  Gate gate;
  bool is_first = true;
  store_->before_read_events = [&] {
    if (std::exchange(is_first, false)) gate.pass();
  };
  start();
  const std::string to_pause = submit(verification_of(target));
  gate.wait_until_reached();
  std::thread pauser([&] { EXPECT_TRUE(service_->pause(to_pause, "tester")); });
  while (service_->show(to_pause)->job.command != "pause") std::this_thread::yield();
  gate.open();
  pauser.join();
  Watch watch(*service_, to_pause);
  EXPECT_EQ(watch.until([](const JobView& v) { return v.job.state != JobState::kRunning; }).job.state, JobState::kPaused);
  EXPECT_TRUE(service_->resume(to_pause, "tester")->changed);
  EXPECT_EQ(watch.until_ended().job.reason, "identical");
  // The end of the server leaves it running; the next start takes it up.
  service_->drain();
  open();
  Gate second;
  is_first = true;
  store_->before_read_events = [&] {
    if (std::exchange(is_first, false)) second.pass();
  };
  start();
  const std::string left = submit(verification_of(target));
  second.wait_until_reached();
  std::thread drainer([&] { service_->drain(); });
  second.open();
  drainer.join();
  const JobRow between = *store_->find_job(left);
  EXPECT_TRUE(between.state == JobState::kRunning || between.reason == "identical");
  open();
  start();
  EXPECT_EQ(Watch(*service_, left).until_ended().job.reason, "identical");
}

TEST_F(JobsTest, AVerificationWhoseTargetGoesFailsAndSaysSo) {
  start();
  const JobRow target = Watch(*service_, submit(new_job(1, 10))).until_ended().job;
  service_->drain();
  open();
  const std::string id = submit(verification_of(target));
  ASSERT_TRUE(service_->remove(target.id));
  start();
  const JobRow job = Watch(*service_, id).until_ended().job;
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_EQ(job.reason, "target_deleted");
  EXPECT_NE(job.detail.find(target.id), std::string::npos);
  EXPECT_EQ(std::get<Finished>(events(id).back().body).reason, FinishReason::kTargetDeleted);
  NewJob broken = verification_of(target);
  broken.spec_json = "broken";
  EXPECT_EQ(Watch(*service_, submit(broken)).until_ended().job.reason, "internal");
}

TEST_F(JobsTest, AVerificationOfAnotherResultsVersionIsNotMade) {
  start();
  const JobRow target = Watch(*service_, submit(new_job(1, 10))).until_ended().job;
  service_->drain();
  open();
  store_->engine_version_seen = "0.0.9/" + std::to_string(kResultsVersion + 1);
  start();
  EXPECT_EQ(Watch(*service_, submit(verification_of(target))).until_ended().job.reason, "engine_changed");
}

}  // namespace
}  // namespace colony::server
