#include "server/store/writer.hpp"

#include <pthread.h>

#include <algorithm>
#include <exception>
#include <future>
#include <memory>
#include <span>
#include <utility>

namespace colony::server {
namespace {
constexpr std::size_t kRequestsPerBatch = 256;  // so that a flood of requests cannot starve the events
constexpr int kCheckpointPages = 8000;          // 32 MB of log: a page that is written again and again is moved once
constexpr int kCheckpointWaitPages = 25'000;    // 100 MB: readers kept the log from restarting for too long
constexpr std::chrono::seconds kSweepRetry{10};

Status run_task(WriteTask& task, Connection& connection) {
  try {
    return task.run(connection);
  } catch (const DbError& error) {
    if (!error.is_constraint()) throw;  // the database is sick: the whole batch is undone
    return to_error(error);
  } catch (const std::exception& error) {
    return Error{ErrorCode::kInternal, error.what()};
  }
}
}  // namespace

Writer::Writer(Connection& connection, WriterLimits limits, std::function<bool(Connection&)> sweep)
    : connection_(connection), limits_(limits), sweep_(std::move(sweep)), thread_([this] { loop(); }) {}

Writer::~Writer() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  work_.notify_all();
  room_.notify_all();
  thread_.join();
}

Status Writer::wait_for(std::function<Status(Connection&)> run, bool in_order) {
  const auto promise = std::make_shared<std::promise<Status>>();  // shared: set_value may still touch it after get()
  std::future<Status> result = promise->get_future();
  WriteTask task{std::move(run), [promise](const Status& status) { promise->set_value(status); }, 1};
  {
    const std::lock_guard lock(mutex_);
    if (ending_) return Error{ErrorCode::kUnavailable, "the store is closing"};
    if (in_order) {
      if (bulk_.empty()) bulk_since_ = Clock::now();
      bulk_.push_back(std::move(task));
      bulk_urgent_.push_back(true);
      ++urgent_bulk_;
      ++bulk_rows_;
    } else {
      requests_.push_back(std::move(task));
    }
  }
  work_.notify_one();
  return result.get();
}

Status Writer::request(std::function<Status(Connection&)> run) { return wait_for(std::move(run), false); }

Status Writer::request_in_order(std::function<Status(Connection&)> run) { return wait_for(std::move(run), true); }

void Writer::submit_bulk(WriteTask task) {
  {
    std::unique_lock lock(mutex_);
    // An empty queue takes a task of any size, else one larger than the queue would wait for ever.
    room_.wait(lock, [&] { return ending_ || bulk_rows_ == 0 || bulk_rows_ + task.rows <= limits_.queued_rows_max; });
    if (!ending_) {
      if (bulk_.empty()) bulk_since_ = Clock::now();
      bulk_rows_ += task.rows;
      bulk_.push_back(std::move(task));
      bulk_urgent_.push_back(false);
      lock.unlock();
      work_.notify_one();
      return;
    }
  }
  task.done(Error{ErrorCode::kUnavailable, "the store is closing"});
}

void Writer::wake_sweep() {
  {
    const std::lock_guard lock(mutex_);
    sweep_pending_ = true;
  }
  work_.notify_one();
}

std::vector<WriteTask> Writer::next_batch(std::unique_lock<std::mutex>& lock) {
  std::vector<WriteTask> batch;
  std::size_t rows = 0;
  while (!requests_.empty() && batch.size() < kRequestsPerBatch) {
    rows += requests_.front().rows;
    batch.push_back(std::move(requests_.front()));
    requests_.pop_front();
  }
  bool first_bulk = true;
  while (!bulk_.empty() && (first_bulk || rows + bulk_.front().rows <= limits_.batch_rows_max)) {
    first_bulk = false;
    rows += bulk_.front().rows;
    bulk_rows_ -= bulk_.front().rows;
    batch.push_back(std::move(bulk_.front()));
    bulk_.pop_front();
    if (bulk_urgent_.front()) --urgent_bulk_;
    bulk_urgent_.pop_front();
  }
  bulk_since_ = Clock::now();
  lock.unlock();
  room_.notify_all();
  return batch;
}

