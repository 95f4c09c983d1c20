// Forks: the copy is the origin's history, what follows is a pure function of the copy and the fork's own spec.
#include "server/store/connection.hpp"
#include "tests/unit/jobs_fixture.hpp"

namespace colony::server {
namespace {

/// A number from the database, beside the running store.
std::int64_t ask(const std::string& folder, const std::string& sql) {
  Connection db(folder + "/colony.db", Connection::Access::kReader);
  Statement question = db.prepare_once(sql);
  return question.step() ? question.integer(0) : 0;
}

TEST_F(JobsTest, AForkWithTheSameSpecIsTheSameHistory) {
  JobsConfig config;
  config.threads_per_job = 2;
  open(config);
  start();
  const std::string id = submit(new_job(1, 40));
  const JobRow origin = Watch(*service_, id).until_ended().job;
  const std::vector<Event> history = events(id);
  const auto hourly = store_->read_series(origin.job_key);
  // The first place there is, the middle, the last event before `finished`, and `finished` itself, which stays behind.
  for (const std::uint64_t at_seq : {std::uint64_t{1}, origin.last_seq / 2, origin.last_seq - 1, origin.last_seq}) {
    const std::string forked = fork(id, at_seq, 1, 40);
    const JobRow job = Watch(*service_, forked).until_ended().job;
    EXPECT_EQ(job.state, JobState::kSucceeded) << job.detail;
    EXPECT_EQ(job.digest, origin.digest);
    EXPECT_EQ(events(forked), history);
    const auto again = store_->read_series(job.job_key);
    ASSERT_EQ(again->size(), hourly->size());
    for (std::size_t i = 0; i < hourly->size(); ++i) EXPECT_EQ(again->at(i).volume_mean_um3, hourly->at(i).volume_mean_um3);
    EXPECT_EQ(std::to_string(std::min(at_seq, origin.last_seq - 1)), job.origin_json.substr(0, job.origin_json.find(';')));
  }
}

TEST_F(JobsTest, AnotherSeedDiffersAfterTheForkOnlyAndNeedsNoOrigin) {
  start();
  const std::string id = submit(new_job(1, 30));
  const JobRow origin = Watch(*service_, id).until_ended().job;
  const std::vector<Event> history = events(id);
  const std::uint64_t at_seq = origin.last_seq / 2;
  const std::string forked = fork(id, at_seq, 2, 30);
  ASSERT_TRUE(service_->remove(id));
  const JobRow job = Watch(*service_, forked).until_ended().job;
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.detail;
  const std::vector<Event> changed = events(forked);
  const auto middle = static_cast<std::ptrdiff_t>(at_seq);
  EXPECT_TRUE(std::equal(history.begin(), history.begin() + middle, changed.begin()));
  EXPECT_NE(history[at_seq], changed[at_seq]);
  EXPECT_EQ(service_->colony_at(forked, std::nullopt)->digest, job.digest);  // it folds from its first row on
  const std::vector<LogRow> log = *service_->log(forked, 0, 10);
  EXPECT_NE(log.at(0).message.find("as a fork of job " + id + " at event " + std::to_string(at_seq)), std::string::npos);
}

TEST_F(JobsTest, ALiveOriginIsForkedAtWhatItHasStored) {
  start();
  const std::string id = submit(new_job(3, 60));
  Watch(*service_, id).until_seq(20);
  const JobRow origin = service_->pause(id, "tester")->view.job;
  ASSERT_EQ(origin.state, JobState::kPaused);
  const auto ahead = service_->fork_point(id, std::nullopt, origin.last_seq + 1);
  ASSERT_FALSE(ahead);
  EXPECT_EQ(ahead.error().code, ErrorCode::kNotReached);
  EXPECT_EQ(ahead.error().fields.at(0).pointer, "/at_seq");
  EXPECT_EQ(service_->fork_point(id, origin.time_h + 1.0, std::nullopt).error().code, ErrorCode::kNotReached);
  const auto point = service_->fork_point(id, std::nullopt, origin.last_seq);
  ASSERT_TRUE(point);
  EXPECT_EQ(point->at_seq, origin.last_seq);
  const auto made = service_->fork(new_job(3, 60), *point);
  ASSERT_TRUE(made) << made.error().message;
  // The row is right before anybody goes on with it (a runner may have begun: its history only grows).
  EXPECT_GE(made->view.job.last_seq, origin.last_seq);
  const JobRow job = Watch(*service_, made->view.job.id).until_ended().job;
  EXPECT_TRUE(service_->resume(id, "tester"));
  EXPECT_EQ(Watch(*service_, id).until_ended().job.digest, job.digest);
  // By time: all events up to it, also between two events; beyond the end the last state.
  const std::vector<Event> history = events(id);
  const double between = (history[30].time_h + history[31].time_h) / 2.0;
  std::uint64_t expected = 0;
  for (const Event& event : history) expected = event.time_h <= between ? event.seq : expected;
  EXPECT_EQ(service_->fork_point(id, between, std::nullopt)->at_seq, expected);
  EXPECT_EQ(service_->fork_point(id, 1e6, std::nullopt)->at_seq, history.size() - 1);
  EXPECT_EQ(service_->fork_point(id, std::nullopt, history.size() + 1).error().code, ErrorCode::kInvalid);
}

TEST_F(JobsTest, TheRowOfAForkIsThatOfTheOriginThere) {
  const auto grow = [&] {
    start();
    return Watch(*service_, submit(new_job(1, 25))).until_ended().job;
  };
  const JobRow origin = grow();
  service_->drain();
  open();  // not started: nobody takes the fork
  const std::uint64_t at_seq = origin.last_seq / 2;
  const std::string id = fork(origin.id, at_seq, 1, 25);
  const JobRow job = service_->show(id)->job;
  const Colony& colony = *service_->fork_point(origin.id, std::nullopt, at_seq)->at.colony;
  EXPECT_EQ(job.state, JobState::kQueued);
  EXPECT_EQ(job.started_at, "");
  EXPECT_EQ(job.last_seq, at_seq);
  EXPECT_EQ(job.digest, colony.digest());
  EXPECT_EQ(job.time_h, colony.time_h());
  EXPECT_EQ(job.cell_count, colony.cells().size());
  EXPECT_EQ(job.active_count + job.passive_count + job.senescent_count, job.cell_count);
  EXPECT_EQ(service_->show(id)->progress.last_seq, at_seq);
  // A key gives the same job, with the origin gone too, and another body is told apart.
  NewJob keyed = new_job(1, 25);
  keyed.idempotency_key = "key";
  keyed.body_hash = "hash";
  const auto point = service_->fork_point(origin.id, std::nullopt, at_seq);
  const auto first = service_->fork(keyed, *point), second = service_->fork(keyed, *point);
  EXPECT_TRUE(first->created);
  EXPECT_FALSE(second->created);
  EXPECT_EQ(first->view.job.id, second->view.job.id);
  ASSERT_TRUE(service_->remove(origin.id));
  EXPECT_EQ((*service_->submitted_before(keyed))->job.id, first->view.job.id);
  EXPECT_EQ(service_->fork(new_job(1, 25), *point).error().code, ErrorCode::kNotFound);
  keyed.body_hash = "another";
  EXPECT_EQ(service_->submitted_before(keyed).error().code, ErrorCode::kKeyReused);
}

TEST_F(JobsTest, ACopyThatIsNotFinishedLeavesNothing) {
  start();
  const JobRow origin = Watch(*service_, submit(new_job(1, 25))).until_ended().job;
  service_->drain();
  open();
  const auto point = service_->fork_point(origin.id, std::nullopt, origin.last_seq / 2);
  ASSERT_TRUE(point);
  const auto visible = [&] { return service_->list({}, 100, "")->items.size(); };
  const Colony& colony = *point->at.colony;
  ForkTail tail{point->at_seq, colony.time_h(), colony.digest(), colony.cells().size(), 0, 0, 0};
  const std::atomic<bool> stop{true};
  EXPECT_EQ(store_->fork_job(new_job(1, 25), origin.job_key, tail, 10, &stop).error().code, ErrorCode::kUnavailable);
  tail.digest.bytes[3] ^= 1;  // not the history that was looked at
  EXPECT_EQ(store_->fork_job(new_job(1, 25), origin.job_key, tail, 10, nullptr).error().code, ErrorCode::kInternal);
  tail.digest.bytes[3] ^= 1;
  EXPECT_EQ(store_->fork_job(new_job(1, 25), origin.job_key, tail, 0, nullptr).error().code, ErrorCode::kBusy);
  EXPECT_EQ(visible(), 1U);
  // Killed in the middle: the row as it is until all is copied.
  const std::string id = fork(origin.id, point->at_seq, 1, 25);
  const std::int64_t job_key = service_->show(id)->job.job_key;
  service_.reset();
  store_.reset();
  Connection(dir_.path() + "/colony.db", Connection::Access::kWriter)
      .execute("UPDATE job SET deleted = 2 WHERE job_key = " + std::to_string(job_key));
  open();
  EXPECT_EQ(visible(), 1U);
  EXPECT_EQ(service_->show(id).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ask(dir_.path(), "SELECT count(*) FROM job WHERE deleted = 2"), 0);
  // The sweeper works in idle moments; each flush is one, and its work is bounded.
  for (int i = 0; i < 1000 && ask(dir_.path(), "SELECT count(*) FROM job") > 1; ++i) ASSERT_TRUE(store_->flush());
  EXPECT_EQ(ask(dir_.path(), "SELECT count(*) FROM job"), 1);
  EXPECT_EQ(ask(dir_.path(), "SELECT count(*) FROM event WHERE job_key <> " + std::to_string(origin.job_key)), 0);
}

}  // namespace
}  // namespace colony::server
