// server/http: peers that leave before their answer, over real sockets. Nothing is begun for them, and what was begun is asked to give up;
// who has only nothing more to say is answered all the same.
#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

/// Handlers that compute until they are asked to give up, and what the server's log says.
class Leaving : public ::testing::Test {
 protected:
  Leaving() {
    config.worker_threads = 2;  // one of them for heavy requests
    server = std::make_unique<TestServer>(
        [this](Router& router) {
          router.add("GET", "/long", [this](const Request& request) { return compute(request); }, Router::Weight::kHeavy);
          router.add("POST", "/deaf", [this](const Request& request) { compute(request); return text("done"); });
          router.add("POST", "/later", [this](const Request&) {
            Response response;
            response.later = std::make_unique<Patient>(*this);
            return response;
          });
          router.add("GET", "/door", [this](const Request&) { door.pass(); return text("passed"); });
        },
        config);
    server->on_access = [this](const AccessRecord& record) {
      const std::lock_guard lock(mutex);
      records.push_back(record);
      changed.notify_all();
    };
    server->run();
  }

  Response compute(const Request& request) {
    {
      const std::lock_guard lock(mutex);
      ++begun;
      changed.notify_all();
    }
    while (!request.gives_up->load()) std::this_thread::yield();
    const std::lock_guard lock(mutex);
    ++given_up;
    changed.notify_all();
    Response response = text("given up");
    response.gave_up = true;
    return response;
  }

  /// What was asked for is done; only its end is waited for.
  struct Patient : LaterAnswer {
    explicit Patient(Leaving& of) : test(of) {}
    void on_ready(std::function<void()>) override {}
    std::unique_ptr<Response> ask(bool is_last) override {
      const std::lock_guard lock(test.mutex);
      ++test.begun;
      test.changed.notify_all();
      if (!is_last) return nullptr;
      auto response = std::make_unique<Response>();
      response->status = 202;
      return response;
    }
    std::chrono::milliseconds wait_max() const override { return std::chrono::hours(1); }
    Leaving& test;
  };

  /// Waits for it; a test fails instead of hanging.
  template <class Condition>
  void until(Condition condition) {
    std::unique_lock lock(mutex);
    if (!changed.wait_for(lock, std::chrono::milliseconds(kPatienceMs), condition)) throw std::runtime_error("nothing happens");
  }
  std::size_t count(int status) const {
    return static_cast<std::size_t>(std::count_if(records.begin(), records.end(), [status](const auto& one) { return one.status == status; }));
  }

  Door door;
  std::mutex mutex;  // guards the four below
  std::condition_variable changed;
  int begun = 0, given_up = 0;
  std::vector<AccessRecord> records;
  ServerConfig config;
  std::unique_ptr<TestServer> server;  // last: ends first
};

TEST_F(Leaving, WhatRunsGivesUpAndWhatWaitsIsNotBegun) {
  auto first = std::make_unique<RawClient>(server->port());
  first->send(get("/long"));
  until([this] { return begun == 1; });
  std::vector<std::unique_ptr<RawClient>> waiting;
  for (int i = 0; i < 10; ++i) {
    waiting.push_back(std::make_unique<RawClient>(server->port()));
    waiting.back()->send(get("/long"));
  }
  waiting.clear();
  until([this] { return count(kPeerHasLeft) == 10; });
  EXPECT_EQ(begun, 1) << "they waited behind the first, and were taken back";
  first.reset();
  until([this] { return count(kPeerHasLeft) == 11; });
  EXPECT_EQ(begun, 1);
  EXPECT_EQ(given_up, 1);
  EXPECT_EQ(records.back().path, "/long");
  EXPECT_EQ(records.back().body_bytes, 0u);
}

TEST_F(Leaving, AQueueFullOfThoseWhoLeftTakesTheNext) {
  constexpr std::size_t kTooMany = 7;
  const std::size_t taken = 1 + config.requests_waiting_max / 8;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (std::size_t i = 0; i < taken + kTooMany; ++i) {
    clients.push_back(std::make_unique<RawClient>(server->port()));
    clients.back()->send(get("/long"));
    if (i == 0) until([this] { return begun == 1; });
  }
  until([this] { return count(503) == kTooMany; });
  clients.clear();
  until([this, taken] { return count(kPeerHasLeft) == taken; });
  const int before = begun;  // more than one: whose leaving is heard of late has begun
  RawClient next(server->port());
  next.send(get("/long"));
  until([this, before] { return begun == before + 1; });
  EXPECT_EQ(given_up, before);
}

