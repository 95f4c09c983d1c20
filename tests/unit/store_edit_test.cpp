// Name and labels of a job, changed in one transaction; and where a page of events ends.
#include <thread>

#include <gtest/gtest.h>

#include "server/store/store.hpp"
#include "tests/support/sample_events.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using Labels = std::map<std::string, std::string>;

JobTextChange named(const char* name) {
  JobTextChange change;
  change.name = name;
  return change;
}

class StoreEditTest : public testing::Test {
 protected:
  void SetUp() override { open(); }
  void open() {
    store_.reset();
    StoreConfig config;
    config.data_dir = dir_.path();
    auto store = Store::open(config);
    ASSERT_TRUE(store) << store.error().message;
    store_ = std::move(*store);
  }
  JobRow create() {
    NewJob job;
    job.name = "before";
    job.labels = {{"plate", "7"}, {"dye", "none"}};
    job.spec_json = R"({"seed": 1})";
    return store_->create_job(job, 1000)->job;
  }
  Store::TextUpdated update(std::int64_t key, const JobTextChange& change,
                            const std::optional<std::vector<std::uint64_t>>& revisions = {}) {
    const auto updated = store_->update_job_text(key, change, {revisions, {}}, "alice");
    EXPECT_TRUE(updated) << updated.error().message;
    return *updated;
  }

  tests::TempDir dir_;
  std::unique_ptr<Store> store_;
};

TEST_F(StoreEditTest, ChangesWhatIsNamedAndGrowsTheRevision) {
  const JobRow job = create();
  JobTextChange change;
  change.labels = {{"plate", "8"}, {"dye", std::nullopt}, {"none", std::nullopt}, {"new", "x"}};
  auto updated = update(job.job_key, change);
  EXPECT_TRUE(updated.changed);
  EXPECT_EQ(updated.job.revision, job.revision + 1);
  open();
  const JobRow stored = *store_->find_job(job.job_key);
  EXPECT_EQ(stored.name, "before");
  EXPECT_EQ(stored.labels, (Labels{{"new", "x"}, {"plate", "8"}}));
  EXPECT_EQ(stored.revision, job.revision + 1);
  EXPECT_EQ(stored.state, job.state);
  JobFilter by_label;
  by_label.labels = {{"plate", "8"}};
  EXPECT_EQ(store_->list_jobs(by_label, 10, "")->items.size(), 1u);
  by_label.labels = {{"dye", "none"}};
  EXPECT_TRUE(store_->list_jobs(by_label, 10, "")->items.empty());
  const auto log = store_->read_log(job.job_key, 0, 100);
  EXPECT_EQ(log->back().message, R"(label new = "x"; label plate = "8"; label dye removed)");
  EXPECT_EQ(log->back().actor, "alice");

  JobTextChange all;
  all.name = "";
  all.drops_labels = true;
  updated = update(job.job_key, all);
  EXPECT_EQ(updated.job.name, "");
  EXPECT_TRUE(updated.job.labels.empty());
  JobFilter by_name;
  by_name.name = "before";
  EXPECT_TRUE(store_->list_jobs(by_name, 10, "")->items.empty());
}

TEST_F(StoreEditTest, WhatLeavesAllAsItWasIsNoChange) {
  const JobRow job = create();
  const std::size_t lines = store_->read_log(job.job_key, 0, 100)->size();
  JobTextChange same;
  same.name = "before";
  same.labels = {{"plate", "7"}, {"none", std::nullopt}};
  EXPECT_FALSE(update(job.job_key, same).changed);
  EXPECT_FALSE(update(job.job_key, {}).changed);
  EXPECT_EQ(store_->find_job(job.job_key)->revision, job.revision);
  EXPECT_EQ(store_->read_log(job.job_key, 0, 100)->size(), lines);
}

TEST_F(StoreEditTest, AnotherRevisionOrTooManyLabelsChangeNothing) {
  const JobRow job = create();
  JobTextChange change;
  change.name = "after";
  auto refused = update(job.job_key, change, std::vector<std::uint64_t>{job.revision + 1, 99});
  EXPECT_FALSE(refused.is_current);
  EXPECT_EQ(refused.job.name, "before");
  refused = update(job.job_key, change, std::vector<std::uint64_t>{});
  EXPECT_FALSE(refused.is_current) << "a condition that names no revision is never met";
  change.labels = {{"third", "x"}};
  change.labels_max = 2;
  const auto error = store_->update_job_text(job.job_key, change, {}, "alice");
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().code, ErrorCode::kInvalid);
  EXPECT_EQ(error.error().fields.at(0).pointer, "/labels");
  EXPECT_EQ(store_->find_job(job.job_key)->name, "before");
  EXPECT_EQ(store_->find_job(job.job_key)->revision, job.revision);
  EXPECT_TRUE(update(job.job_key, named("after"), std::vector<std::uint64_t>{5, job.revision}).changed);
  EXPECT_EQ(store_->update_job_text(77, change, {}, "alice").error().code, ErrorCode::kNotFound);
}

TEST_F(StoreEditTest, OfManyWithOneRevisionOneWins) {
  const JobRow job = create();
  std::vector<std::thread> threads;
  std::atomic<int> won{0};
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] {
      JobTextChange change;
      change.name = "by " + std::to_string(i);
      const auto done = store_->update_job_text(job.job_key, change, {std::vector<std::uint64_t>{job.revision}, {}}, "x");
      if (done && done->is_current) ++won;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(won, 1);
  EXPECT_EQ(store_->find_job(job.job_key)->revision, job.revision + 1);
}

