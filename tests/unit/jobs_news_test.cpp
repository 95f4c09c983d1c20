// What followers of all jobs hear, and moments that are found without folding.
#include <map>

#include "tests/unit/jobs_fixture.hpp"

namespace colony::server {
namespace {

using Kind = JobNews::Kind;

JobTextChange named(const char* name) {
  JobTextChange change;
  change.name = name;
  return change;
}

TEST_F(JobsTest, FollowersOfAllHearEveryJobFromItsBeginningToItsEnd) {
  std::mutex mutex;
  std::map<std::int64_t, std::map<Kind, int>> heard;
  std::string removed;
  auto subscription = service_->follow(std::nullopt, [&](const JobNews& news) {
    const std::lock_guard lock(mutex);
    ++heard[news.job_key][news.kind];
    if (news.kind == Kind::kRemoved) removed = news.id;
  });
  const auto count = [&](std::int64_t key, Kind kind) {
    const std::lock_guard lock(mutex);
    return heard[key][kind];
  };
  const std::string a = submit(new_job(1, 100'000)), b = submit(new_job(2, 12));
  const std::int64_t key_a = service_->show(a)->job.job_key, key_b = service_->show(b)->job.job_key;
  EXPECT_EQ(count(key_a, Kind::kChange), 1) << "it is new";
  EXPECT_EQ(count(key_b, Kind::kChange), 1);
  start();
  // Ended by hand after its first commit: a short job may have all its events committed with its end, which is a change.
  Watch(*service_, a).until([](const JobView& view) { return view.job.last_seq > 0; });
  ASSERT_TRUE(service_->cancel(a, "tester"));
  Watch(*service_, a).until_ended();
  Watch(*service_, b).until_ended();
  service_->drain();  // what is announced after the end has been announced now
  EXPECT_GE(count(key_a, Kind::kChange), 3) << "submitted, running, ended";
  EXPECT_GE(count(key_a, Kind::kCommit), 1);
  EXPECT_GE(count(key_b, Kind::kChange), 3);
  const int before = count(key_b, Kind::kChange);
  const auto edited = service_->edit(b, named("renamed"), {}, "alice");
  ASSERT_TRUE(edited) << edited.error().message;
  EXPECT_EQ(edited->view.job.name, "renamed");
  EXPECT_EQ(count(key_b, Kind::kChange), before + 1);
  EXPECT_FALSE(service_->edit(b, named("renamed"), {}, "alice")->changed);
  EXPECT_EQ(count(key_b, Kind::kChange), before + 1) << "no change, no news";
  ASSERT_TRUE(service_->remove(b));
  EXPECT_EQ(count(key_b, Kind::kRemoved), 1);
  EXPECT_EQ(removed, b);
  subscription.reset();
  ASSERT_TRUE(service_->remove(a));
  EXPECT_EQ(count(key_a, Kind::kRemoved), 0);
}

TEST_F(JobsTest, AMomentIsThatOfTheFoldedColony) {
  start();
  const std::string id = submit(new_job(4, 20));
  const JobView view = Watch(*service_, id).until_ended();
  std::vector<std::optional<double>> times = {std::nullopt, 0.0, 1e9, view.job.time_h};
  for (const Event& event : events(id)) {
    times.push_back(event.time_h);
    times.push_back(event.time_h + 1e-6);
  }
  for (const auto& at_h : times) {
    const auto moment = service_->moment(id, at_h);
    const auto colony = service_->colony_at(id, at_h);
    ASSERT_TRUE(moment && colony);
    EXPECT_EQ(moment->seq, colony->colony->last_seq());
    EXPECT_EQ(moment->digest, colony->digest);
    EXPECT_EQ(moment->job.id, id);
  }
  for (const double wrong : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(service_->moment(id, wrong).error().code, service_->colony_at(id, wrong).error().code);
  }
  EXPECT_EQ(service_->moment("none", 1.0).error().code, ErrorCode::kNotFound);
  const std::string waiting = submit(new_job(5, 500'000));
  EXPECT_EQ(service_->moment(waiting, 1e8).error().code, ErrorCode::kNotReached);
  EXPECT_FALSE(service_->live_progress(view.job.job_key)) << "it has no runner";
}

}  // namespace
}  // namespace colony::server
