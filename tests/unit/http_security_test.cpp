// Tokens, limits by address, sites that may ask, and the headers on every answer, over real sockets.
#include <atomic>

#include <gmock/gmock.h>

#include "tests/unit/http_sources.hpp"
#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

using ::testing::HasSubstr;

ServerConfig with_tokens() {
  ServerConfig config;
  config.tokens_required = true;
  return config;
}

std::string bearer(const std::string& token) { return kHost + "Authorization: Bearer " + token + "\r\n"; }

/// A token of the server's table.
std::string add_token(TestServer& server, const std::string& id, Scope scope) {
  std::string token = *new_token();
  server.tokens.add({id, "name-" + id, scope, hash_of_token(token), unix_time_ms() + 3'600'000});
  return token;
}

void shape(Router& router) {
  router.add("GET", "/open", [](const Request&) { return text("open"); }, Router::Weight::kLight, Access::kOpen);
  router.add("POST", "/who", [](const Request& request) { return text(request.principal.name); },
             Router::Weight::kLight, Access::kSubmit);
}

TEST(HttpSecurity, ATokenIsAskedForBeforeTheBodyIsRead) {
  TestServer server(shape, with_tokens());
  server.run();
  const std::string token = add_token(server, "a", Scope::kSubmit);
  EXPECT_EQ(RawClient(server.port()).ask(get("/open")).body, "open");
  EXPECT_EQ(RawClient(server.port()).ask("OPTIONS /who HTTP/1.1\r\n" + kHost + "\r\n").status, 204);
  for (const char* path : {"/hello", "/nowhere"}) {
    const Reply refused = RawClient(server.port()).ask(get(path));
    EXPECT_EQ(refused.status, 401) << path;
    EXPECT_EQ(refused.header("WWW-Authenticate"), "Bearer realm=\"colony\"");
    EXPECT_EQ(refused.header("Connection"), "close");
  }
  EXPECT_EQ(RawClient(server.port()).ask("HEAD /hello HTTP/1.1\r\n" + kHost + "\r\n").status, 401);
  RawClient waits(server.port());
  EXPECT_EQ(waits.ask("POST /who HTTP/1.1\r\n" + kHost + "Content-Length: 5\r\nExpect: 100-continue\r\n\r\n").status, 401)
      << "no 100: the body is not wanted";
  RawClient client(server.port());
  EXPECT_EQ(client.ask("POST /who HTTP/1.1\r\n" + bearer(token) + "Content-Length: 0\r\n\r\n").body, "name-a");
  EXPECT_EQ(client.ask(get("/hello", bearer(token))).body, "hello") << "a submit token reads";
  const Reply nowhere = client.ask(get("/nowhere", bearer(token)));
  EXPECT_EQ(nowhere.status, 404);
  const std::string reader = add_token(server, "r", Scope::kRead);
  EXPECT_EQ(RawClient(server.port()).ask("POST /who HTTP/1.1\r\n" + bearer(reader) + "Content-Length: 0\r\n\r\n").status, 403);
  server.tokens.remove("a");
  EXPECT_EQ(client.ask(get("/hello", bearer(token))).status, 401) << "on a connection that was let in before";
}

TEST(HttpSecurity, TheLogKnowsTheActorAndNeverTheToken) {
  std::vector<AccessRecord> records;
  std::mutex mutex;
  TestServer server(shape, with_tokens());
  server.on_access = [&](const AccessRecord& record) {
    const std::lock_guard lock(mutex);
    records.push_back(record);
  };
  server.run();
  const std::string token = add_token(server, "a", Scope::kRead);
  EXPECT_EQ(RawClient(server.port()).ask(get("/hello?secret=1", bearer(token))).status, 200);
  EXPECT_EQ(RawClient(server.port()).ask(get("/hello")).status, 401);
  EXPECT_EQ(RawClient(server.port()).ask("POST /who HTTP/1.1\r\n" + bearer(token) + "Content-Length: 0\r\n\r\n").status, 403);
  server.stop(0);
  ASSERT_EQ(records.size(), 3u);
  EXPECT_EQ(records[0].actor, "name-a");
  EXPECT_EQ(records[0].token_id, "a");
  EXPECT_EQ(records[0].path, "/hello");
  EXPECT_EQ(records[1].actor, "") << "nobody";
  EXPECT_EQ(records[2].actor, "name-a") << "who tried what is not theirs";
}

