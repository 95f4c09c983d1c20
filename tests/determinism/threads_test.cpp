// Threads and windows: what may run at once never shows. One history on any number of threads, for any window, from any
// prefix. The bounds this rests on are tested in conflict_test.cpp.
#include <xmmintrin.h>

#include <atomic>
#include <cstdio>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "engine/base/check.hpp"
#include "engine/sim/simulator.hpp"
#include "tests/support/runs.hpp"
#include "tests/support/scale.hpp"

namespace colony {

struct SimulatorProbe {
  static void scale_bounds(Simulator& simulator, double scale) {
    simulator.window_.scale_bounds(simulator.spec().params, scale);
  }
};

namespace {

constexpr int kThreads[] = {1, 2, 3, 7, 16};
constexpr double kWindows_h[] = {0.1, 0.25, 1.0, 2.0};

struct Scene {
  std::string name;
  RunSpec spec;
};

RunSpec founders(Seed seed, std::int64_t count, double radius_um, double time_h) {
  RunSpec spec = testing::spec_of(seed, 100'000, *preset("clonogenic"));
  spec.params.founders.count = count;
  spec.params.founders.radius_um = radius_um;
  spec.params.dish.radius_um.reset();
  spec.until = {std::nullopt, time_h};
  return spec;
}

// Many founders side by side, to confluence against the wall: every event has others of the same hour around it.
RunSpec packed() {
  RunSpec spec = founders(3, testing::scaled(60, 150), testing::scaled(110.0, 180.0), testing::scaled(24.0, 48.0));
  spec.params.dish.radius_um = spec.params.founders.radius_um + 30.0;
  return spec;
}

std::vector<Scene> scenes() {
  std::vector<Scene> all;
  all.push_back({"paper", testing::spec_of(1, testing::scaled(60, 250))});
  all.push_back({"60 founders", founders(2, 60, 250.0, testing::scaled(20.0, 40.0))});
  all.push_back({"packed, with a wall", packed()});
  all.push_back({"wake always", testing::spec_of(4, testing::scaled(40, 150))});
  all.back().spec.params.wake.rule = WakeRule::kAlways;
  all.push_back({"retained, max", founders(5, 12, 60.0, testing::scaled(14.0, 30.0))});
  all.back().spec.params.contact.rule = ContactRule::kMax;
  all.back().spec.params.contact.neighbour_retained_min = 0.3;
  all.push_back({"moving, packed", packed()});
  all.back().spec.params.motility = preset("young-colony")->motility;
  all.back().spec.params.motility.rate_per_h = 0.5;
  // Smooth bodies, whose boxes are tight, and generations that are scored by all threads.
  all.push_back({"smooth, retained", founders(7, 12, 60.0, testing::scaled(14.0, 30.0))});
  all.back().spec.params.noise.amplitude = 0.0;
  all.back().spec.params.contact.neighbour_retained_min = 0.05;
  all.push_back({"layers", testing::spec_of(6, testing::scaled(80, 300), *preset("tumour"))});
  all.push_back({"layers, packed, with a wall", packed()});
  all.back().spec.params.layers = Layers::kMulti;
  return all;
}

// oneTBB lends no more threads than there are processors unless it is told that it may.
class Threads : public ::testing::Test {
 protected:
  tbb::global_control many_{tbb::global_control::max_allowed_parallelism, 16};
};

std::vector<Event> history(const RunSpec& spec, int threads, double bounds_scale = 1.0) {
  Simulator simulator(spec, nullptr, threads);
  SimulatorProbe::scale_bounds(simulator, bounds_scale);
  std::vector<Event> events;
  while (std::optional<Event> event = simulator.step()) {
    EXPECT_EQ(simulator.colony().last_seq(), event->seq);  // exactly after that event, no further
    EXPECT_EQ(simulator.colony().digest(), event->digest);
    events.push_back(std::move(*event));
  }
  return events;
}

TEST_F(Threads, AndWindowsDoNotShowInTheHistory) {
  for (const Scene& scene : scenes()) {
    const std::vector<Event> serial = history(scene.spec, 1);
    for (std::size_t i = 0; i < std::size(kThreads); ++i) {
      for (std::size_t k = 0; k < std::size(kWindows_h); ++k) {
        // Reduced: the widest window, where most is decided ahead, for each, and one more.
        if (!testing::full_run() && k != 3 && k != i % 3) continue;
        RunSpec spec = scene.spec;
        spec.params.window_h = kWindows_h[k];
        const MotilityParams& motility = spec.params.motility;
        if (motility.rate_per_h > 0.0) spec.params.window_h = std::min(spec.params.window_h, move_delay_min_h(motility));
        ASSERT_TRUE(validate(spec.params).empty());
        ASSERT_TRUE(history(spec, kThreads[i]) == serial)
            << scene.name << ": " << kThreads[i] << " threads, window " << kWindows_h[k] << " h";
      }
    }
    std::printf("%s: %zu events\n", scene.name.c_str(), serial.size());
  }
}

TEST_F(Threads, AnyPrefixGoesOnWithAnyOtherNumberOfThem) {
  const RunSpec spec = packed();
  const std::vector<Event> serial = history(spec, 1);
  for (std::size_t at = 0, i = 0; at < serial.size(); at += serial.size() / testing::scaled(5, 20), ++i) {
    Simulator again(spec, nullptr, kThreads[i % std::size(kThreads)]);
    for (std::size_t k = 0; k < at; ++k) again.replay(serial[k]);
    for (std::size_t k = at; k < serial.size(); ++k) {
      const std::optional<Event> event = again.step();
      ASSERT_TRUE(event && *event == serial[k]) << "replayed to seq " << at << ", differs at seq " << k + 1;
    }
    ASSERT_FALSE(again.step());
  }
}

// A scene that a broken bound would pass through unseen proves nothing.
TEST_F(Threads, WithoutTheConflictBoundTheHistoryIsAnother) {
  RunSpec spec = packed();
  spec.params.window_h = 2.0;
  const std::vector<Event> serial = history(spec, 1);
  EXPECT_TRUE(history(spec, 2, 1.0) == serial);
  for (const double scale : {0.0, 0.4}) {
    try {
      EXPECT_FALSE(history(spec, 2, scale) == serial) << "bounds times " << scale;
    } catch (const CheckFailure& failure) {
      std::printf("bounds times %.1f: %s\n", scale, failure.what());  // a cell woken twice: seen as well
    }
  }
}

TEST_F(Threads, AStoppedStepChangesNothingAndCanBeMadeAgain) {
  const RunSpec spec = founders(2, 20, 120.0, 14.0);
  const std::vector<Event> serial = history(spec, 1);
  std::atomic<bool> stop = false;
  Simulator simulator(spec, &stop, 3);
  for (const Event& expected : serial) {
    const Digest before = simulator.colony().digest();
    stop = true;
    ASSERT_THROW(simulator.step(), Stopped);
    ASSERT_EQ(simulator.colony().digest(), before);
    stop = false;
    const std::optional<Event> event = simulator.step();
    ASSERT_TRUE(event && *event == expected) << "seq " << expected.seq;
  }
}

TEST_F(Threads, AFailedCheckComesOutAtTheSameEventOnAnyNumber) {
  const RunSpec spec = founders(2, 40, 250.0, 14.0);
  const std::vector<Event> serial = history(spec, 1);
  std::string expected;
  std::uint64_t expected_seq = 0;
  for (const int threads : kThreads) {
    Simulator simulator(spec, nullptr, threads);
    Digest digest;
    for (std::size_t i = 0; i < 40; ++i) {
      Event event = serial[i];
      // Four that neither settle nor know their membrane: their division fails a check.
      if (i % 10 == 5) std::get<Founded>(event.body).cell.settle_due_h.reset();
      event.digest = digest = digest_after(digest, event);
      simulator.replay(event);
    }
    std::string message;
    while (message.empty()) {
      const Digest before = simulator.colony().digest();
      try {
        const FailureContext context("deciding in a test");
        ASSERT_TRUE(simulator.step());
      } catch (const CheckFailure& failure) {
        message = failure.what();
        ASSERT_EQ(simulator.colony().digest(), before);
      }
    }
    EXPECT_THROW(simulator.step(), CheckFailure);  // and again
    EXPECT_NE(message.find("deciding in a test"), std::string::npos) << message;
    EXPECT_NE(message.find("division of cell "), std::string::npos) << message;
    const std::string subject = message.substr(message.find("division of cell "), 22);
    if (expected.empty()) expected = subject, expected_seq = simulator.colony().last_seq();
    EXPECT_EQ(subject, expected) << threads << " threads";
    EXPECT_EQ(simulator.colony().last_seq(), expected_seq) << threads << " threads";
  }
}

TEST_F(Threads, FlushToZeroIsNoticedBeforeAnythingIsDecided) {
  const RunSpec spec = founders(2, 20, 120.0, 14.0);
  const std::vector<Event> serial = history(spec, 1);
  for (const int threads : {1, 2}) {
    Simulator simulator(spec, nullptr, threads);
    for (std::size_t i = 0; i < 20; ++i) simulator.step();
    const unsigned before = _mm_getcsr();
    _mm_setcsr(before | 0x8000U);
    EXPECT_THROW(simulator.step(), CheckFailure);
    _mm_setcsr(before);
    const std::optional<Event> event = simulator.step();
    EXPECT_TRUE(event && *event == serial[20]);
  }
}

TEST_F(Threads, AreFrom1To256) {
  const RunSpec spec = testing::spec_of(1, 3);
  EXPECT_THROW(Simulator(spec, nullptr, 0), CheckFailure);
  EXPECT_THROW(Simulator(spec, nullptr, kThreadsMax + 1), CheckFailure);
  EXPECT_TRUE(history(spec, kThreadsMax) == history(spec, 1));
}

}  // namespace
}  // namespace colony
