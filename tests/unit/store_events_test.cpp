// The event log of the store: exactness, order, group commit, limits, and what a killed process leaves behind.
#include <csignal>
#include <cstring>
#include <filesystem>
#include <future>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "server/store/connection.hpp"
#include "server/store/store.hpp"
#include "server/store/writer.hpp"
#include "tests/support/sample_events.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using tests::events_of_every_kind;
using tests::sample_batch;
using tests::sample_event;
using tests::TempDir;

Result<std::unique_ptr<Store>> open_store(const std::string& path, std::uint64_t bytes_max = 0) {
  StoreConfig config;
  config.data_dir = path;
  config.database_bytes_max = bytes_max;
  return Store::open(config);
}

std::int64_t running_job(Store& store) {
  NewJob job;
  job.name = "a colony";
  job.spec_json = "{}";
  EXPECT_TRUE(store.create_job(job, 1000));
  return (*store.take_queued_job())->job_key;
}

Status append(Store& store, EventBatch batch) {
  auto promise = std::make_shared<std::promise<Status>>();
  auto result = promise->get_future();
  store.append_events(std::move(batch), [promise](const Status& status) { promise->set_value(status); });
  return result.get();
}

std::uint64_t bits(double value) {
  std::uint64_t raw = 0;
  std::memcpy(&raw, &value, sizeof raw);
  return raw;
}

class StoreEventsTest : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = open_store(dir_.path());
    ASSERT_TRUE(opened) << opened.error().message;
    store_ = std::move(*opened);
    job_key_ = running_job(*store_);
  }
  void reopen() {
    store_.reset();
    auto opened = open_store(dir_.path());
    ASSERT_TRUE(opened) << opened.error().message;
    store_ = std::move(*opened);
  }

  TempDir dir_;
  std::unique_ptr<Store> store_;
  std::int64_t job_key_ = 0;
};

TEST_F(StoreEventsTest, EveryKindComesBackAsItWent) {
  EventBatch batch;
  batch.job_key = job_key_;
  batch.events = events_of_every_kind();
  batch.cell_count = 5;
  batch.active_count = 3;
  batch.passive_count = 1;
  batch.senescent_count = 1;
  const EventBatch sent = batch;
  const auto finished = store_->finish_job(batch, JobState::kSucceeded, "exhausted", "");
  ASSERT_TRUE(finished) << finished.error().message;
  for (int round = 0; round < 2; ++round) {  // the second time from the file
    const auto read = store_->read_events(job_key_, {}, 1000);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->size(), sent.events.size());
    for (std::size_t i = 0; i < sent.events.size(); ++i) EXPECT_EQ(read->at(i), sent.events[i]) << "event " << i + 1;
    const JobRow job = *store_->find_job(job_key_);
    EXPECT_EQ(job.last_seq, sent.events.size());
    EXPECT_EQ(job.digest, sent.events.back().digest);
    EXPECT_EQ(bits(job.time_h), bits(sent.events.back().time_h));
    EXPECT_EQ(job.cell_count, 5U);
    EXPECT_EQ(job.active_count, 3U);
    EXPECT_EQ(job.passive_count + job.senescent_count, 2U);
    reopen();
  }
}

TEST_F(StoreEventsTest, RefusesWhatItCouldNotKeepExactly) {
  for (const double value : {-0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EventBatch batch;
    batch.job_key = job_key_;
    batch.events = {sample_event(1, Senesced{}), sample_event(2, Inhibited{0.5, value, 1, 2, false, 3.0})};
    const Status status = append(*store_, batch);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::kInternal);
    EXPECT_EQ(store_->find_job(job_key_)->last_seq, 0U);
    EXPECT_TRUE(store_->read_events(job_key_, {}, 10)->empty());  // the whole batch, or nothing
  }
}

