// Stopping: a computation that was asked to give up has decided nothing, and the history goes on with the same bytes.
#include <xmmintrin.h>

#include <atomic>
#include <optional>

#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "engine/base/float_mode.hpp"
#include "engine/base/stop.hpp"
#include "engine/picture/render.hpp"
#include "engine/sim/simulator.hpp"
#include "tests/support/runs.hpp"

namespace colony {
namespace {

TEST(Stop, AStoppedStepChangesNothingAndTheHistoryIsTheSame) {
  const RunSpec spec = testing::spec_of(3, 25);
  const testing::Run undisturbed = testing::run(spec);
  std::atomic<bool> stop = false;
  Simulator simulator(spec, &stop);
  std::size_t index = 0;
  for (;;) {
    const Digest before = simulator.colony().digest();
    stop = true;
    ASSERT_THROW(simulator.step(), Stopped) << "event " << index;
    ASSERT_EQ(simulator.colony().digest(), before);
    ASSERT_EQ(simulator.colony().last_seq(), index);
    stop = false;
    const std::optional<Event> event = simulator.step();
    ASSERT_TRUE(event.has_value());
    ASSERT_EQ(*event, undisturbed.events[index++]);
    if (event->kind() == EventKind::kFinished) break;
  }
  EXPECT_EQ(index, undisturbed.events.size());
}

TEST(Stop, PlacementAndPicturesStop) {
  const std::atomic<bool> stop = true;
  RunSpec spec = testing::spec_of(1, 100);
  spec.params.founders.count = 50;
  EXPECT_THROW((void)place_founders(spec, &stop), Stopped);
  const testing::Run run = testing::run(testing::spec_of(1, 2));
  EXPECT_THROW((void)render(run.colony(), Params{}, PictureSpec{}, &stop), Stopped);
}

TEST(Wall, HoldsWithoutInhibition) {
  RunSpec spec = testing::spec_of(2, 1'000);
  spec.until.time_h = 120.0;
  spec.params.division.inhibition = false;
  spec.params.dish.radius_um = 30.0;
  const testing::Run run = testing::run(spec);
  EXPECT_GT(run.colony().cells().size(), 4U);
  // A body's box may reach over the wall where its corner is empty, its centre never.
  for (const Cell& cell : run.colony().cells()) EXPECT_LT(cell.centre_um.head<2>().norm(), 30.0) << cell.id.value;
}

TEST(FloatMode, FlushToZeroIsNoticed) {
  check_floating_point_mode();
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | 0x8000U);
  EXPECT_THROW(check_floating_point_mode(), CheckFailure);
  EXPECT_THROW(Simulator(testing::spec_of(1, 2)), CheckFailure);
  _mm_setcsr(before);
}

}  // namespace
}  // namespace colony