TEST(HttpSecurity, AStreamEndsWithItsToken) {
  ServerConfig config = with_tokens();
  TestServer server(
      [](Router& router) {
        struct Forever : BodySource {
          bool first = true;
          Pull pull(std::string& out) override {
            if (std::exchange(first, false)) out += "first;";
            return Pull::kWait;
          }
          std::string_view farewell() const override { return "bye;"; }
        };
        router.add("GET", "/stream", [](const Request&) { return streamed(std::make_unique<Forever>()); });
      },
      config);
  server.run();
  const std::string token = add_token(server, "a", Scope::kRead);
  RawClient client(server.port());
  client.send(get("/stream", bearer(token)));
  ASSERT_TRUE(client.read_until("first;"));
  server.tokens.remove("a");
  EXPECT_TRUE(client.read_until("bye;")) << "at once, not at the next sign of life";
}

TEST(HttpSecurity, AnAnswerThatIsWaitedForEndsWithItsToken) {
  struct Never : LaterAnswer {
    explicit Never(std::atomic<int>& count) : asked(count) {}
    void on_ready(std::function<void()>) override {}
    std::unique_ptr<Response> ask(bool is_last) override {
      ++asked;
      asked.notify_all();
      return is_last ? std::make_unique<Response>() : nullptr;
    }
    std::chrono::milliseconds wait_max() const override { return std::chrono::hours(1); }
    std::atomic<int>& asked;
  };
  std::atomic<int> asked{0};
  TestServer server(
      [&asked](Router& router) {
        router.add("GET", "/wait", [&asked](const Request&) {
          Response response;
          response.later = std::make_unique<Never>(asked);
          return response;
        });
      },
      with_tokens());
  server.run();
  const std::string removed = add_token(server, "a", Scope::kRead);
  RawClient client(server.port());
  client.send(get("/wait", bearer(removed)));
  asked.wait(0);
  server.tokens.remove("a");
  const Reply reply = client.read_reply();
  EXPECT_EQ(reply.status, 401) << "at once, not when the time is up";
  EXPECT_THAT(reply.header("WWW-Authenticate"), HasSubstr("invalid_token"));
  const std::string brief = *new_token();
  server.tokens.add({"b", "name-b", Scope::kRead, hash_of_token(brief), unix_time_ms() + 100});
  EXPECT_EQ(RawClient(server.port()).ask(get("/wait", bearer(brief))).status, 401) << "its time is the token's";
}

TEST(HttpSecurity, WhatWasFoundIsNotToldToATokenThatEndedMeanwhile) {
  TokenTable* table = nullptr;
  TestServer server(
      [&table](Router& router) {
        const auto ends = [&table](const Request& request) {
          table->remove(request.principal.token_id);
          return text("found");
        };
        router.add("GET", "/slow", ends);
        router.add("POST", "/slow", ends, Router::Weight::kLight, Access::kSubmit);
      },
      with_tokens());
  table = &server.tokens;
  server.run();
  EXPECT_EQ(RawClient(server.port()).ask(get("/slow", bearer(add_token(server, "a", Scope::kRead)))).status, 401);
  const std::string submit = add_token(server, "b", Scope::kSubmit);
  EXPECT_EQ(RawClient(server.port()).ask("POST /slow HTTP/1.1\r\n" + bearer(submit) + "Content-Length: 0\r\n\r\n").body,
            "found") << "what is done is said to be done";
}

// The 100 says that the header was let in; what is sent then is a body behind which the token has ended.
TEST(HttpSecurity, NothingIsBegunForATokenThatEndedBehindTheHeader) {
  std::atomic<int> begun{0};
  TestServer server(
      [&begun](Router& router) {
        for (const char* method : {"GET", "POST", "PATCH", "DELETE"}) {
          router.add(method, "/act", [&begun](const Request&) { ++begun; return text("done"); }, Router::Weight::kLight, Access::kSubmit);
        }
      },
      with_tokens());
  server.run();
  for (const std::string method : {"GET", "POST", "PATCH", "DELETE"}) {
    for (const char* how : {"stays", "is removed", "expires"}) {
      SCOPED_TRACE(method + ", and the token " + how);
      const std::string token = add_token(server, "a", Scope::kSubmit);
      RawClient client(server.port());
      ASSERT_EQ(client.ask(method + " /act HTTP/1.1\r\n" + bearer(token) + "Content-Length: 5\r\nExpect: 100-continue\r\n\r\n").status, 100);
      client.send("ab");
      if (how == std::string("is removed")) server.tokens.remove("a");
      if (how == std::string("expires")) server.tokens.add({"a", "name-a", Scope::kSubmit, hash_of_token(token), unix_time_ms() - 1});
      client.send("cde");
      const Reply reply = client.read_reply();
      if (how == std::string("stays")) {
        EXPECT_EQ(reply.status, 200);
        EXPECT_EQ(begun.exchange(0), 1);
      } else {
        EXPECT_EQ(reply.status, 401);
        EXPECT_THAT(reply.header("WWW-Authenticate"), HasSubstr("invalid_token"));
        EXPECT_EQ(begun, 0);
      }
      server.tokens.remove("a");
    }
  }
}