TEST_F(StoreEventsTest, FiltersBySeqKindAndCell) {
  ASSERT_TRUE(append(*store_, sample_batch(job_key_, 1, 100)));
  const auto all = store_->read_events(job_key_, {}, 1000);
  ASSERT_EQ(all->size(), 100U);
  EventFilter filter;
  filter.after = 90;
  EXPECT_EQ(store_->read_events(job_key_, filter, 4)->back().seq, 94U);
  EXPECT_EQ(store_->read_events(job_key_, filter, 1000)->size(), 10U);
  filter = {};
  filter.kinds = {EventKind::kDivided};
  EXPECT_EQ(store_->read_events(job_key_, filter, 1000)->size(), 25U);
  filter.kinds = {EventKind::kMoved, EventKind::kFounded};
  EXPECT_TRUE(store_->read_events(job_key_, filter, 1000)->empty());
  for (std::uint32_t cell = 0; cell <= 12; ++cell) {
    filter = {};
    filter.cell_id = cell;
    std::vector<Event> expected;
    for (const Event& event : *all) {
      const auto* divided = std::get_if<Divided>(&event.body);
      if (event.cell_id == CellId{cell} || (divided != nullptr && (cell == 1 || cell == 2))) expected.push_back(event);
    }
    EXPECT_EQ(*store_->read_events(job_key_, filter, 1000), expected) << "cell " << cell;
  }
}

TEST_F(StoreEventsTest, FindsTheLastEventOfATime) {
  EXPECT_EQ(*store_->seq_at(job_key_, 5.0), 0U);
  ASSERT_TRUE(append(*store_, sample_batch(job_key_, 1, 30)));  // times seq / 3
  EXPECT_EQ(*store_->seq_at(job_key_, 0.0), 0U);
  EXPECT_EQ(*store_->seq_at(job_key_, 5.0), 15U);
  EXPECT_EQ(*store_->seq_at(job_key_, 5.1), 15U);
  EXPECT_EQ(*store_->seq_at(job_key_, 1e9), 30U);
  EventBatch same = sample_batch(job_key_, 31, 3);
  for (Event& event : same.events) event.time_h = 10.0;  // as event 30
  ASSERT_TRUE(append(*store_, same));
  EXPECT_EQ(*store_->seq_at(job_key_, 10.0), 33U);
}

TEST_F(StoreEventsTest, KeepsSeriesWithTheEvents) {
  EventBatch batch = sample_batch(job_key_, 1, 3);
  batch.series = {{0.0, 1, 1, 0, 0, 0.1, 0.0, 5.5, 95.0, 1e4},
                  {1.0, 2, 1, 1, 0, 1.0 / 3.0, 2.0 / 3.0, 7.5, 170.0, 1.1e4}};
  ASSERT_TRUE(append(*store_, batch));
  const auto rows = store_->read_series(job_key_);
  ASSERT_EQ(rows->size(), 2U);
  EXPECT_EQ(bits(rows->at(1).volume_mean_um3), bits(1.0 / 3.0));
  EXPECT_EQ(rows->at(1).cell_count, 2U);
  EXPECT_EQ(rows->at(1).passive_count, 1U);
  EXPECT_EQ(rows->at(0).radius_um, 5.5);
  EXPECT_EQ(rows->at(0).density_per_mm2, 1e4);
}

