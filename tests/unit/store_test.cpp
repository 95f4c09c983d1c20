// The store as its users see it: jobs, states, cursors, commands and deletion. Events and crashes: store_events_test.cpp.
#include "server/store/store.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <latch>
#include <set>
#include <sys/stat.h>
#include <thread>

#include <gtest/gtest.h>

#include "engine/base/version.hpp"
#include "tests/support/sample_events.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using tests::sample_batch;
using tests::sample_event;
using tests::TempDir;

std::unique_ptr<Store> open_store(const std::string& path) {
  StoreConfig config;
  config.data_dir = path;
  auto store = Store::open(config);
  EXPECT_TRUE(store) << store.error().message;
  return store ? std::move(*store) : nullptr;
}

NewJob new_job(const std::string& name = "a colony") {
  NewJob job;
  job.name = name;
  job.labels = {{"plate", "7"}, {"dye", "none"}};
  job.spec_json = R"({"seed": 1})";
  job.until_time_h = 240.5;
  job.until_cells = 2000;
  return job;
}

EventBatch finishing(const JobRow& job, FinishReason reason) {
  EventBatch last;
  last.job_key = job.job_key;
  last.events = {sample_event(job.last_seq + 1, Finished{reason, job.cell_count})};
  last.events[0].digest = job.digest;
  last.cell_count = job.cell_count;
  return last;
}

class StoreTest : public testing::Test {
 protected:
  JobRow create(const NewJob& job = new_job()) {
    auto created = store_->create_job(job, 1000);
    EXPECT_TRUE(created) << created.error().message;
    return created->job;
  }
  /// A new job in the given state. All other jobs must not be queued.
  JobRow job_in(JobState state) {
    const JobRow job = create();
    if (state == JobState::kQueued) return job;
    if (state == JobState::kPaused) {
      EXPECT_TRUE(store_->set_state(job.job_key, {JobState::kQueued}, JobState::kPaused, "user", ""));
      return *store_->find_job(job.job_key);
    }
    EXPECT_EQ((*store_->take_queued_job())->job_key, job.job_key);
    if (state == JobState::kSucceeded) {
      EXPECT_TRUE(store_->finish_job(finishing(job, FinishReason::kCells), state, "cells", ""));
    }
    if (state == JobState::kFailed) {
      EXPECT_TRUE(store_->finish_job(finishing(job, FinishReason::kInternal), state, "internal", "x"));
    }
    if (state == JobState::kCancelled) {
      EXPECT_TRUE(store_->finish_job(finishing(job, FinishReason::kCancelled), state, "cancelled", ""));
    }
    return *store_->find_job(job.job_key);
  }
  JobState state_of(std::int64_t job_key) { return store_->find_job(job_key)->state; }

  TempDir dir_;
  std::unique_ptr<Store> store_ = open_store(dir_.path() + "/data");
};

constexpr JobState kStates[] = {JobState::kQueued,    JobState::kRunning, JobState::kPaused,
                                JobState::kSucceeded, JobState::kFailed,  JobState::kCancelled};

