#include "server/jobs/analysis_worker.hpp"

#include <exception>
#include <utility>

namespace colony::server {
namespace {
constexpr std::chrono::seconds kStorageRetry{2};
}  // namespace

Status AnalysisWorker::start() {
  if (Status recovered = store_.recover(); !recovered) return recovered;
  thread_ = std::thread([this] { loop(); });
  return Ok{};
}

void AnalysisWorker::nudge() {
  {
    const std::lock_guard lock(mutex_);
    nudged_ = true;
  }
  changed_.notify_one();
}

void AnalysisWorker::drop(const std::string& id) {
  const std::lock_guard lock(mutex_);
  if (running_id_ == id) give_up_ = true;
}

void AnalysisWorker::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    give_up_ = true;
  }
  nudge();
  if (thread_.joinable()) thread_.join();
}

void AnalysisWorker::loop() {
  while (!stop_) {
    {
      const std::lock_guard lock(mutex_);
      nudged_ = false;
    }
    bool refused = false;
    if (work_one(refused)) continue;
    std::unique_lock lock(mutex_);
    const auto ready = [this] { return nudged_ || stop_.load(); };
    if (refused) {
      changed_.wait_for(lock, kStorageRetry, [this] { return stop_.load(); });
    } else {
      changed_.wait(lock, ready);
    }
  }
}

bool AnalysisWorker::work_one(bool& refused) {
  const auto taken = store_.take_queued();
  if (!taken) {
    refused = true;
    return false;
  }
  if (!*taken) return false;
  const AnalysisRow& row = **taken;
  {
    const std::lock_guard lock(mutex_);
    running_id_ = row.id;
    give_up_ = stop_.load();
  }
  // Deleted between being taken and being known to drop(): that is seen here, every later deletion by drop().
  if (const auto there = store_.find(row.kind, row.id); !there && there.error().code == ErrorCode::kNotFound) return true;
  Outcome outcome;
  try {
    outcome = work_(row, &give_up_);
  } catch (const Stopped&) {
    if (!stop_) return true;  // it was deleted
    (void)store_.put_back(row.analysis_key);  // if not: the next start finds it running, and tries it again
    return false;
  } catch (const std::exception& error) {
    outcome = {{}, "internal", error.what()};
  }
  for (;;) {
    const Status written = outcome.result_json.empty()
                               ? store_.fail(row.analysis_key, outcome.failure_code, outcome.detail)
                               : store_.succeed(row.analysis_key, outcome.result_json);
    if (written || written.error().code == ErrorCode::kNotFound) return true;  // deleted meanwhile
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, kStorageRetry, [this] { return stop_.load(); })) return false;
  }
}

}  // namespace colony::server
