// jobs_fixture: the job service over the real store and the real simulator.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include <gtest/gtest.h>

#include "engine/base/version.hpp"
#include "server/jobs/service.hpp"
#include "tests/support/failing_store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {

using tests::FailingStore;
using tests::Gate;
using tests::TempDir;

/// "<seed> <cells>": preset paper to so many cells; "bad": a spec that cannot be used; "<seed> <cells> 0": a spec that the
/// decoder lets pass and the simulator does not; "<seed> <cells> 1 <founders>": so many founders in a dish with room for them.
inline Result<RunSpec> decode(const std::string& text) {
  RunSpec spec;
  spec.params = *preset("paper");
  unsigned long long seed = 0, cells = 0;
  int broken = 1;
  long long founders = 1;
  if (std::sscanf(text.c_str(), "%llu %llu %d %lld", &seed, &cells, &broken, &founders) < 2)
    return Error{ErrorCode::kInvalid, "not a spec"};
  spec.seed = seed;
  spec.until.cells = cells;
  spec.params.search.points = 16'384;  // some milliseconds a search: a test can come between
  if (founders > 1) {
    spec.params.founders.count = founders;
    spec.params.founders.radius_um = 10'000.0;
  }
  if (broken == 0) spec.params.cycle.mean_h = -1.0;
  return spec;
}

inline NewJob new_job(std::uint64_t seed, std::uint64_t cells) {
  NewJob job;
  job.name = "test";
  job.spec_json = std::to_string(seed) + " " + std::to_string(cells);
  job.until_cells = cells;
  return job;
}

/// The codec of forks and verifications in these tests: an origin is "<at_seq>;<spec>;<its origin>", a task "<job id> <to_seq>".
inline VerifyCodec test_verify_codec() {
  VerifyCodec codec;
  codec.task = [](const std::string& text) -> Result<VerifyTask> {
    const std::size_t blank = text.find(' ');
    if (blank == std::string::npos) return Error{ErrorCode::kInvalid, "not a task"};
    return VerifyTask{text.substr(0, blank), std::stoull(text.substr(blank + 1))};
  };
  codec.stretches = [](const JobRow& job) -> Result<std::vector<Stretch>> {
    std::vector<Stretch> stretches = {{UINT64_MAX, *decode(job.spec_json)}};
    for (std::string origin = job.origin_json; !origin.empty();) {
      const std::size_t first = origin.find(';'), second = origin.find(';', first + 1);
      stretches.insert(stretches.begin(),
                       {std::stoull(origin.substr(0, first)), *decode(origin.substr(first + 1, second - first - 1))});
      origin = origin.substr(second + 1);
    }
    return stretches;
  };
  codec.result = [](const VerifyOutcome& outcome) {
    return outcome.identical ? "identical " + std::to_string(outcome.events)
                             : "different at " + std::to_string(outcome.first_differing_seq.value_or(0));
  };
  return codec;
}

inline NewJob verification_of(const JobRow& target) {
  NewJob job;
  job.kind = kVerifyKind;
  job.spec_json = target.id + " " + std::to_string(target.last_seq);
  return job;
}

/// Waits for a job by its announcements alone.
class Watch {
 public:
  Watch(JobService& service, std::string id) : service_(service), id_(std::move(id)) {
    subscription_ = service_.subscribe(service_.show(id_)->job.job_key, [this] {
      const std::lock_guard lock(mutex_);
      ++wakes_;
      changed_.notify_all();
    });
  }
  template <class Condition>
  JobView until(Condition condition) {
    for (;;) {
      std::uint64_t seen = 0;
      {
        const std::lock_guard lock(mutex_);
        seen = wakes_;
      }
      const auto view = service_.show(id_);
      EXPECT_TRUE(view);
      if (!view || condition(*view)) return *view;
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return wakes_ != seen; });
    }
  }
  JobView until_ended() {
    return until([](const JobView& view) { return is_terminal(view.job.state); });
  }
  JobView until_seq(std::uint64_t seq) {
    return until([=](const JobView& view) { return view.progress.last_seq >= seq || is_terminal(view.job.state); });
  }

 private:
  JobService& service_;
  const std::string id_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t wakes_ = 0;
  std::unique_ptr<JobService::Subscription> subscription_;
};

class JobsTest : public testing::Test {
 protected:
  void SetUp() override { open(); }
  void open(JobsConfig config = {}) {
    service_.reset();
    store_.reset();
    StoreConfig store_config;
    store_config.data_dir = dir_.path();
    auto store = Store::open(store_config);
    ASSERT_TRUE(store) << store.error().message;
    store_ = std::make_unique<FailingStore>(std::move(*store));
    config.storage_retry_ms = 1;
    service_ = JobService::create(*store_, config, decode, test_verify_codec());
  }
  void start() { ASSERT_TRUE(service_->start()); }
  std::string submit(const NewJob& job) {
    const auto submitted = service_->submit(job);
    EXPECT_TRUE(submitted) << submitted.error().message;
    return submitted->view.job.id;
  }
  /// A fork that goes on to so many cells by this seed.
  std::string fork(const std::string& id, std::uint64_t at_seq, std::uint64_t seed, std::uint64_t cells) {
    const auto point = service_->fork_point(id, std::nullopt, at_seq);
    EXPECT_TRUE(point) << point.error().message;
    NewJob job = new_job(seed, cells);
    job.origin_json = std::to_string(point->at_seq) + ";" + point->origin.spec_json + ";" + point->origin.origin_json;
    const auto made = service_->fork(job, *point);
    EXPECT_TRUE(made) << made.error().message;
    return made->view.job.id;
  }
  std::vector<Event> events(const std::string& id) { return *service_->events(id, {}, 1'000'000); }
  /// What a simulator makes of the same spec without store, pauses or restarts.
  static std::vector<Event> undisturbed(std::uint64_t seed, std::uint64_t cells) {
    Simulator simulator(*decode(new_job(seed, cells).spec_json));
    std::vector<Event> history;
    while (auto event = simulator.step()) history.push_back(*event);
    return history;
  }

  TempDir dir_;
  std::unique_ptr<FailingStore> store_;
  std::unique_ptr<JobService> service_;
};

}  // namespace colony::server
