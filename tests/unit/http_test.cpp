// server/http over real sockets: what holds for a request, between requests, at the limits and at the end.
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

using namespace std::string_literals;

TEST(HttpSession, KeepsTheConnectionAndTheRequestId) {
  TestServer server;
  server.run();
  RawClient client(server.port());
  const Reply first = client.ask(kGet);
  const Reply second = client.ask(kGet);
  EXPECT_EQ(first.header("Connection"), "(absent)");
  EXPECT_EQ(first.header("X-Request-Id").size(), 32u);
  EXPECT_NE(first.header("X-Request-Id"), second.header("X-Request-Id"));
  EXPECT_EQ(client.ask(get("/hello", kHost + "X-Request-Id: run-1.a_b\r\n")).header("X-Request-Id"), "run-1.a_b");
  EXPECT_EQ(client.ask(get("/hello", kHost + "X-Request-Id: a\"b\r\n")).header("X-Request-Id").size(), 32u);
  const Reply last = client.ask(get("/hello", kHost + "Connection: close\r\n"));
  EXPECT_EQ(last.body, "hello");
  EXPECT_EQ(last.header("Connection"), "close");
  EXPECT_EQ(client.read_to_end(), "");
  RawClient old(server.port());
  EXPECT_EQ(old.ask("GET /hello HTTP/1.0\r\n" + kHost + "Connection: keep-alive\r\n\r\n").header("Connection"),
            "keep-alive");
  EXPECT_EQ(old.ask("GET /hello HTTP/1.0\r\n" + kHost + "\r\n").header("Connection"), "close");
}

TEST(HttpSession, PipelinedRequestsAreAnsweredInOrder) {
  TestServer server;
  server.run();
  RawClient client(server.port());
  std::string all;
  for (int i = 0; i < 20; ++i) {
    const std::string body = "number " + std::to_string(i);
    all += i % 2 == 0 ? post("Content-Length: " + std::to_string(body.size()) + "\r\n", body)
                      : post("Transfer-Encoding: chunked\r\n", "2\r\nnu\r\n" + std::to_string(body.size() - 2) +
                                                                   "\r\n" + body.substr(2) + "\r\n0\r\n\r\n");
  }
  client.send(all + kGet);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(client.read_reply().body, "number " + std::to_string(i));
  EXPECT_EQ(client.read_reply().body, "hello");
}

TEST(HttpSession, HeadHasTheLengthAndNoBody) {
  TestServer server;
  server.run();
  RawClient client(server.port());
  client.send("HEAD /hello HTTP/1.1\r\n" + kHost + "\r\n" + kGet);
  const Reply head = client.read_reply(true);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("Content-Length"), "5");
  EXPECT_EQ(client.read_reply().body, "hello") << "the next response follows at once";
  client.send("HEAD /nothing HTTP/1.1\r\n" + kHost + "\r\n" + kGet);
  EXPECT_EQ(client.read_reply(true).status, 404);
  EXPECT_EQ(client.read_reply().body, "hello");
}

TEST(HttpSession, AsksForTheBodyOnlyWhenItWillTakeIt) {
  TestServer server;
  server.run();
  RawClient client(server.port());
  for (const char* fields : {"Content-Length: 5\r\n", "Transfer-Encoding: chunked\r\n"}) {
    client.send(post(fields + "Expect: 100-continue\r\n"s));
    EXPECT_EQ(client.read_reply().status, 100);
    client.send(fields[0] == 'C' ? "abcde" : "5\r\nabcde\r\n0\r\nX-Sum: 1\r\n\r\n");
    EXPECT_EQ(client.read_reply().body, "abcde");
  }
  EXPECT_EQ(client.ask(post("Content-Length: 5\r\nExpect: 100-continue\r\n", "abcde")).body, "abcde")
      << "who has sent the body need not be asked for it";
}

TEST(HttpSession, ADripDoesNotOutliveTheDeadlines) {
  ServerConfig config;
  config.header_timeout_ms = 150;
  config.body_timeout_ms = 150;
  TestServer server({}, config);
  server.run();
  const std::string starts[] = {"GET /hello HTTP/1.1\r\n" + kHost + "X-A: ", post("Content-Length: 1000000\r\n"),
                                post("Transfer-Encoding: chunked\r\n", "ffff\r\n")};
  for (const auto& start : starts) {
    RawClient client(server.port());
    client.send(start);
    while (!client.is_readable(5)) client.send("a");
    const Reply reply = client.read_reply();
    EXPECT_EQ(reply.status, 408) << start;
    EXPECT_EQ(reply.header("Connection"), "close");
  }
  RawClient silent(server.port());
  EXPECT_EQ(silent.read_to_end(), "") << "who has asked nothing is told nothing";
}

TEST(HttpSession, AnIdleConnectionIsClosedSilently) {
  ServerConfig config;
  config.idle_timeout_ms = 50;
  TestServer server({}, config);
  server.run();
  RawClient client(server.port());
  EXPECT_EQ(client.ask(kGet).status, 200);
  EXPECT_EQ(client.read_to_end(), "");
}