TEST_F(StoreEventsTest, SeqStaysDense) {
  ASSERT_TRUE(append(*store_, sample_batch(job_key_, 1, 5)));
  EXPECT_EQ(append(*store_, sample_batch(job_key_, 5, 2)).error().code, ErrorCode::kConflict);
  EXPECT_EQ(append(*store_, sample_batch(job_key_, 7, 2)).error().code, ErrorCode::kConflict);
  EXPECT_EQ(append(*store_, sample_batch(99, 1, 2)).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(store_->find_job(job_key_)->last_seq, 5U);
  ASSERT_TRUE(store_->set_state(job_key_, {JobState::kRunning}, JobState::kPaused, "user", ""));
  EXPECT_EQ(append(*store_, sample_batch(job_key_, 6, 1)).error().code, ErrorCode::kConflict);
}

TEST_F(StoreEventsTest, CallbacksComeInOrderAfterTheirCommit) {
  std::vector<std::uint64_t> seen;  // the writer thread's until flush() returns
  for (std::uint64_t i = 0; i < 400; ++i) {
    store_->append_events(sample_batch(job_key_, 1 + 5 * i, 5), [&seen, i](const Status& status) {
      EXPECT_TRUE(status);
      seen.push_back(i);
    });
  }
  ASSERT_TRUE(store_->flush());
  ASSERT_EQ(seen.size(), 400U);
  for (std::uint64_t i = 0; i < 400; ++i) EXPECT_EQ(seen[i], i);
  EXPECT_EQ(store_->find_job(job_key_)->last_seq, 2000U);
  EXPECT_EQ(store_->read_events(job_key_, {}, 5000)->size(), 2000U);
}

TEST_F(StoreEventsTest, FinishComesAfterWhatWasQueuedBefore) {
  store_->append_events(sample_batch(job_key_, 1, 3000), [](const Status&) {});
  EventBatch last;
  last.job_key = job_key_;
  last.events = {sample_event(3001, Finished{FinishReason::kTime, 7})};
  const auto ended = store_->finish_job(last, JobState::kSucceeded, "time", "");
  ASSERT_TRUE(ended) << ended.error().message;
  EXPECT_EQ(ended->last_seq, 3001U);
  EXPECT_EQ(append(*store_, sample_batch(job_key_, 3002, 1)).error().code, ErrorCode::kConflict);  // the end absorbs
}

TEST_F(StoreEventsTest, AnAppendLargerThanTheQueueStillGoesThrough) {
  StoreConfig config;
  config.data_dir = dir_.path() + "/small";
  config.queued_events_max = 10;
  auto small = Store::open(config);
  ASSERT_TRUE(small);
  const std::int64_t job_key = running_job(**small);
  for (std::uint64_t i = 0; i < 20; ++i) {
    (*small)->append_events(sample_batch(job_key, 1 + 50 * i, 50), [](const Status& status) { EXPECT_TRUE(status); });
  }
  ASSERT_TRUE((*small)->flush());
  EXPECT_EQ((*small)->find_job(job_key)->last_seq, 1000U);
}

TEST(StoreFull, AnErrorLeavesTheDataAsBefore) {
  const TempDir dir;
  auto store = open_store(dir.path(), 400'000);
  ASSERT_TRUE(store) << store.error().message;
  const std::int64_t job_key = running_job(**store);
  Status status = Ok{};
  std::uint64_t stored = 0;
  while (status && stored < 100'000) {
    status = append(**store, sample_batch(job_key, stored + 1, 100));
    if (status) stored += 100;
  }
  ASSERT_FALSE(status) << "the limit did not hold";
  EXPECT_EQ(status.error().code, ErrorCode::kStorage);
  EXPECT_GT(stored, 0U);
  EXPECT_EQ((*store)->find_job(job_key)->last_seq, stored);
  EXPECT_EQ((*store)->read_events(job_key, {}, 1'000'000)->size(), stored);
  EXPECT_FALSE((*store)->check_writable(1'000'000));
  store->reset();
  store = open_store(dir.path());
  ASSERT_TRUE(store);
  EXPECT_TRUE((*store)->check_writable(1));
  EXPECT_TRUE(append(**store, sample_batch(job_key, stored + 1, 100)));
}

TEST(WriterTasks, AnExceptionFailsItsTaskAlone) {
  const TempDir dir;
  Connection connection(dir.path() + "/plain.db", Connection::Access::kWriter);
  connection.execute("CREATE TABLE number (value INTEGER)");
  const auto insert = [](Connection& to) -> Status {
    to.execute("INSERT INTO number VALUES (1)");
    return Ok{};
  };
  {
    Writer writer(connection, {1000, std::chrono::milliseconds(50), 1000},
                  [](Connection&) -> bool { throw std::runtime_error("a sweep"); });
    const Status failed = writer.request([&](Connection& to) -> Status {
      (void)insert(to);
      throw std::bad_alloc();
    });
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().code, ErrorCode::kInternal);
    EXPECT_TRUE(writer.request(insert));
  }
  Statement count = connection.prepare_once("SELECT count(*) FROM number");
  ASSERT_TRUE(count.step());
  EXPECT_EQ(count.integer(0), 1);
}

TEST(StoreWritable, AsksForFreeSpace) {
  const TempDir dir;
  auto store = open_store(dir.path());
  ASSERT_TRUE(store);
  EXPECT_TRUE((*store)->check_writable(1));
  EXPECT_EQ((*store)->check_writable(~std::uint64_t{0}).error().code, ErrorCode::kStorage);
}

/// Runs `body(store)` in a child process that dies by SIGKILL in the middle of it, or of its own after it.
template <class Body>
void in_killed_child(const std::string& path, Body body) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto store = open_store(path);
    if (!store) _exit(3);
    body(**store);
    kill(getpid(), SIGKILL);
    _exit(4);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status)) << "the child ended by itself, exit " << WEXITSTATUS(status);
}