void Writer::loop() {
  pthread_setname_np(pthread_self(), "writer");  // as operators see it, per thread
  std::unique_lock lock(mutex_);
  for (;;) {
    const bool due = !requests_.empty() || urgent_bulk_ > 0 || bulk_rows_ >= limits_.batch_rows_max ||
                     (!bulk_.empty() && (ending_ || Clock::now() >= bulk_since_ + limits_.batch_wait));
    if (due) {
      std::vector<WriteTask> batch = next_batch(lock);
      commit_batch(batch);
      checkpoint_if_long();
      lock.lock();
      continue;
    }
    if (ending_) return;  // a sweep half done is completed at the next start
    if (sweep_pending_ && Clock::now() >= sweep_not_before_) {
      sweep_pending_ = false;  // before the sweep: a wake_sweep() meanwhile must not be lost
      lock.unlock();
      const bool more = sweep_once();
      checkpoint_if_long();
      lock.lock();
      sweep_pending_ = sweep_pending_ || more;
      continue;
    }
    Clock::time_point until = Clock::time_point::max();
    if (!bulk_.empty()) until = bulk_since_ + limits_.batch_wait;
    if (sweep_pending_) until = std::min(until, sweep_not_before_);
    if (until == Clock::time_point::max()) {
      work_.wait(lock);
    } else {
      work_.wait_until(lock, until);
    }
  }
}

bool Writer::try_batch(std::span<WriteTask> tasks, std::vector<Status>& results) {
  results.clear();
  try {
    connection_.execute("BEGIN IMMEDIATE");
    for (WriteTask& task : tasks) {
      connection_.prepared("SAVEPOINT task").run();
      Status status = run_task(task, connection_);
      if (!status) connection_.prepared("ROLLBACK TO task").run();
      connection_.prepared("RELEASE task").run();
      results.push_back(std::move(status));
    }
    connection_.execute("COMMIT");
    commit_count_.fetch_add(1);
    return true;
  } catch (const DbError& error) {
    undo_batch();
    results.assign(tasks.size(), Status(to_error(error)));
    return false;
  } catch (const std::exception& error) {  // memory, say: not the end of the process that holds everybody's jobs
    undo_batch();
    results.assign(tasks.size(), Status(Error{ErrorCode::kStorage, error.what()}));
    return false;
  }
}

void Writer::undo_batch() {
  commit_count_.fetch_add(1);  // a commit that failed may have come further than it says
  try {
    if (connection_.in_transaction()) connection_.execute("ROLLBACK");
  } catch (const std::exception&) {
    // Nothing was committed either way; the next BEGIN reports what is wrong with the connection.
  }
}

void Writer::commit_batch(std::vector<WriteTask>& tasks) {
  std::vector<Status> results;
  if (!try_batch(tasks, results) && tasks.size() > 1) {
    std::vector<Status> single;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      try_batch(std::span(tasks).subspan(i, 1), single);
      results[i] = single[0];
    }
  }
  for (std::size_t i = 0; i < tasks.size(); ++i) tasks[i].done(results[i]);
}

void Writer::checkpoint_if_long() {
  const int pages = connection_.wal_pages();
  if (pages < kCheckpointPages) return;
  try {
    connection_.checkpoint(pages >= kCheckpointWaitPages);
  } catch (const DbError&) {
    // The log keeps every commit; the next commit tries again. A sick disk shows itself in the writes.
  }
}

bool Writer::sweep_once() {
  bool more = false;
  WriteTask task{[&](Connection& connection) {
                   more = sweep_(connection);
                   return Status(Ok{});
                 },
                 nullptr, 1};
  std::vector<Status> results;
  if (try_batch(std::span(&task, 1), results) && results[0]) return more;
  const std::lock_guard lock(mutex_);
  sweep_not_before_ = Clock::now() + kSweepRetry;
  return true;
}

}  // namespace colony::server
