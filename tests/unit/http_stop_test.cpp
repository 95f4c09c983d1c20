// server/http: many watchers, and how streams end when the server stops.
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

TEST(HttpStream, WatchersHoldNoWorker) {
  ServerConfig config;
  config.worker_threads = 1;
  Watch watch;
  TestServer server([&watch](Router& router) { router.add("GET", "/s", source_route(watch, waits_for_ever)); }, config);
  server.run();
  std::vector<std::unique_ptr<RawClient>> watchers;
  for (int i = 0; i < 50; ++i) {
    watchers.push_back(std::make_unique<RawClient>(server.port()));
    watchers.back()->send(get("/s"));
    ASSERT_TRUE(watchers.back()->read_until("data: 1"));
  }
  watch.wait_for_waiting(50);
  RawClient client(server.port());
  EXPECT_EQ(client.ask(get("/hello")).body, "hello");
}

TEST(HttpStream, StopSaysFarewell) {
  Watch watch;
  TestServer server([&watch](Router& router) {
    router.add("GET", "/waits", source_route(watch, waits_for_ever, "event: bye\n\n"));
    router.add("GET", "/runs",
               source_route(
                   watch,
                   [] {
                     return [](std::string& out) {
                       out += "data: more\n\n";
                       return Pull::kMore;
                     };
                   },
                   "event: bye\n\n"));
  });
  server.run();
  RawClient waits(server.port());
  waits.send(get("/waits"));
  ASSERT_TRUE(waits.read_until("data: 1"));
  RawClient runs(server.port());
  runs.send(get("/runs"));
  ASSERT_TRUE(runs.read_until("data: more"));
  std::thread stopper([&server] { server.stop(kPatienceMs); });
  EXPECT_NE(waits.read_to_end().find("event: bye\n\n\r\n0\r\n\r\n"), std::string::npos);
  const std::string rest = runs.read_to_end();
  const std::string ending = "c\r\nevent: bye\n\n\r\n0\r\n\r\n";
  ASSERT_GE(rest.size(), ending.size());
  EXPECT_EQ(rest.substr(rest.size() - ending.size()), ending);
  stopper.join();
  EXPECT_EQ(watch.destroyed_count(), 2);
}

TEST(HttpStream, StopEndsWithStreamsIdleAndSlowClientsOpen) {
  Watch watch;
  TestServer server([&watch](Router& router) {
    router.add("GET", "/stays", source_route(watch, waits_for_ever));  // no farewell: it would like to stay for ever
    router.add("GET", "/bye", source_route(watch, waits_for_ever, "event: bye\n\n"));
    router.add("GET", "/floods", source_route(watch, [] {
                 return [](std::string& out) {
                   out.append(64 * 1024, 'x');
                   return Pull::kMore;
                 };
               }));
  });
  server.run();
  std::vector<std::unique_ptr<RawClient>> clients;
  const auto add = [&](const std::string& bytes, const char* until) {
    clients.push_back(std::make_unique<RawClient>(server.port(), 4096));
    clients.back()->send(bytes);
    if (until) {
      ASSERT_TRUE(clients.back()->read_until(until));
    }
  };
  for (int i = 0; i < 50; ++i) add(get(i % 2 == 0 ? "/stays" : "/bye"), "data: 1");
  for (int i = 0; i < 5; ++i) add(get("/floods"), "xxxx");
  for (int i = 0; i < 5; ++i) add(get("/hello"), "hello");
  for (int i = 0; i < 5; ++i) add("GET /hel", nullptr);
  for (int i = 0; i < 5; ++i) add("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nabc", nullptr);
  for (int i = 0; i < 5; ++i) add("", nullptr);
  server.stop(50);
  EXPECT_EQ(watch.destroyed_count(), watch.created_count());
  EXPECT_EQ(watch.created_count(), 55);
  for (auto& client : clients) client->read_to_end();
}

}  // namespace
}  // namespace colony::server::http
