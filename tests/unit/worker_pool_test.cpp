// server/http: in which order the workers take what waits, and what is taken back. One thread, so that the order is a fact.
#include "server/http/worker_pool.hpp"

#include <algorithm>
#include <string>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

/// A pool whose one thread stands at a door until the queues are as the test wants them.
class WorkerPoolTest : public ::testing::Test {
 protected:
  WorkerPoolTest() {
    pool.start();
    pool.submit_request([this] { door.pass(); }, false);
    door.wait_for_arrivals(1);
  }
  WorkerPool::Ticket add(char name, bool is_heavy) {
    return pool.submit_request([this, name] { order += name; }, is_heavy);
  }
  void add_pull() {
    pool.submit_pull([this] { order += 'p'; });
  }
  void run() {
    door.open();
    pool.stop();
  }

  Door door;
  std::string order;  // touched by the one thread, and read after it
  WorkerPool pool{1, 400};
};

TEST_F(WorkerPoolTest, LightWorkThatNeverEndsDoesNotStarveHeavyWork) {
  constexpr std::size_t kTurns = WorkerPool::kLightTurnsMax;
  for (int i = 0; i < 3; ++i) add('H', true);
  for (std::size_t i = 0; i < 2 * kTurns; ++i) add('r', false);
  for (std::size_t i = 0; i < 2 * kTurns; ++i) add_pull();
  run();
  ASSERT_EQ(order.size(), 4 * kTurns + 3);
  std::size_t from = 0;
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = order.find('H', from);
    ASSERT_NE(at, std::string::npos);
    EXPECT_EQ(at - from, kTurns) << order << ": not before its turn, and not after it";
    from = at + 1;
  }
  // What is light goes on in turns, whatever came between.
  order.erase(std::remove(order.begin(), order.end(), 'H'), order.end());
  for (std::size_t i = 1; i < order.size(); ++i) EXPECT_NE(order[i], order[i - 1]) << order;
}

TEST_F(WorkerPoolTest, HeavyWorkThatComesLateHasNoTurnsSavedUp) {
  Door added;
  for (std::size_t i = 0; i < 3 * WorkerPool::kLightTurnsMax; ++i) add('r', false);
  pool.submit_request(
      [this, &added] {
        order += 'x';
        add('H', true);
        for (int i = 0; i < 4; ++i) add('r', false);
        added.pass();
      },
      false);
  door.open();
  added.wait_for_arrivals(1);  // a pool that is stopped takes no more
  added.open();
  pool.stop();
  EXPECT_EQ(order.substr(order.find('x')), "xrrrrH");
}

TEST_F(WorkerPoolTest, WhatIsWithdrawnDoesNotRunAndGivesBackItsPlace) {
  std::vector<WorkerPool::Ticket> tickets;
  while (const auto ticket = add('H', true)) tickets.push_back(ticket);
  ASSERT_EQ(tickets.size(), 50u) << "an eighth";
  for (const auto ticket : tickets) EXPECT_TRUE(pool.withdraw(ticket));
  EXPECT_FALSE(pool.withdraw(tickets[0])) << "twice";
  EXPECT_FALSE(pool.withdraw(0));
  const auto light = add('r', false);
  EXPECT_NE(light, 0u);
  EXPECT_TRUE(pool.withdraw(light));
  EXPECT_NE(add('L', true), 0u);
  run();
  EXPECT_EQ(order, "L");
  EXPECT_FALSE(pool.withdraw(light)) << "after the end, too";
}

}  // namespace
}  // namespace colony::server::http