TEST(HttpSecurity, NothingIsBegunForATokenThatEndedBeforeAWorkerCame) {
  std::atomic<int> begun{0};
  TokenTable* table = nullptr;
  TestServer server(
      [&begun, &table](Router& router) {
        router.add("POST", "/act", [&begun](const Request&) { ++begun; return text("done"); }, Router::Weight::kLight, Access::kSubmit);
        // Asked between the body and the queue of the workers.
        router.set_ready("POST", "/act", [&table](const Request& request) -> std::optional<Response> {
          table->remove(request.principal.token_id);
          return std::nullopt;
        });
      },
      with_tokens());
  table = &server.tokens;
  server.run();
  const std::string token = add_token(server, "a", Scope::kSubmit);
  EXPECT_EQ(RawClient(server.port()).ask("POST /act HTTP/1.1\r\n" + bearer(token) + "Content-Length: 0\r\n\r\n").status, 401);
  EXPECT_EQ(begun, 0);
}

TEST(HttpSecurity, OneAddressHasItsShareOfConnectionsOnly) {
  ServerConfig config;
  config.connections_per_address_max = 2;
  {
    TestServer server({}, config);
    server.run();
    RawClient a(server.port()), b(server.port()), c(server.port());
    for (RawClient* client : {&a, &b, &c}) EXPECT_EQ(client->ask(kGet).status, 200) << "this machine is not counted";
  }
  config.limits_loopback = true;
  TestServer server({}, config);
  server.run();
  RawClient a(server.port());
  auto b = std::make_unique<RawClient>(server.port());
  EXPECT_EQ(a.ask(kGet).status, 200);
  EXPECT_EQ(b->ask(kGet).status, 200);
  const Reply refused = RawClient(server.port()).ask(kGet);
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.header("Retry-After"), "1");
  EXPECT_THAT(refused.body, HasSubstr("your address"));
  EXPECT_EQ(b->ask("GET /hello HTTP/1.1\r\n" + kHost + "Connection: close\r\n\r\n").status, 200);
  b->read_to_end();
  b.reset();
  // The server hears of the end in its own time.
  int status = 503;
  for (int i = 0; i < 10'000 && status == 503; ++i) status = RawClient(server.port()).ask(kGet).status;
  EXPECT_EQ(status, 200);
}

TEST(HttpSecurity, TooManyRequestsAreToldWhenToComeBack) {
  ServerConfig config;
  config.limits_loopback = true;
  config.requests_per_s = 0.001;
  config.requests_burst = 2;
  TestServer server({}, config);
  server.run();
  RawClient client(server.port());
  EXPECT_EQ(client.ask(kGet).status, 200);
  EXPECT_EQ(client.ask(kGet).status, 200);
  const Reply refused = client.ask(kGet);
  EXPECT_EQ(refused.status, 429);
  EXPECT_GE(std::stoi(refused.header("Retry-After")), 900);
}