TEST_F(StoreTest, MakesItsFolderForItsOwnerAlone) {
  struct stat found {};
  ASSERT_EQ(stat((dir_.path() + "/data").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0700U);
  ASSERT_EQ(stat((dir_.path() + "/data/colony.db").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U);
}

TEST_F(StoreTest, RefusesASecondOpenOfTheSameFolder) {
  StoreConfig config;
  config.data_dir = dir_.path() + "/data";
  const auto second = Store::open(config);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kConflict);
  store_.reset();
  EXPECT_TRUE(Store::open(config));
}

TEST_F(StoreTest, KeepsAJobAsGiven) {
  const JobRow made = create();
  for (const auto& job : {store_->find_job(made.job_key), store_->find_job(made.id)}) {
    ASSERT_TRUE(job);
    EXPECT_EQ(job->id, made.id);
    EXPECT_EQ(job->kind, "colony");
    EXPECT_EQ(job->name, "a colony");
    EXPECT_EQ(job->labels, new_job().labels);
    EXPECT_EQ(job->state, JobState::kQueued);
    EXPECT_EQ(job->spec_json, R"({"seed": 1})");
    EXPECT_EQ(job->until_time_h, 240.5);
    EXPECT_EQ(job->until_cells, 2000U);
    EXPECT_EQ(job->submitted_by, "local");
    EXPECT_EQ(job->engine_version, engine_version_text());
    EXPECT_EQ(job->revision, 1U);
    EXPECT_EQ(job->last_seq, 0U);
    EXPECT_EQ(job->digest, Digest{});
    EXPECT_EQ(job->created_at.size(), 24U);
    EXPECT_EQ(job->started_at + job->finished_at, "");
  }
  EXPECT_EQ(made.id.size(), 36U);
  EXPECT_EQ(made.id[14], '7');
  EXPECT_NE(std::string("89ab").find(made.id[19]), std::string::npos);
  EXPECT_EQ(store_->find_job("0190a000-0000-7000-8000-000000000000").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(store_->find_job(99).error().code, ErrorCode::kNotFound);
}

TEST_F(StoreTest, AnIdempotencyKeyGivesTheSameJob) {
  NewJob job = new_job();
  job.idempotency_key = "key";
  job.body_hash = "one";
  const auto first = store_->create_job(job, 1);
  const auto again = store_->create_job(job, 1);  // not kBusy: nothing new is queued
  ASSERT_TRUE(first && again);
  EXPECT_TRUE(first->created);
  EXPECT_FALSE(again->created);
  EXPECT_EQ(first->job.id, again->job.id);
  job.body_hash = "two";
  EXPECT_EQ(store_->create_job(job, 9).error().code, ErrorCode::kKeyReused);
  job.submitted_by = "another lab";
  EXPECT_TRUE(store_->create_job(job, 9)->created);
  EXPECT_EQ((*store_->count_jobs())[0], 2U);
}

TEST_F(StoreTest, RacingThreadsWithOneKeyMakeOneJob) {
  constexpr int kThreads = 8;
  std::latch start(kThreads);
  std::vector<std::string> ids(kThreads);
  std::vector<char> created(kThreads, 0);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kThreads; ++i) {
    threads.emplace_back([&, i] {
      NewJob job = new_job();
      job.idempotency_key = "key";
      start.arrive_and_wait();
      const auto submitted = store_->create_job(job, 1000);
      if (!submitted) return;
      ids[i] = submitted->job.id;
      created[i] = submitted->created;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(std::count(created.begin(), created.end(), 1), 1);
  EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), 1U);
  EXPECT_EQ((*store_->count_jobs())[0], 1U);
}

TEST_F(StoreTest, AFullQueueIsBusy) {
  create();
  const auto refused = store_->create_job(new_job(), 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kBusy);
  EXPECT_EQ((*store_->count_jobs())[0], 1U);
}

TEST_F(StoreTest, StatesFollowTheTable) {
  const std::set<std::pair<JobState, JobState>> table = {
      {JobState::kQueued, JobState::kRunning},   {JobState::kQueued, JobState::kPaused},
      {JobState::kQueued, JobState::kCancelled}, {JobState::kQueued, JobState::kFailed},
      {JobState::kRunning, JobState::kPaused},   {JobState::kRunning, JobState::kSucceeded},
      {JobState::kRunning, JobState::kFailed},   {JobState::kRunning, JobState::kCancelled},
      {JobState::kPaused, JobState::kQueued},    {JobState::kPaused, JobState::kCancelled}};
  for (const JobState from : kStates) {
    for (const JobState to : kStates) {
      SCOPED_TRACE(std::string(name_of(from)) + " -> " + std::string(name_of(to)));
      const bool allowed = table.contains({from, to});
      EXPECT_EQ(may_follow(from, to), allowed);
      const JobRow job = job_in(from);
      const auto moved = is_terminal(to) ? store_->finish_job(finishing(job, FinishReason::kLimit), to, "r", "d")
                                         : store_->set_state(job.job_key, {from}, to, "r", "d");
      EXPECT_EQ(bool(moved), allowed);
      const JobRow after = *store_->find_job(job.job_key);
      EXPECT_EQ(after.state, allowed ? to : from);
      EXPECT_EQ(after.revision, job.revision + (allowed ? 1 : 0));
      EXPECT_EQ(after.last_seq, job.last_seq + (allowed && is_terminal(to) ? 1 : 0));
      EXPECT_EQ(after.finished_at.empty(), !is_terminal(after.state));
      if (!allowed) {
        EXPECT_EQ(moved.error().code, ErrorCode::kConflict);
      }
      if (!is_terminal(after.state)) {  // so that the next round finds no queued job of this one
        ASSERT_TRUE(store_->finish_job(finishing(after, FinishReason::kCancelled), JobState::kCancelled, "", ""));
      }
    }
  }
}

TEST_F(StoreTest, SetStateWantsOneOfTheStatesNamed) {
  const JobRow job = job_in(JobState::kRunning);
  EXPECT_EQ(store_->set_state(job.job_key, {JobState::kQueued}, JobState::kPaused, "", "").error().code,
            ErrorCode::kConflict);
  EXPECT_EQ(store_->set_state(77, {JobState::kQueued}, JobState::kPaused, "", "").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(state_of(job.job_key), JobState::kRunning);
}

TEST_F(StoreTest, CommandsDecideByTheStateTheyFind) {
  const auto command = [&](const JobRow& job, JobCommand what) { return store_->command_job(job.job_key, what); };
  JobRow job = job_in(JobState::kQueued);
  EXPECT_EQ(command(job, JobCommand::kPause)->job.state, JobState::kPaused);
  EXPECT_FALSE(command(job, JobCommand::kPause)->changed);
  EXPECT_FALSE(command(job, JobCommand::kResumeStorage)->changed);  // a person paused it
  EXPECT_EQ(command(job, JobCommand::kResume)->job.state, JobState::kQueued);
  EXPECT_FALSE(command(job, JobCommand::kResume)->changed);
  const auto cancelled = command(job, JobCommand::kCancel);
  ASSERT_TRUE(cancelled);
  EXPECT_EQ(cancelled->job.state, JobState::kCancelled);
  const auto events = store_->read_events(job.job_key, {}, 10);
  ASSERT_EQ(events->size(), 1U);
  EXPECT_EQ(events->at(0).seq, 1U);
  EXPECT_EQ(std::get<Finished>(events->at(0).body).reason, FinishReason::kCancelled);
  EXPECT_FALSE(command(job, JobCommand::kCancel)->changed);
  EXPECT_EQ(command(job, JobCommand::kPause).error().code, ErrorCode::kConflict);
  EXPECT_EQ(command(job, JobCommand::kResume).error().code, ErrorCode::kConflict);

  job = job_in(JobState::kRunning);
  EXPECT_TRUE(command(job, JobCommand::kPause)->pending);
  EXPECT_TRUE(command(job, JobCommand::kResume)->pending);
  EXPECT_TRUE(command(job, JobCommand::kCancel)->pending);  // a cancel overrides a pause
  EXPECT_EQ(store_->find_job(job.job_key)->command, "cancel");
  EXPECT_EQ(command(job, JobCommand::kPause).error().code, ErrorCode::kConflict);
  EXPECT_EQ(store_->set_state(job.job_key, {JobState::kRunning}, JobState::kPaused, "user", "").error().code,
            ErrorCode::kConflict);
  EXPECT_TRUE(store_->finish_job(finishing(job, FinishReason::kCancelled), JobState::kCancelled, "cancelled", ""));
  EXPECT_EQ(store_->find_job(job.job_key)->command, "");

  job = job_in(JobState::kRunning);
  EXPECT_TRUE(store_->set_state(job.job_key, {JobState::kRunning}, JobState::kPaused, "storage", ""));
  EXPECT_TRUE(command(job, JobCommand::kResumeStorage)->changed);
  EXPECT_EQ(state_of(job.job_key), JobState::kQueued);
}

TEST_F(StoreTest, TakesTheOldestQueuedJob) {
  const JobRow first = create(), second = create();
  EXPECT_EQ((*store_->take_queued_job())->id, first.id);
  const auto taken = *store_->take_queued_job();
  EXPECT_EQ(taken->id, second.id);
  EXPECT_EQ(taken->state, JobState::kRunning);
  EXPECT_EQ(taken->started_at.size(), 24U);
  EXPECT_FALSE(store_->take_queued_job()->has_value());
  const auto running = store_->running_jobs();
  ASSERT_EQ(running->size(), 2U);
  EXPECT_EQ(running->at(0).id, first.id);
}

TEST_F(StoreTest, ListsNewestFirstWithFiltersAndCursor) {
  std::vector<std::string> ids;
  for (int i = 0; i < 7; ++i) {
    NewJob job = new_job(i % 2 == 0 ? "even" : "odd");
    job.labels["third"] = i % 3 == 0 ? "yes" : "no";
    ids.insert(ids.begin(), create(job).id);
  }
  std::vector<std::string> seen;
  std::string cursor;
  do {
    const auto page = store_->list_jobs({}, 3, cursor);
    ASSERT_TRUE(page);
    for (const JobRow& job : page->items) seen.push_back(job.id);
    cursor = page->next.value_or("");
  } while (!cursor.empty());
  EXPECT_EQ(seen, ids);
  using Labels = std::vector<std::pair<std::string, std::string>>;
  const auto count = [&](std::optional<JobState> state, std::optional<std::string> kind,
                         std::optional<std::string> name, const Labels& labels) {
    return store_->list_jobs({state, kind, name, labels}, 100, "")->items.size();
  };
  EXPECT_EQ(count({}, {}, "even", {}), 4U);
  EXPECT_EQ(count({}, {}, {}, {{"third", "yes"}}), 3U);
  EXPECT_EQ(count({}, {}, "even", {{"third", "yes"}, {"plate", "7"}}), 2U);
  EXPECT_EQ(count({}, {}, {}, {{"third", "yes"}, {"plate", "8"}}), 0U);
  EXPECT_EQ(count({}, "colony", {}, {}), 7U);
  EXPECT_EQ(count({}, "verify", {}, {}), 0U);
  EXPECT_EQ(count(JobState::kRunning, {}, {}, {}), 0U);
  ASSERT_TRUE(store_->take_queued_job());
  EXPECT_EQ(count(JobState::kRunning, {}, {}, {}), 1U);
  EXPECT_EQ(count(JobState::kQueued, {}, {}, {}), 6U);
  EXPECT_EQ(store_->list_jobs({}, 0, "").error().code, ErrorCode::kInvalid);
}

TEST_F(StoreTest, RefusesEveryChangedCursor) {
  create();
  create();
  const std::string cursor = store_->list_jobs({}, 1, "")->next.value();
  ASSERT_TRUE(store_->list_jobs({}, 1, cursor));
  std::vector<std::string> wrong = {
      "1", "x", cursor + "0", cursor.substr(1), std::string(32, '0'), std::string(32, 'f')};
  for (std::size_t i = 0; i < cursor.size(); ++i) {
    for (const char c : {'0', '7', 'a', 'F', '-', '\0'}) {
      std::string changed = cursor;
      if (changed[i] == c) continue;
      changed[i] = c;
      wrong.push_back(changed);
    }
  }
  for (const std::string& text : wrong) {
    const auto page = store_->list_jobs({}, 1, text);
    ASSERT_FALSE(page) << text;
    EXPECT_EQ(page.error().code, ErrorCode::kInvalid);
    EXPECT_EQ(page.error().fields.at(0).pointer, "cursor");
  }
  store_.reset();
  store_ = open_store(dir_.path() + "/data");
  EXPECT_TRUE(store_->list_jobs({}, 1, cursor));  // a cursor outlives a restart
}

TEST_F(StoreTest, KeepsALogForEachJob) {
  const JobRow job = create(), other = create();
  ASSERT_TRUE(store_->add_log(job.job_key, "warning", "something"));
  ASSERT_TRUE(store_->set_state(job.job_key, {JobState::kQueued}, JobState::kPaused, "user", ""));
  const auto lines = store_->read_log(job.job_key, 0, 100);
  ASSERT_EQ(lines->size(), 3U);
  EXPECT_EQ(lines->at(1).index, 2);
  EXPECT_EQ(lines->at(1).level, "warning");
  EXPECT_EQ(lines->at(1).message, "something");
  EXPECT_NE(lines->at(2).message.find("queued -> paused"), std::string::npos);
  EXPECT_EQ(store_->read_log(job.job_key, 1, 1)->at(0).index, 2);
  EXPECT_EQ(store_->read_log(other.job_key, 0, 100)->size(), 1U);
  EXPECT_EQ(store_->add_log(99, "info", "x").error().code, ErrorCode::kNotFound);
}

TEST_F(StoreTest, DeletesOnlyEndedJobsAndNothingOfTheOthers) {
  const JobRow kept = job_in(JobState::kRunning);
  store_->append_events(sample_batch(kept.job_key, 1, 50), [](const Status& status) { EXPECT_TRUE(status); });
  ASSERT_TRUE(store_->flush());
  NewJob with_key = new_job();
  with_key.idempotency_key = "key";
  const JobRow job = create(with_key);
  EXPECT_EQ(store_->delete_job(job.job_key).error().code, ErrorCode::kConflict);
  ASSERT_TRUE(store_->take_queued_job());
  store_->append_events(sample_batch(job.job_key, 1, 3500), [](const Status& status) { EXPECT_TRUE(status); });
  ASSERT_TRUE(store_->flush());
  ASSERT_TRUE(store_->finish_job(finishing(*store_->find_job(job.job_key), FinishReason::kCells), JobState::kSucceeded,
                                 "cells", ""));
  ASSERT_TRUE(store_->delete_job(job.job_key));
  EXPECT_EQ(store_->find_job(job.id).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(store_->read_events(job.job_key, {}, 1).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(store_->delete_job(job.job_key).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(store_->list_jobs({}, 10, "")->items.size(), 1U);
  EXPECT_NE(store_->create_job(with_key, 10)->job.id, job.id);  // the key went with the job
  EXPECT_EQ(store_->read_events(kept.job_key, {}, 100)->size(), 50U);
}

}  // namespace
}  // namespace colony::server
