// The worker of analyses: what is deleted ends, what the server's end interrupts is put back, and the next one is taken.
#include "server/jobs/analysis_worker.hpp"

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/store/store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using tests::TempDir;

class AnalysisWorkerTest : public ::testing::Test {
 protected:
  AnalysisWorkerTest() {
    StoreConfig config;
    config.data_dir = dir_.path();
    auto store = Store::open(config);
    EXPECT_TRUE(store);
    store_ = std::move(*store);
  }
  AnalysisStore& analyses() { return store_->analyses(); }
  AnalysisRow queued(const std::string& name) {
    NewAnalysis analysis;
    analysis.name = name;
    analysis.options_json = "{}";
    analysis.media_type = "image/png";
    analysis.image = "bytes";
    return *analyses().create(analysis, {1'000'000, 100});
  }
  void say(const std::string& what) {
    const std::lock_guard lock(mutex_);
    said_.push_back(what);
    changed_.notify_all();
  }
  void wait_for(const std::string& what) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return std::find(said_.begin(), said_.end(), what) != said_.end(); });
  }

  TempDir dir_;
  std::unique_ptr<Store> store_;
  std::mutex mutex_;  // guards said_
  std::condition_variable changed_;
  std::vector<std::string> said_;
};

TEST_F(AnalysisWorkerTest, ADeletedRowEndsAndTheNextIsTaken) {
  const AnalysisRow endless = queued("endless"), next = queued("next");
  AnalysisWorker worker(analyses(), [this](const AnalysisRow& row, StopFlag stop) -> AnalysisWorker::Outcome {
    say("began " + row.name);
    while (row.name == "endless") {
      throw_if_stopped(stop);
      std::this_thread::yield();
    }
    say("ended " + row.name);
    return {"{}", {}, {}};
  });
  ASSERT_TRUE(worker.start());
  wait_for("began endless");
  worker.drop(next.id);  // of a row that is not under way nothing ends
  ASSERT_TRUE(analyses().remove(AnalysisKind::kAnalysis, endless.id));
  worker.drop(endless.id);
  wait_for("ended next");
  worker.stop();
  EXPECT_EQ(analyses().find(AnalysisKind::kAnalysis, next.id)->state, AnalysisState::kSucceeded);
}

TEST_F(AnalysisWorkerTest, StoppingPutsBackWhatWasUnderWay) {
  const AnalysisRow endless = queued("endless");
  AnalysisWorker worker(analyses(), [this](const AnalysisRow&, StopFlag stop) -> AnalysisWorker::Outcome {
    say("began");
    for (;;) {
      throw_if_stopped(stop);
      std::this_thread::yield();
    }
  });
  ASSERT_TRUE(worker.start());
  wait_for("began");
  worker.stop();
  const auto row = analyses().find(AnalysisKind::kAnalysis, endless.id);
  EXPECT_EQ(row->state, AnalysisState::kQueued);
  EXPECT_EQ(row->try_count, 0);
}

}  // namespace
}  // namespace colony::server
