// server/http over real sockets: what is refused when too much comes at once.
#include <stdexcept>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

using namespace std::string_literals;

// Minutes of drawing must not keep those out who only look.
TEST(HttpLimits, HeavyRequestsHaveAQueueOfTheirOwn) {
  ServerConfig config;
  config.worker_threads = 2;
  config.requests_waiting_max = 8;  // one heavy request may wait
  Door door;
  TestServer server(
      [&door](Router& router) {
        router.add(
            "GET", "/door",
            [&door](const Request&) {
              door.pass();
              return text("passed");
            },
            Router::Weight::kHeavy);
        router.add("GET", "/light", [](const Request&) { return text("light"); });
      },
      config);
  server.run();
  RawClient running(server.port());
  running.send(get("/door"));
  door.wait_for_arrivals(1);
  RawClient a(server.port());
  RawClient b(server.port());
  a.send(get("/door"));
  b.send(get("/door"));
  while (!a.is_readable(5) && !b.is_readable(5)) {
  }
  const bool a_is_refused = a.is_readable(0);
  EXPECT_EQ((a_is_refused ? a : b).read_reply().status, 503);
  RawClient light(server.port());
  light.send(get("/light"));
  EXPECT_EQ(light.read_reply().body, "light");
  door.open();
  EXPECT_EQ(running.read_reply().body, "passed");
  EXPECT_EQ((a_is_refused ? b : a).read_reply().body, "passed");
}

TEST(HttpLimits, AFullQueueIsToldAtOnce) {
  ServerConfig config;
  config.worker_threads = 1;
  config.requests_waiting_max = 1;
  Door door;
  TestServer server(
      [&door](Router& router) {
        router.add("GET", "/door", [&door](const Request&) {
          door.pass();
          return text("passed");
        });
      },
      config);
  server.run();
  RawClient running(server.port());
  running.send(get("/door"));
  door.wait_for_arrivals(1);
  // One of these two waits and the other is refused; which one, the kernel decides.
  RawClient a(server.port());
  RawClient b(server.port());
  a.send(get("/door"));
  b.send(get("/door"));
  while (!a.is_readable(5) && !b.is_readable(5)) {
  }
  const bool a_is_refused = a.is_readable(0);
  const Reply refused = (a_is_refused ? a : b).read_reply();
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.header("Retry-After"), "1");
  door.open();
  EXPECT_EQ(running.read_reply().body, "passed");
  EXPECT_EQ((a_is_refused ? b : a).read_reply().body, "passed");
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
  TestServer server(
      [&door](Router& router) {
        router.add(
            "GET", "/door",
            [&door](const Request&) {
              door.pass();
              return text("passed");
            },
            Router::Weight::kHeavy);
        router.add("GET", "/light", [](const Request&) { return text("light"); });
      },
      config);
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