TEST(HttpSecurity, EveryAnswerCarriesThePolicies) {
  TestServer server([](Router& router) {
    router.add("GET", "/page", [](const Request&) {
      Response response = text("<!doctype html>");
      response.headers.set("Content-Type", "text/html; charset=utf-8");
      return response;
    });
    router.add("GET", "/own", [](const Request&) {
      Response response = text("x");
      response.headers.set("Content-Security-Policy", "default-src 'none'; style-src 'sha256-x'");
      response.headers.set("Cache-Control", "private, no-cache");
      return response;
    });
  });
  server.run();
  for (const std::string& request : {get("/hello"), get("/nowhere"), get("/%zz"), get("/page")}) {
    const Reply reply = RawClient(server.port()).ask(request);
    EXPECT_EQ(reply.header("X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(reply.header("Referrer-Policy"), "no-referrer");
    EXPECT_EQ(reply.header("Cache-Control"), "no-store");
    EXPECT_EQ(reply.header("Cross-Origin-Resource-Policy"), "same-origin");
    EXPECT_THAT(reply.header("Content-Security-Policy"), HasSubstr("frame-ancestors 'none'"));
    EXPECT_THAT(reply.header("Content-Security-Policy"), ::testing::Not(HasSubstr("unsafe")));
    EXPECT_EQ(reply.header("Strict-Transport-Security"), "(absent)") << "not over plain HTTP (RFC 6797, 7.2)";
    EXPECT_EQ(reply.header("Vary"), "(absent)");
  }
  EXPECT_THAT(RawClient(server.port()).ask(get("/page")).header("Content-Security-Policy"), HasSubstr("script-src 'self'"));
  EXPECT_THAT(RawClient(server.port()).ask(get("/hello")).header("Content-Security-Policy"),
              ::testing::Not(HasSubstr("script-src")));
  const Reply own = RawClient(server.port()).ask(get("/own"));
  EXPECT_THAT(own.header("Content-Security-Policy"), HasSubstr("sha256-x"));
  EXPECT_EQ(own.headers.count("Content-Security-Policy"), 1u);
  EXPECT_EQ(own.header("Cache-Control"), "private, no-cache");
}

TEST(HttpSecurity, ListedSitesMayAskAndOthersNot) {
  ServerConfig config = with_tokens();
  config.cors_origins = {"https://lab.example", "http://localhost:3000"};
  TestServer server(shape, config);
  server.run();
  const std::string token = add_token(server, "a", Scope::kSubmit);
  const std::string preflight = "OPTIONS /who HTTP/1.1\r\n" + kHost + "Access-Control-Request-Method: POST\r\nOrigin: ";
  const Reply asked = RawClient(server.port()).ask(preflight + "https://lab.example\r\n\r\n");
  EXPECT_EQ(asked.status, 204);
  EXPECT_EQ(asked.header("Access-Control-Allow-Origin"), "https://lab.example");
  EXPECT_EQ(asked.header("Access-Control-Allow-Methods"), "POST, OPTIONS");
  EXPECT_THAT(asked.header("Access-Control-Allow-Headers"), HasSubstr("Authorization"));
  EXPECT_EQ(asked.header("Access-Control-Allow-Credentials"), "(absent)");
  EXPECT_EQ(asked.header("Vary"), "Origin");
  const Reply answer =
      RawClient(server.port()).ask(get("/hello", bearer(token) + "Origin: http://localhost:3000\r\n"));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.header("Access-Control-Allow-Origin"), "http://localhost:3000");
  EXPECT_THAT(answer.header("Access-Control-Expose-Headers"), HasSubstr("X-Request-Id"));
  const Reply refused = RawClient(server.port()).ask(get("/hello", kHost + "Origin: https://lab.example\r\n"));
  EXPECT_EQ(refused.status, 401);
  EXPECT_EQ(refused.header("Access-Control-Allow-Origin"), "https://lab.example") << "the page may read why";
  for (const char* origin : {"https://evil.example", "http://lab.example", "https://lab.example:444", "https://lab.example.evil.example",
                             "https://LAB.example", "null", "https://lab.example\r\nOrigin: https://lab.example"}) {
    const Reply foreign = RawClient(server.port()).ask(preflight + origin + "\r\n\r\n");
    EXPECT_EQ(foreign.status, 403) << origin;
    EXPECT_EQ(foreign.header("Access-Control-Allow-Origin"), "(absent)") << origin;
  }
  EXPECT_EQ(RawClient(server.port()).ask(get("/hello", bearer(token))).header("Vary"), "Origin") << "caches must know";
}

TEST(HttpSecurity, NothingButLoopbackWithoutTokensAndTls) {
  Router router;
  const TokenTable tokens;
  ServerConfig config;
  config.port = 0;
  config.address = "0.0.0.0";
  EXPECT_FALSE(Server::create(config, router, tokens, {}));
  config.behind_proxy = true;
  EXPECT_FALSE(Server::create(config, router, tokens, {})) << "a proxy is no token";
  config.tokens_required = true;
  config.behind_proxy = false;
  EXPECT_FALSE(Server::create(config, router, tokens, {})) << "tokens would go in the clear";
  config.behind_proxy = true;
  EXPECT_TRUE(Server::create(config, router, tokens, {}));
  config.behind_proxy = false;
  config.tls_certificate = "/no/such/file";
  config.tls_key = "/no/such/file";
  const auto server = Server::create(config, router, tokens, {});
  ASSERT_FALSE(server);
  EXPECT_EQ(server.error().code, ErrorCode::kInvalid);
  EXPECT_EQ(server.error().fields.at(0).pointer, "tls.certificate");
  EXPECT_THAT(server.error().message, ::testing::Not(HasSubstr("tls.certificate"))) << "said once, by the field";
}

}  // namespace
}  // namespace colony::server::http