TEST_F(Leaving, AResetIsLeavingWhateverTheVersion) {
  for (const char* version : {"1.0", "1.1"}) {
    RawClient client(server->port());
    client.send(std::string("GET /long HTTP/") + version + "\r\n" + kHost + "\r\n");
    const int before = given_up;
    until([this, before] { return begun == before + 1; });
    client.reset();
    until([this, before] { return given_up == before + 1; });
  }
}

TEST_F(Leaving, WhoOnlyStopsSendingIsAnswered) {
  RawClient client(server->port());
  client.send(get("/door") + get("/hello"));
  client.end_sending();
  RawClient old(server->port());
  old.send("GET /door HTTP/1.0\r\n" + kHost + "\r\n");
  old.end_sending();
  door.wait_for_arrivals(2);
  const Reply asked = client.read_reply();
  EXPECT_EQ(asked.status, 100) << "which finds out whether anybody is there";
  EXPECT_EQ(asked.headers.all().size(), 0u);
  door.open();
  EXPECT_EQ(client.read_reply().body, "passed");
  EXPECT_EQ(client.read_reply().body, "hello") << "what was asked behind it, too";
  EXPECT_EQ(client.read_to_end(), "");
  EXPECT_EQ(old.read_reply().body, "passed") << "HTTP/1.0 has no 100, so it is not asked";
  until([this] { return count(200) == 3; });
  EXPECT_EQ(count(kPeerHasLeft), 0u);
}

TEST_F(Leaving, WhatIsSentMeanwhileIsKept) {
  RawClient client(server->port());
  client.send(get("/door"));
  door.wait_for_arrivals(1);
  RawClient other(server->port());
  // The first is watched by now: others left in its time.
  for (int i = 0; i < 3; ++i) {
    auto leaves = std::make_unique<RawClient>(server->port());
    leaves->send(get("/long"));
    until([this, i] { return begun == i + 1; });
    leaves.reset();
    until([this, i] { return count(kPeerHasLeft) == static_cast<std::size_t>(i + 1); });
    client.send(get("/hello").substr(0, 10));
    client.send(get("/hello").substr(10));
  }
  door.open();
  EXPECT_EQ(client.read_reply().body, "passed");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(client.read_reply().body, "hello");
}

TEST_F(Leaving, WhoSendsTooMuchBehindWhatIsAtWorkIsNotWaitedFor) {
  const std::string much(70'000, 'x');
  RawClient at_work(server->port());
  at_work.send(get("/long"));
  until([this] { return begun == 1; });
  RawClient waits(server->port());
  waits.send(get("/long") + much);
  until([this] { return count(kPeerHasLeft) == 1; });
  EXPECT_EQ(begun, 1) << "taken out of the queue";
  at_work.send(much);
  until([this] { return count(kPeerHasLeft) == 2; });
  EXPECT_EQ(given_up, 1);
  for (const AccessRecord& record : records) EXPECT_TRUE(record.peer_left);
  for (RawClient* const client : {&at_work, &waits}) EXPECT_EQ(client->read_to_end(), "") << "and the connection is closed";
}

TEST_F(Leaving, WhatWasDoneHasItsStatusInTheLogThoughNobodyTakesIt) {
  const std::string body = " HTTP/1.1\r\n" + kHost + "Content-Length: 0\r\n\r\n";
  for (const auto& [target, status] : {std::pair{"/deaf", 200}, std::pair{"/later", 202}}) {
    const int before = begun;
    const std::size_t lines = records.size();
    RawClient client(server->port());
    client.send("POST " + std::string(target) + body);
    until([this, before] { return begun == before + 1; });
    client.reset();
    until([this, lines] { return records.size() == lines + 1; });
    EXPECT_EQ(records.back().status, status) << target;
    EXPECT_TRUE(records.back().peer_left);
    EXPECT_EQ(records.back().body_bytes, 0u);
  }
  EXPECT_EQ(RawClient(server->port()).ask(get("/hello")).status, 200);
  until([this] { return records.size() == 3; });
  EXPECT_FALSE(records.back().peer_left);
}

TEST_F(Leaving, TheEndOfTheServerAsksToo) {
  RawClient client(server->port());
  client.send(get("/long"));
  until([this] { return begun == 1; });
  server->stop(kPatienceMs);
  EXPECT_EQ(client.read_reply().body, "given up") << "and sends what the handler made of it";
  EXPECT_EQ(count(kPeerHasLeft), 0u);
}

}  // namespace
}  // namespace colony::server::http
