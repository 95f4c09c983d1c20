// server/http over real sockets: what is refused when too much comes at once.
#include <stdexcept>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

using namespace std::string_literals;

/// GET /door: passes when it is open.
void add_door(Router& router, Door& door, Router::Weight weight) {
  router.add(
      "GET", "/door",
      [&door](const Request&) {
        door.pass();
        return text("passed");
      },
      weight);
}

void add_heavy_and_light(Router& router, Door& door) {
  add_door(router, door, Router::Weight::kHeavy);
  router.add("GET", "/light", [](const Request&) { return text("light"); });
}

/// One request at the door, and two more where there is room for one to wait: the other is refused. Which one, the kernel decides.
class CrowdedDoor {
 public:
  CrowdedDoor(std::uint16_t port, Door& door) : door_(door), running_(port), a_(port), b_(port) {
    running_.send(get("/door"));
    door_.wait_for_arrivals(1);
    a_.send(get("/door"));
    b_.send(get("/door"));
    while (!a_.is_readable(5) && !b_.is_readable(5)) {
    }
    is_a_refused_ = a_.is_readable(0);
  }
  Reply refusal() { return (is_a_refused_ ? a_ : b_).read_reply(); }
  void open() {
    door_.open();
    EXPECT_EQ(running_.read_reply().body, "passed");
    EXPECT_EQ((is_a_refused_ ? b_ : a_).read_reply().body, "passed");
  }

 private:
  Door& door_;
  RawClient running_, a_, b_;
  bool is_a_refused_ = false;
};

// Minutes of drawing must not keep those out who only look.
TEST(HttpLimits, HeavyRequestsHaveAQueueOfTheirOwn) {
  ServerConfig config;
  config.worker_threads = 2;
  config.requests_waiting_max = 8;  // one heavy request may wait
  Door door;
  TestServer server([&door](Router& router) { add_heavy_and_light(router, door); }, config);
  server.run();
  CrowdedDoor crowd(server.port(), door);
  EXPECT_EQ(crowd.refusal().status, 503);
  RawClient light(server.port());
  light.send(get("/light"));
  EXPECT_EQ(light.read_reply().body, "light");
  crowd.open();
}

TEST(HttpLimits, AFullQueueIsToldAtOnce) {
  ServerConfig config;
  config.worker_threads = 1;
  config.requests_waiting_max = 1;
  Door door;
  TestServer server([&door](Router& router) { add_door(router, door, Router::Weight::kLight); }, config);
  server.run();
  CrowdedDoor crowd(server.port(), door);
  const Reply refused = crowd.refusal();
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.header("Retry-After"), "1");
  crowd.open();
}

TEST(HttpLimits, LargeBodiesAreCounted) {
  ServerConfig config;
  config.large_body_path = "/large";
  config.body_bytes_max = 10;
  config.large_body_bytes_max = 20;
  config.large_bodies_max = 1;
  Door door;
  TestServer server(
      [&door](Router& router) {
        router.add("POST", "/large", [&door](const Request& request) {
          if (request.body.size() > 10) door.pass();
          return text(request.body);
        });
      },
      config);
  server.run();
  const auto large = [](std::size_t size) {
    return "POST /large HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + std::to_string(size) + "\r\n\r\n" + std::string(size, 'x');
  };
  RawClient first(server.port());
  first.send(large(20));
  door.wait_for_arrivals(1);
  RawClient second(server.port());
  EXPECT_EQ(second.ask(large(11)).status, 503);
  RawClient small(server.port());
  EXPECT_EQ(small.ask(large(10)).status, 200) << "bodies of common size need no turn";
  door.open();
  EXPECT_EQ(first.read_reply().body, std::string(20, 'x'));
  RawClient third(server.port());
  EXPECT_EQ(third.ask(large(20)).status, 200) << "the turn was given back";
  EXPECT_EQ(RawClient(server.port()).ask(large(21)).status, 413);
}

TEST(HttpLimits, HeavyRequestsLeaveThreadsForTheOthers) {
  ServerConfig config;
  config.worker_threads = 2;
  Door door;
  TestServer server([&door](Router& router) { add_heavy_and_light(router, door); }, config);
  server.run();
  std::vector<std::unique_ptr<RawClient>> heavy;
  for (int i = 0; i < 4; ++i) {
    heavy.push_back(std::make_unique<RawClient>(server.port()));
    heavy.back()->send(get("/door"));
  }
  door.wait_for_arrivals(1);
  for (int i = 0; i < 3; ++i) {  // would wait for the door if a heavy request could hold both threads
    RawClient light(server.port());
    light.send(get("/light"));
    EXPECT_EQ(light.read_reply().body, "light");
  }
  door.open();
  for (auto& client : heavy) EXPECT_EQ(client->read_reply().body, "passed");
}

TEST(HttpLimits, ConnectionsBeyondTheLimitAreToldAndTheOthersGoOn) {
  ServerConfig config;
  config.connections_max = 2;
  TestServer server({}, config);
  server.run();
  RawClient a(server.port());
  EXPECT_EQ(a.ask(kGet).status, 200);
  {
    RawClient b(server.port());
    EXPECT_EQ(b.ask(kGet).status, 200);
    for (int i = 0; i < 100; ++i) {
      RawClient beyond(server.port());
      beyond.send(kGet);
      const Reply reply = beyond.read_reply();
      EXPECT_EQ(reply.status, 503);
      EXPECT_EQ(reply.header("Retry-After"), "1");
      EXPECT_EQ(beyond.read_to_end(), "");
    }
  }
  EXPECT_EQ(a.ask(kGet).status, 200);
  int status = 503;
  while (status == 503)
    status = RawClient(server.port()).ask(kGet).status;  // until the server has noticed that b has gone
  EXPECT_EQ(status, 200);
}

TEST(HttpLimits, TheListenerSurvivesALackOfDescriptors) {
  TestServer server;
  server.run();
  {
    RawClient before(server.port());
    ASSERT_EQ(before.ask(kGet).status, 200);
  }
  rlimit usual{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &usual), 0);
  rlimit none = usual;
  none.rlim_cur = 3;
  std::optional<RawClient> client;
  client.emplace(server.port());
  ASSERT_EQ(client->ask(kGet).status, 200);
  // This connection waits in the kernel: its socket exists before the limit falls, the server's would come after.
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(server.port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  ASSERT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::send(fd, kGet.data(), kGet.size(), MSG_NOSIGNAL), static_cast<ssize_t>(kGet.size()));
  pollfd item{fd, POLLIN, 0};
  EXPECT_EQ(::poll(&item, 1, 50), 0) << "no descriptor, no answer";
  EXPECT_EQ(client->ask(kGet).status, 200) << "the connections that are there go on";
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &usual), 0);
  EXPECT_EQ(::poll(&item, 1, kPatienceMs), 1) << "and then it is answered";
  ::close(fd);
}

}  // namespace
}  // namespace colony::server::http
