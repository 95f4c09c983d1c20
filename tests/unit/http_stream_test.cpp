// server/http: bodies made piece by piece, over real sockets.
#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/unit/http_sources.hpp"
#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

TEST(HttpStream, PiecesBecomeChunksAndTheConnectionStays) {
  Watch watch;
  TestServer server([&watch](Router& router) {
    router.add("GET", "/s", source_route(watch, [] {
                 return pieces({"one,", "", std::string(70'000, 'x'), "", "end"});
               }));
  });
  server.run();
  RawClient client(server.port());
  const std::string whole = "one," + std::string(70'000, 'x') + "end";
  const Reply reply = client.ask(get("/s") + get("/hello"));
  EXPECT_EQ(reply.header("Transfer-Encoding"), "chunked");
  EXPECT_EQ(reply.header("Content-Length"), "(absent)");
  EXPECT_EQ(reply.body, whole);
  EXPECT_TRUE(reply.is_complete);
  EXPECT_EQ(client.read_reply().body, "hello");

  client.send("HEAD /s HTTP/1.1\r\nHost: localhost\r\n\r\n" + get("/hello"));
  EXPECT_EQ(client.read_reply(true).status, 200);
  EXPECT_EQ(client.read_reply().body, "hello") << "a HEAD has no chunks";

  RawClient old(server.port());
  const Reply until_close = old.ask("GET /s HTTP/1.0\r\n" + kHost + "\r\n");
  EXPECT_EQ(until_close.header("Transfer-Encoding"), "(absent)");
  EXPECT_EQ(until_close.header("Connection"), "close");
  EXPECT_EQ(until_close.body, whole);
  server.stop(0);
  EXPECT_EQ(watch.destroyed_count(), 3);
}

TEST(HttpStream, AThrowingPullTruncatesTheBodyVisibly) {
  Watch watch;
  std::string heard;
  TestServer server([&](Router& router) {
    router.on_failure([&heard](const Request&, std::string_view what) { heard = what; });
    router.add("GET", "/s", source_route(watch, [] {
                 return [count = 0](std::string& out) mutable {
                   if (count++ == 1) throw std::runtime_error("the disk");
                   out += "begun";
                   return Pull::kMore;
                 };
               }));
  });
  server.run();
  RawClient client(server.port());
  const Reply reply = client.ask(get("/s"));
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, "begun");
  EXPECT_FALSE(reply.is_complete) << "no last chunk";
  server.stop(0);
  EXPECT_EQ(heard, "the disk");
  EXPECT_EQ(watch.destroyed_count(), 1);
}

TEST(HttpStream, AReaderWhoStopsReadingIsCutAndHoldsNothingUp) {
  ServerConfig config;
  config.write_timeout_ms = 100;
  config.worker_threads = 1;
  Watch watch;
  std::atomic<int> pull_count{0};
  TestServer server(
      [&](Router& router) {
        router.add("GET", "/s", source_route(watch, [&pull_count] {
                     return [&pull_count](std::string& out) {
                       ++pull_count;
                       out.append(64 * 1024, 'x');
                       return Pull::kMore;
                     };
                   }));
      },
      config);
  server.run();
  RawClient slow(server.port(), 4096);
  slow.send(get("/s"));
  RawClient other(server.port());
  EXPECT_EQ(other.ask(get("/hello")).body, "hello") << "the only worker is not held";
  watch.wait_for_destroyed(1);
  EXPECT_LT(pull_count, 1000) << "no more is made than the socket's buffers take";
}

TEST(HttpStream, ASlowReaderGetsEveryByte) {
  Watch watch;
  constexpr int kPieces = 300;
  TestServer server([&](Router& router) {
    router.add("GET", "/s", source_route(watch, [] {
                 return [count = 0](std::string& out) mutable {
                   out.append(32 * 1024, static_cast<char>('a' + count % 26));
                   return ++count == kPieces ? Pull::kEnd : Pull::kMore;
                 };
               }));
  });
  server.run();
  RawClient client(server.port(), 4096);
  const Reply reply = client.ask(get("/s"));
  EXPECT_TRUE(reply.is_complete);
  ASSERT_EQ(reply.body.size(), std::size_t{kPieces} * 32 * 1024);
  for (int i = 0; i < kPieces; ++i) ASSERT_EQ(reply.body[static_cast<std::size_t>(i) * 32 * 1024], 'a' + i % 26);
}

/// Wakes from its own thread as fast as it can, and notices when two pulls overlap.
class Restless : public BodySource {
 public:
  explicit Restless(std::atomic<int>& overlap_count) : overlap_count_(overlap_count) {}
  ~Restless() override {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void on_ready(std::function<void()> wake) override {
    thread_ = std::thread([this, wake = std::move(wake)] {
      while (!stop_) wake();
    });
  }
  Pull pull(std::string& out) override {
    if (inside_.exchange(true)) ++overlap_count_;
    out += std::to_string(++count_) + ",";
    inside_ = false;
    return count_ == 500 ? Pull::kEnd : Pull::kWait;
  }

 private:
  std::atomic<int>& overlap_count_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> inside_{false};
  int count_ = 0;
  std::thread thread_;
};

TEST(HttpStream, IsNeverPulledTwiceAtOnceAndNoWakeIsLost) {
  ServerConfig config;
  config.worker_threads = 4;
  config.io_threads = 2;
  config.stream_keep_alive_ms = 3'600'000;  // only wakes lead on
  std::atomic<int> overlap_count{0};
  TestServer server(
      [&overlap_count](Router& router) {
        router.add("GET", "/s",
                   [&overlap_count](const Request&) { return streamed(std::make_unique<Restless>(overlap_count)); });
      },
      config);
  server.run();
  RawClient client(server.port());
  const Reply reply = client.ask(get("/s"));
  EXPECT_TRUE(reply.is_complete);
  EXPECT_EQ(reply.body.substr(reply.body.size() - 8), "499,500,");
  EXPECT_EQ(overlap_count, 0);
}

TEST(HttpStream, AWakeAfterTheEndIsHarmless) {
  class Leaky : public BodySource {
   public:
    explicit Leaky(std::promise<std::function<void()>>& wake) : wake_(wake) {}
    void on_ready(std::function<void()> wake) override { wake_.set_value(std::move(wake)); }
    Pull pull(std::string&) override { return Pull::kEnd; }

   private:
    std::promise<std::function<void()>>& wake_;
  };
  std::promise<std::function<void()>> promise;
  std::function<void()> wake;
  {
    TestServer server([&promise](Router& router) {
      router.add("GET", "/s", [&promise](const Request&) { return streamed(std::make_unique<Leaky>(promise)); });
    });
    server.run();
    RawClient client(server.port());
    EXPECT_TRUE(client.ask(get("/s")).is_complete);
    wake = promise.get_future().get();
    EXPECT_EQ(client.ask(get("/hello")).status, 200);
    wake();
  }
  wake();
}

TEST(HttpStream, ADisconnectIsNoticedWhileNothingIsSent) {
  ServerConfig config;
  config.stream_keep_alive_ms = 3'600'000;
  Watch watch;
  TestServer server([&watch](Router& router) { router.add("GET", "/s", source_route(watch, waits_for_ever)); }, config);
  server.run();
  RawClient client(server.port());
  client.send(get("/s"));
  ASSERT_TRUE(client.read_until("data: 1"));
  client.send(get("/hello"));  // a pipelined request does not hide the end behind it
  client.close();
  watch.wait_for_destroyed(1);
}

TEST(HttpStream, ASignOfLifeIsSentAndThenItIsPulledAgain) {
  ServerConfig config;
  config.stream_keep_alive_ms = 20;
  Watch watch;
  TestServer server(
      [&watch](Router& router) {
        router.add("GET", "/s",
                   source_route(
                       watch,
                       [] {
                         return [count = 0](std::string& out) mutable {
                           if (++count == 3) out += "third";
                           return count == 3 ? Pull::kEnd : Pull::kWait;
                         };
                       },
                       "", ": alive\n\n"));
      },
      config);
  server.run();
  RawClient client(server.port());
  const Reply reply = client.ask(get("/s"));
  EXPECT_EQ(reply.body, ": alive\n\n: alive\n\nthird");
  EXPECT_TRUE(reply.is_complete);
}

/// Waits twice without ever waking, and asks to be pulled again soon.
class Impatient : public BodySource {
 public:
  Pull pull(std::string& out) override {
    if (++count_ < 3) return Pull::kWait;
    out += "third";
    return Pull::kEnd;
  }
  std::optional<std::chrono::milliseconds> wake_after() override { return std::chrono::milliseconds(count_); }
  std::string_view keep_alive() const override { return ": alive\n\n"; }

 private:
  int count_ = 0;
};

TEST(HttpStream, ASourceIsPulledAgainWhenItAskedForIt) {
  ServerConfig config;
  config.stream_keep_alive_ms = 3'600'000;  // not by this
  TestServer server(
      [](Router& router) {
        router.add("GET", "/s", [](const Request&) { return streamed(std::make_unique<Impatient>()); });
      },
      config);
  server.run();
  RawClient client(server.port());
  const Reply reply = client.ask(get("/s"));
  EXPECT_EQ(reply.body, "third") << "no sign of life in between";
  EXPECT_TRUE(reply.is_complete);
}

/// Gives by turns from memory and by a pull, and notices where it is called.
class HalfReady : public BodySource {
 public:
  explicit HalfReady(std::atomic<bool>& is_wrong) : is_wrong_(is_wrong) {}
  void on_ready(std::function<void()> wake) override { wake_ = std::move(wake); }
  Pull pull(std::string& out) override {
    if (count_ == 0) worker_ = std::this_thread::get_id();
    if (count_ % 3 != 0 || std::this_thread::get_id() != worker_) is_wrong_ = true;
    out += "<" + std::to_string(count_) + ">";
    return next();
  }
  std::optional<Ready> pull_now(std::string& out) override {
    if (count_ == 0 || std::this_thread::get_id() == worker_) is_wrong_ = true;
    if (count_ % 3 == 0) return std::nullopt;
    if (count_ % 3 == 1) out += "own;";
    auto shared = std::make_shared<const std::string>(std::to_string(count_) + ":");
    return Ready{next(), std::move(shared)};
  }

 private:
  Pull next() {
    if (++count_ == 300) return Pull::kEnd;
    if (count_ % 2 == 0) return Pull::kMore;
    wake_();
    return Pull::kWait;
  }
  std::atomic<bool>& is_wrong_;
  std::function<void()> wake_;
  std::thread::id worker_;
  int count_ = 0;
};

TEST(HttpStream, WhatIsReadyNeedsNoWorkerAndSharedBytesGoFirst) {
  ServerConfig config;
  config.worker_threads = 1;
  config.stream_keep_alive_ms = 3'600'000;  // only wakes lead on
  std::atomic<bool> is_wrong{false};
  TestServer server(
      [&is_wrong](Router& router) {
        router.add("GET", "/s", [&is_wrong](const Request&) { return streamed(std::make_unique<HalfReady>(is_wrong)); });
      },
      config);
  server.run();
  std::string expected;
  for (int i = 0; i < 300; ++i) {
    const std::string number = std::to_string(i);
    expected += i % 3 == 0 ? "<" + number + ">" : number + (i % 3 == 1 ? ":own;" : ":");
  }
  RawClient client(server.port());
  const Reply reply = client.ask(get("/s"));
  EXPECT_TRUE(reply.is_complete);
  EXPECT_EQ(reply.body, expected);
  EXPECT_FALSE(is_wrong);
}

}  // namespace
}  // namespace colony::server::http
