// analysis_worker: one thread that works off the queued analyses and comparisons of the store, oldest first.
// Promise: what was running when the process died is tried again, kAnalysisTriesMax times at most; what stop() interrupts is put back and
//          costs no try. What is deleted while it is worked on is given up. A storage error is waited out.
// Why one: an analysis may take more than a gigabyte; two would double that, and the colonies need the cores.
// Threads: every function from any thread; stop() once.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "engine/base/stop.hpp"
#include "server/store/analyses.hpp"

namespace colony::server {

class AnalysisWorker {
 public:
  /// The result's JSON, or why there is none; the text of a problem's code goes with it (api/ has the table). Throws Stopped when asked to.
  struct Outcome {
    std::string result_json;   // empty: failed
    std::string failure_code;
    std::string detail;
  };
  using Work = std::function<Outcome(const AnalysisRow& row, StopFlag stop)>;

  AnalysisWorker(AnalysisStore& store, Work work) : store_(store), work_(std::move(work)) {}
  ~AnalysisWorker() { stop(); }
  AnalysisWorker(const AnalysisWorker&) = delete;
  AnalysisWorker& operator=(const AnalysisWorker&) = delete;

  Status start();
  /// Something was queued.
  void nudge();
  /// It was deleted: if it is the one under way, that work ends. Called after the store has removed it.
  void drop(const std::string& id);
  /// Ends the work under way and the thread.
  void stop();

 private:
  void loop();
  /// False: nothing to do now, or the store refused.
  bool work_one(bool& refused);

  AnalysisStore& store_;  // synchronises itself
  const Work work_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> give_up_{false};  // what the work under way polls: stop_, or its row is gone
  std::mutex mutex_;  // guards nudged_, running_id_ and the writes of give_up_
  std::string running_id_;
  std::condition_variable changed_;
  bool nudged_ = true;
  std::thread thread_;
};

}  // namespace colony::server