TEST(HttpSession, WhatHandlersDoWrongIsAProblemWithoutDetails) {
  std::vector<std::string> heard;
  TestServer server([&heard](Router& router) {
    router.on_failure([&heard](const Request&, std::string_view what) { heard.emplace_back(what); });
    router.add("GET", "/throws", [](const Request&) -> Response { throw std::runtime_error("secret"); });
    router.add("GET", "/splits", [](const Request&) {
      Response response = text("body");
      response.headers.set("X-A", "1\r\nX-B: 2");
      return response;
    });
  });
  server.run();
  RawClient client(server.port());
  for (const char* path : {"/throws", "/splits"}) {
    const Reply reply = client.ask(get(path));
    EXPECT_EQ(reply.status, 500);
    EXPECT_EQ(reply.header("X-B"), "(absent)");
    EXPECT_EQ(reply.body.find("secret"), std::string::npos);
  }
  EXPECT_EQ(client.ask(kGet).status, 200) << "the connection goes on";
  server.stop(0);
  ASSERT_EQ(heard.size(), 2u);
  EXPECT_EQ(heard[0], "secret");
}

TEST(HttpSession, BasePathIsTakenOff) {
  ServerConfig config;
  config.base_path = "/colony";
  TestServer server([](Router& router) { router.add("GET", "/", [](const Request&) { return text("root"); }); },
                    config);
  server.run();
  RawClient client(server.port());
  EXPECT_EQ(client.ask(get("/colony/hello")).body, "hello");
  EXPECT_EQ(client.ask(get("/colony")).body, "root");
  EXPECT_EQ(client.ask(get("/colony/")).body, "root");
  EXPECT_EQ(client.ask(get("/colonyhello")).status, 404);
  EXPECT_EQ(client.ask(kGet).status, 404);
}

TEST(HttpSession, EveryRequestIsLogged) {
  std::vector<AccessRecord> records;
  TestServer server;
  server.on_access = [&records](const AccessRecord& record) { records.push_back(record); };
  server.run();
  RawClient client(server.port());
  client.ask(get("/hello", kHost + "X-Request-Id: id-7\r\n"));
  client.ask(get("/hello", kHost + "X-Request-Id: id-8\r\nOrigin: null\r\n"));
  server.stop(5000);
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].method + records[0].path + records[0].request_id, "GET/helloid-7");
  EXPECT_EQ(records[0].status, 200);
  EXPECT_EQ(records[0].body_bytes, 5u);
  EXPECT_EQ(records[0].remote.substr(0, 10), "127.0.0.1:");
  EXPECT_EQ(records[1].status, 403);
  EXPECT_EQ(records[1].request_id, "id-8");
}

TEST(HttpServer, BindsLoopbackOnlyAndSaysWhyNot) {
  Router router;
  const TokenTable tokens;
  for (const char* address : {"0.0.0.0", "192.0.2.1", "::", "localhost", "", "::ffff:127.0.0.1"}) {
    ServerConfig config;
    config.address = address;
    const auto server = Server::create(config, router, tokens, {});
    ASSERT_FALSE(server) << address;
    EXPECT_EQ(server.error().code, ErrorCode::kInvalid);
    EXPECT_EQ(server.error().fields.at(0).pointer, "server.listen");
  }
  TestServer other;
  ServerConfig config;
  config.port = other.port();
  const auto server = Server::create(config, router, tokens, {});
  ASSERT_FALSE(server);
  EXPECT_EQ(server.error().code, ErrorCode::kUnavailable) << "nothing is wrong with the configuration";
  EXPECT_NE(server.error().message.find(std::to_string(other.port())), std::string::npos);
  config.port = 0;
  config.worker_threads = 0;
  EXPECT_FALSE(Server::create(config, router, tokens, {}));
  config.worker_threads = 1;
  config.allowed_hosts = {"localhost:80"};
  EXPECT_FALSE(Server::create(config, router, tokens, {}));
}

TEST(HttpServer, StopFinishesTheAnswerUnderWayAndTakesNoMore) {
  Door door;
  TestServer server([&door](Router& router) {
    router.add("GET", "/door", [&door](const Request&) {
      door.pass();
      return text("passed");
    });
  });
  server.run();
  RawClient idle(server.port());
  EXPECT_EQ(idle.ask(kGet).status, 200);
  RawClient busy(server.port());
  busy.send(get("/door") + kGet);
  door.wait_for_arrivals(1);
  std::thread stopper([&server] { server.stop(kPatienceMs); });
  EXPECT_EQ(idle.read_to_end(), "") << "an idle connection ends at once";
  door.open();
  const Reply reply = busy.read_reply();
  EXPECT_EQ(reply.body, "passed");
  EXPECT_EQ(reply.header("Connection"), "close");
  EXPECT_EQ(busy.read_to_end(), "");
  stopper.join();
  EXPECT_THROW(RawClient(server.port()), std::runtime_error);
}

}  // namespace
}  // namespace colony::server::http