TEST(StoreCrash, WhatWasConfirmedIsThereAndDense) {
  const TempDir dir;
  int confirmed[2];
  ASSERT_EQ(pipe(confirmed), 0);
  in_killed_child(dir.path(), [&](Store& store) {
    const std::int64_t job_key = running_job(store);
    for (std::uint64_t i = 0; i < 200; ++i) {
      const std::uint64_t first = 1 + 7 * i;
      store.append_events(sample_batch(job_key, first, 7), [&, last = first + 6](const Status& status) {
        if (!status || write(confirmed[1], &last, sizeof last) != sizeof last) _exit(5);
        if (last > 700) kill(getpid(), SIGKILL);  // on the writer thread, with batches waiting behind
      });
    }
    (void)store.flush();
  });
  close(confirmed[1]);
  std::uint64_t last_confirmed = 0, next = 0;
  while (read(confirmed[0], &next, sizeof next) == sizeof next) last_confirmed = next;
  close(confirmed[0]);
  EXPECT_GT(last_confirmed, 700U);
  auto store = open_store(dir.path());
  ASSERT_TRUE(store) << store.error().message;  // the lock died with its process
  const auto running = (*store)->running_jobs();
  ASSERT_EQ(running->size(), 1U);
  const JobRow job = running->at(0);
  EXPECT_GE(job.last_seq, last_confirmed);
  EXPECT_EQ(job.last_seq % 7, 0U);  // batches are whole
  const auto events = (*store)->read_events(job.job_key, {}, 100'000);
  ASSERT_EQ(events->size(), job.last_seq);
  EXPECT_EQ(*events, sample_batch(job.job_key, 1, job.last_seq).events);
  EXPECT_EQ(job.digest, events->back().digest);
  EXPECT_TRUE(append(**store, sample_batch(job.job_key, job.last_seq + 1, 3)));
}

TEST(StoreCrash, ADeletionCutShortIsCompleted) {
  const TempDir dir;
  in_killed_child(dir.path(), [](Store& store) {
    const std::int64_t job_key = running_job(store);
    EventBatch batch = sample_batch(job_key, 1, 20'000);
    batch.events.push_back(sample_event(20'001, Finished{FinishReason::kTime, 1}));
    if (!store.finish_job(batch, JobState::kSucceeded, "time", "")) _exit(6);
    if (!store.delete_job(job_key)) _exit(7);
  });
  // In the file or still in the log, in which the one large transaction wrote every page once.
  const std::uint64_t bytes = std::filesystem::file_size(dir.path() + "/colony.db") +
                              std::filesystem::file_size(dir.path() + "/colony.db-wal");
  ASSERT_GT(bytes, 1'000'000U);
  auto store = open_store(dir.path(), bytes + bytes / 4);
  ASSERT_TRUE(store);
  EXPECT_TRUE((*store)->list_jobs({}, 10, "")->items.empty());
  // A second history as long as the first fits below this limit only where the first one was: the sweep must free its pages.
  const std::int64_t job_key = running_job(**store);
  Status status = Ok{};
  for (int tries = 0; tries < 1000; ++tries) {  // every refused try leaves the sweeper an idle moment
    status = append(**store, sample_batch(job_key, 1, 20'000));
    if (status) break;
    ASSERT_EQ(status.error().code, ErrorCode::kStorage);
  }
  EXPECT_TRUE(status);
  EXPECT_EQ((*store)->read_events(job_key, {}, 100'000)->size(), 20'000U);
}

}  // namespace
}  // namespace colony::server
