// Retention: what goes, in which order, and what never does. The clock is the test's.
#include "server/jobs/retention.hpp"

#include <algorithm>
#include <chrono>

#include "tests/unit/jobs_fixture.hpp"

namespace colony::server {
namespace {

constexpr std::int64_t kDay_ms = 86'400'000;

class Retention : public JobsTest {
 protected:
  void SetUp() override {
    open();
    start();
    for (const std::uint64_t seed : {1, 2, 3, 4}) {
      NewJob job = new_job(seed, 10);
      if (seed == 2) job.labels = {{"keep", "true"}};
      if (seed == 3) job.labels = {{"keep", "false"}};
      ids_.push_back(submit(job));
      Watch(*service_, ids_.back()).until_ended();
    }
    service_->drain();
    open();  // not started: nothing goes but by the test's own rounds
  }
  /// The jobs that went in one round, as numbers from 0.
  std::vector<std::size_t> round(const RetentionLimits& limits, std::int64_t now_ms) {
    JobsConfig config;
    config.retention = limits;
    config.now_ms = [now_ms] { return now_ms; };
    config.log = [this](const std::string& line) { log_.push_back(line); };
    std::vector<std::size_t> gone;
    expire_jobs(*store_, config, [&](const JobRow& job) {
      gone.push_back(static_cast<std::size_t>(std::find(ids_.begin(), ids_.end(), job.id) - ids_.begin()));
    });
    return gone;
  }
  static std::int64_t now_ms() {
    return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  }
  std::vector<std::string> ids_, log_;
};

TEST_F(Retention, ByAge) {
  const std::string live = submit(new_job(9, 10));  // queued
  EXPECT_EQ(round({0, 0}, now_ms() + 1000 * kDay_ms), std::vector<std::size_t>{});
  EXPECT_EQ(round({7, 0}, now_ms() + 6 * kDay_ms), std::vector<std::size_t>{});
  EXPECT_EQ(round({7, 0}, now_ms() + 8 * kDay_ms), (std::vector<std::size_t>{0, 2, 3}));
  ASSERT_EQ(log_.size(), 3U);
  EXPECT_NE(log_[0].find(ids_[0]), std::string::npos);
  for (const std::size_t gone : {0, 2, 3}) EXPECT_EQ(service_->show(ids_[gone]).error().code, ErrorCode::kNotFound);
  EXPECT_TRUE(service_->show(ids_[1]));  // keep=true
  EXPECT_TRUE(service_->show(live));
}

TEST_F(Retention, ByBytesOldestEndFirst) {
  EXPECT_EQ(round({0, 16'384}, now_ms()), (std::vector<std::size_t>{0, 2, 3}));  // not even one fits; the kept one stays
  EXPECT_TRUE(service_->show(ids_[1]));
}

TEST_F(Retention, NoMoreGoesThanIsTooMuch) {
  // The bytes of a history are its share of what is stored: find the bound at which one has to go.
  std::vector<std::size_t> gone;
  for (std::uint64_t bytes = std::uint64_t{1} << 22; gone.empty() && bytes > 0; bytes -= 4096) gone = round({0, bytes}, now_ms());
  EXPECT_EQ(gone, std::vector<std::size_t>{0});
}

TEST_F(Retention, WhatIsKeptTakesNoRoomFromTheOthers) {
  std::vector<std::size_t> gone;
  std::uint64_t bytes = std::uint64_t{1} << 22;
  for (; gone.empty() && bytes > 0; bytes -= 4096) gone = round({0, bytes}, now_ms());
  ASSERT_EQ(gone, std::vector<std::size_t>{0});  // two that may go, beside one that is kept
  JobTextChange change;
  change.labels["keep"] = "true";
  ASSERT_TRUE(service_->edit(ids_[2], change, {}, "tester"));
  EXPECT_EQ(round({0, bytes / 2 + 8192}, now_ms()), std::vector<std::size_t>{}) << "one is left that may go, and it fits";
}

TEST_F(Retention, NothingGoesWhileItFits) {
  EXPECT_EQ(round({0, std::uint64_t{1} << 30}, now_ms()), std::vector<std::size_t>{});
  EXPECT_EQ(round({36'500, std::uint64_t{1} << 30}, now_ms()), std::vector<std::size_t>{});
}

TEST_F(Retention, WhatAVerificationReadsStays) {
  NewJob verification;
  verification.kind = kVerifyKind;
  verification.spec_json = R"({"job_id": ")" + ids_[0] + R"(", "to_seq": 5})";
  const std::string id = submit(verification);  // queued
  EXPECT_EQ(round({1, 0}, now_ms() + 2 * kDay_ms), (std::vector<std::size_t>{2, 3}));
  ASSERT_TRUE(service_->cancel(id, "tester"));
  EXPECT_EQ(round({1, 0}, now_ms() + 2 * kDay_ms).size(), 2U);  // now it, and the verification itself
}

TEST_F(Retention, TheServiceDoesItByItself) {
  JobsConfig config;
  config.retention.keep_days = 1;
  config.now_ms = [] { return now_ms() + 2 * kDay_ms; };
  config.retention_every_ms = 1;
  open(config);
  std::mutex mutex;
  std::condition_variable changed;
  bool gone = false;
  const auto subscription = service_->subscribe(service_->show(ids_[3])->job.job_key, [&] {
    const std::lock_guard lock(mutex);
    gone = true;
    changed.notify_all();
  });
  start();
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return gone; });
  EXPECT_EQ(service_->show(ids_[3]).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace colony::server
