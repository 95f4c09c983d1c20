// The index by cell: written late, exact at any moment, gone with its job, made for databases that came without it.
#include <algorithm>
#include <future>
#include <set>

#include <gtest/gtest.h>

#include "server/store/cell_index.hpp"
#include "server/store/connection.hpp"
#include "server/store/store.hpp"
#include "tests/support/old_schema.hpp"
#include "tests/support/sample_events.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using tests::sample_cell;
using tests::sample_event;
using tests::TempDir;

/// A division among the cells 1..97 every fourth event, a settled cell otherwise.
EventBatch many_cells(std::int64_t job_key, std::uint64_t first, std::uint64_t count) {
  EventBatch batch;
  batch.job_key = job_key;
  for (std::uint64_t seq = first; seq < first + count; ++seq) {
    EventBody body = Senesced{};
    if (seq % 4 == 1) {
      Divided divided;
      divided.cells = {sample_cell(static_cast<std::uint32_t>(seq % 97 + 1)),
                       sample_cell(static_cast<std::uint32_t>(seq % 89 + 1))};
      body = divided;
    }
    batch.events.push_back(sample_event(seq, std::move(body)));
    batch.events.back().cell_id = CellId{static_cast<std::uint32_t>(seq % 97 + 1)};
  }
  batch.cell_count = 97;
  return batch;
}

class StoreIndexTest : public testing::Test {
 protected:
  void SetUp() override { open(); }
  void open() {
    store_.reset();
    StoreConfig config;
    config.data_dir = dir_.path();
    auto opened = Store::open(config);
    ASSERT_TRUE(opened) << opened.error().message;
    store_ = std::move(*opened);
  }
  std::int64_t running_job() {
    NewJob job;
    job.name = "a colony";
    job.spec_json = "{}";
    EXPECT_TRUE(store_->create_job(job, 1000));
    return (*store_->take_queued_job())->job_key;
  }
  void append(EventBatch batch) {
    store_->append_events(std::move(batch),
                          [](const Status& status) { EXPECT_TRUE(status) << status.error().message; });
    ASSERT_TRUE(store_->flush());
  }
  std::int64_t number(const std::string& sql) {
    Connection reader(dir_.path() + "/colony.db", Connection::Access::kReader);
    Statement row = reader.prepare_once(sql);
    return row.step() ? row.integer(0) : -1;
  }
  /// The filter against a look through all events.
  void expect_exact(std::int64_t job_key) {
    const auto all = store_->read_events(job_key, {}, 1'000'000);
    ASSERT_TRUE(all);
    for (const std::uint64_t after : {std::uint64_t{0}, std::uint64_t{32'000}, all->back().seq - 30}) {
      for (const std::uint32_t cell : {1U, 7U, 89U, 96U, 97U, 98U}) {
        std::vector<std::uint64_t> expected, found;
        for (const Event& event : *all) {
          const auto* divided = std::get_if<Divided>(&event.body);
          const bool takes_part =
              event.cell_id == CellId{cell} ||
              (divided != nullptr && (divided->cells[0].id.value == cell || divided->cells[1].id.value == cell));
          if (takes_part && event.seq > after) expected.push_back(event.seq);
        }
        EventFilter filter;
        filter.after = after;
        filter.cell_id = cell;
        const auto filtered = store_->read_events(job_key, filter, 1'000'000);
        ASSERT_TRUE(filtered);
        for (const Event& event : *filtered) found.push_back(event.seq);
        EXPECT_EQ(found, expected) << "cell " << cell << " after " << after;
      }
    }
  }

  TempDir dir_;
  std::unique_ptr<Store> store_;
};

TEST_F(StoreIndexTest, IsExactWhileItGrows) {
  const std::int64_t other = running_job();
  append(many_cells(other, 1, 500));
  const std::int64_t job_key = running_job();
  const std::uint64_t step = kUnindexedEventsMax - 100;
  const auto indexed = [&] { return number("SELECT indexed_seq FROM job WHERE job_key = " + std::to_string(job_key)); };
  append(many_cells(job_key, 1, step));
  EXPECT_EQ(indexed(), 0);
  expect_exact(job_key);
  append(many_cells(job_key, step + 1, 200));
  EXPECT_EQ(indexed(), static_cast<std::int64_t>(step + 200));
  expect_exact(job_key);
  append(many_cells(job_key, step + 201, 50));
  EXPECT_EQ(indexed(), static_cast<std::int64_t>(step + 200)) << "the rest waits";
  expect_exact(job_key);
  expect_exact(other);
}

TEST_F(StoreIndexTest, GoesWithItsJob) {
  const std::int64_t kept = running_job();
  append(many_cells(kept, 1, kUnindexedEventsMax));
  const std::int64_t rows = number("SELECT count(*) FROM cell_event");
  EXPECT_GT(rows, static_cast<std::int64_t>(kUnindexedEventsMax));
  const std::int64_t job_key = running_job();
  append(many_cells(job_key, 1, kUnindexedEventsMax));
  EventBatch last;
  last.job_key = job_key;
  last.events = {sample_event(kUnindexedEventsMax + 1, Finished{FinishReason::kTime, 97})};
  ASSERT_TRUE(store_->finish_job(last, JobState::kSucceeded, "time", ""));
  EXPECT_EQ(number("SELECT count(*) FROM cell_event"), 2 * rows);
  ASSERT_TRUE(store_->delete_job(job_key));
  // The sweeper works in idle moments; every flush gives it some.
  for (int tries = 0; tries < 10'000 && number("SELECT count(*) FROM job WHERE deleted = 1") != 0; ++tries) {
    ASSERT_TRUE(store_->flush());
  }
  EXPECT_EQ(number("SELECT count(*) FROM cell_event"), rows);
  expect_exact(kept);
}

TEST_F(StoreIndexTest, IsMadeForADatabaseOfTheFirstSchema) {
  const std::int64_t job_key = running_job();
  append(many_cells(job_key, 1, 300));
  store_.reset();
  tests::take_back_to(dir_.path() + "/colony.db", 1);
  open();
  EXPECT_EQ(number("PRAGMA user_version"), 4);
  EXPECT_EQ(number("SELECT indexed_seq FROM job"), 300);
  EXPECT_EQ(number("SELECT count(*) FROM sqlite_schema WHERE name IN ('event_by_cell', 'placement_by_cell')"), 0);
  expect_exact(job_key);
  append(many_cells(job_key, 301, 100));
  expect_exact(job_key);
}

}  // namespace
}  // namespace colony::server
