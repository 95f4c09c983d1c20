// server/http: answers that wait for something, over real sockets: no thread is held, and every wait has an end.
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

/// What the waiting answers of a test share.
struct Bell {
  std::mutex mutex;  // guards everything below
  std::condition_variable changed;
  std::vector<std::function<void()>> wakes;
  int asked = 0, asked_last = 0, destroyed = 0;
  bool has_rung = false;
  bool throws = false;

  void wait_until_asked(int count) {
    std::unique_lock lock(mutex);
    ASSERT_TRUE(changed.wait_for(lock, std::chrono::milliseconds(kPatienceMs), [&] { return asked >= count; }));
  }
  void wait_until_destroyed(int count) {
    std::unique_lock lock(mutex);
    ASSERT_TRUE(changed.wait_for(lock, std::chrono::milliseconds(kPatienceMs), [&] { return destroyed >= count; }));
  }
  void ring() {
    const std::lock_guard lock(mutex);
    has_rung = true;
    for (const auto& wake : wakes) {
      if (wake) wake();
    }
  }
};

class AtTheBell : public LaterAnswer {
 public:
  AtTheBell(Bell& bell, std::chrono::milliseconds wait_max) : bell_(bell), wait_max_(wait_max) {}
  ~AtTheBell() override {
    const std::lock_guard lock(bell_.mutex);
    bell_.wakes.at(index_) = nullptr;
    ++bell_.destroyed;
    bell_.changed.notify_all();
  }
  void on_ready(std::function<void()> wake) override {
    const std::lock_guard lock(bell_.mutex);
    index_ = bell_.wakes.size();
    bell_.wakes.push_back(std::move(wake));
  }
  std::unique_ptr<Response> ask(bool is_last) override {
    const std::lock_guard lock(bell_.mutex);
    ++bell_.asked;
    bell_.asked_last += is_last ? 1 : 0;
    bell_.changed.notify_all();
    if (bell_.throws) throw std::runtime_error("the bell broke");
    if (!bell_.has_rung && !is_last) return nullptr;
    auto response = std::make_unique<Response>();
    response->body = bell_.has_rung ? "rung" : "time is up";
    return response;
  }
  std::chrono::milliseconds wait_max() const override { return wait_max_; }

 private:
  Bell& bell_;
  const std::chrono::milliseconds wait_max_;
  std::size_t index_ = 0;
};

std::function<void(Router&)> bell_route(Bell& bell, std::chrono::milliseconds wait_max = std::chrono::hours(1)) {
  return [&bell, wait_max](Router& router) {
    router.add("GET", "/wait", [&bell, wait_max](const Request&) {
      Response response;
      response.later = std::make_unique<AtTheBell>(bell, wait_max);
      return response;
    });
  };
}

TEST(HttpLater, ManyWaitWithoutHoldingTheOneWorker) {
  ServerConfig config;
  config.worker_threads = 1;
  Bell bell;
  TestServer server(bell_route(bell), config);
  server.run();
  constexpr int kWaiting = 100;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < kWaiting; ++i) {
    clients.push_back(std::make_unique<RawClient>(server.port()));
    clients.back()->send(get("/wait") + get("/hello"));
  }
  bell.wait_until_asked(kWaiting);
  RawClient other(server.port());
  EXPECT_EQ(other.ask(get("/hello")).body, "hello");
  for (const auto& client : clients) EXPECT_FALSE(client->is_readable(0));
  bell.ring();
  for (const auto& client : clients) {
    EXPECT_EQ(client->read_reply().body, "rung");
    EXPECT_EQ(client->read_reply().body, "hello") << "the connection goes on, in order";
  }
  bell.wait_until_destroyed(kWaiting);
  EXPECT_EQ(bell.asked_last, 0);
}

TEST(HttpLater, TheTimeEndsIt) {
  Bell bell;
  TestServer server(bell_route(bell, std::chrono::milliseconds(20)));
  server.run();
  RawClient client(server.port());
  EXPECT_EQ(client.ask(get("/wait")).body, "time is up");
  EXPECT_EQ(client.ask(get("/hello")).body, "hello");
  EXPECT_EQ(bell.asked_last, 1);
}

TEST(HttpLater, AClientThatGoesIsNotWaitedFor) {
  Bell bell;
  TestServer server(bell_route(bell));
  server.run();
  {
    RawClient client(server.port());
    client.send(get("/wait"));
    bell.wait_until_asked(1);
  }
  bell.wait_until_destroyed(1);
  RawClient other(server.port());
  EXPECT_EQ(other.ask(get("/hello")).body, "hello");
}

TEST(HttpLater, DrainingAsksALastTime) {
  Bell bell;
  TestServer server(bell_route(bell));
  server.run();
  RawClient client(server.port());
  client.send(get("/wait"));
  bell.wait_until_asked(1);
  server.stop(kPatienceMs);
  const Reply reply = client.read_reply();
  EXPECT_EQ(reply.body, "time is up");
  EXPECT_EQ(reply.header("Connection"), "close");
  EXPECT_EQ(bell.asked_last, 1);
  EXPECT_EQ(bell.destroyed, 1);
}

TEST(HttpLater, AFailureIsA500AndHeadHasNoBody) {
  Bell bell;
  std::string heard;
  TestServer server([&](Router& router) {
    bell_route(bell)(router);
    router.on_failure([&heard](const Request&, std::string_view what) { heard = what; });
  });
  server.run();
  bell.throws = true;
  RawClient client(server.port());
  EXPECT_EQ(client.ask(get("/wait")).status, 500);
  bell.throws = false;
  bell.has_rung = true;
  client.send("HEAD /wait HTTP/1.1\r\nHost: localhost\r\n\r\n" + get("/hello"));
  EXPECT_EQ(client.read_reply(true).header("Content-Length"), "4");
  EXPECT_EQ(client.read_reply().body, "hello");
  server.stop(0);
  EXPECT_EQ(heard, "the bell broke");
}

}  // namespace
}  // namespace colony::server::http