// What was changed after somebody looked is not deleted, nor commanded, by what they saw: the revision is compared in the transaction.
TEST_F(StoreEditTest, ADeletionOrACommandWithAnotherRevisionDoesNothing) {
  const JobRow job = create();
  const RevisionCondition as_seen{std::vector<std::uint64_t>{job.revision}, {}}, but_this{std::nullopt, {job.revision + 1}};
  ASSERT_TRUE(update(job.job_key, named("after")).changed);
  for (const RevisionCondition& condition : {as_seen, but_this, RevisionCondition{std::vector<std::uint64_t>{}, {}}}) {
    for (const JobCommand what : {JobCommand::kPause, JobCommand::kResume, JobCommand::kCancel}) {
      const auto commanded = store_->command_job(job.job_key, what, "x", condition);
      ASSERT_TRUE(commanded);
      EXPECT_FALSE(commanded->is_current || commanded->changed || commanded->pending);
      EXPECT_EQ(commanded->job.revision, job.revision + 1);
    }
    EXPECT_FALSE(store_->delete_job(job.job_key, condition)->is_current) << "before its state is looked at";
  }
  EXPECT_EQ(store_->find_job(job.job_key)->state, JobState::kQueued);
  const RevisionCondition now{std::vector<std::uint64_t>{99, job.revision + 1}, {job.revision}};
  const auto cancelled = store_->command_job(job.job_key, JobCommand::kCancel, "x", now);
  ASSERT_TRUE(cancelled && cancelled->changed && cancelled->is_current);
  EXPECT_FALSE(store_->delete_job(job.job_key, now)->is_current);
  EXPECT_EQ(store_->find_job(job.job_key)->state, JobState::kCancelled) << "still there";
  const auto deleted = store_->delete_job(job.job_key, {std::vector<std::uint64_t>{cancelled->job.revision}, {}});
  ASSERT_TRUE(deleted && deleted->is_current);
  EXPECT_EQ(store_->find_job(job.job_key).error().code, ErrorCode::kNotFound);
}

TEST_F(StoreEditTest, OfAnEditAndADeletionWithOneRevisionOneIsDone) {
  for (int round = 0; round < 50; ++round) {
    JobRow job = create();
    job = store_->command_job(job.job_key, JobCommand::kCancel)->job;
    const RevisionCondition as_seen{std::vector<std::uint64_t>{job.revision}, {}};
    bool is_edited = false, is_deleted = false;
    std::thread editor([&] {
      const auto done = store_->update_job_text(job.job_key, named("kept"), as_seen, "x");
      is_edited = done && done->is_current;
    });
    const auto deleted = store_->delete_job(job.job_key, as_seen);
    is_deleted = deleted && deleted->is_current;
    editor.join();
    EXPECT_NE(is_edited, is_deleted);
    EXPECT_EQ(static_cast<bool>(store_->find_job(job.job_key)), is_edited);
  }
}

// A runner's batches write the row too: they must not bring the old text back.
TEST_F(StoreEditTest, StaysWhileTheJobGrowsAndAfterItEnded) {
  const JobRow job = create();
  ASSERT_TRUE(store_->take_queued_job());
  update(job.job_key, named("while running"));
  store_->append_events(tests::sample_batch(job.job_key, 1, 3), [](const Status& status) { EXPECT_TRUE(status); });
  ASSERT_TRUE(store_->flush());
  EXPECT_EQ(store_->find_job(job.job_key)->name, "while running");
  ASSERT_TRUE(store_->command_job(job.job_key, JobCommand::kCancel));
  JobRow now = *store_->find_job(job.job_key);
  EXPECT_EQ(now.command, "cancel");
  EXPECT_EQ(update(job.job_key, named("again")).job.command, "cancel") << "the wish stands";
  now = *store_->find_job(job.job_key);
  EXPECT_EQ(now.last_seq, 3u);
  EXPECT_EQ(now.command, "cancel");
}

TEST_F(StoreEditTest, APageEndsWhereOneMoreEventFollows) {
  const JobRow job = create();
  ASSERT_TRUE(store_->take_queued_job());
  store_->append_events(tests::sample_batch(job.job_key, 1, 30), [](const Status& status) { EXPECT_TRUE(status); });
  ASSERT_TRUE(store_->flush());
  std::vector<EventFilter> filters(4);
  filters[1].kinds = {EventKind::kFounded, EventKind::kDivided};
  filters[2].cell_id = 1;
  filters[3].kinds = {EventKind::kSettled};
  filters[3].after = 7;
  for (const EventFilter& filter : filters) {
    const auto all = *store_->read_events(job.job_key, filter, 1000);
    for (std::size_t limit = 1; limit <= all.size() + 1; ++limit) {
      const auto end = store_->page_end(job.job_key, filter, limit);
      ASSERT_TRUE(end);
      const std::optional<std::uint64_t> expected = all.size() > limit ? std::optional(all[limit - 1].seq) : std::nullopt;
      EXPECT_EQ(*end, expected) << limit << " of " << all.size();
    }
  }
  EXPECT_EQ(store_->page_end(99, {}, 1).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace colony::server
