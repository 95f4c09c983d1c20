// server/http over real sockets: which request shapes are refused, with which status, and which unusual ones are not.
#include <vector>

#include "tests/unit/http_support.hpp"

namespace colony::server::http {
namespace {

using namespace std::string_literals;

struct Shape {
  const char* name;
  std::string bytes;
  int status;
};

std::vector<Shape> refused_shapes() {
  return {
      {"coding other than chunked", post("Transfer-Encoding: gzip\r\n"), 400},
      {"coding in other case", post("Transfer-Encoding: Chunked\r\n", "0\r\n\r\n"), 400},
      {"coding list", post("Transfer-Encoding: gzip, chunked\r\n", "0\r\n\r\n"), 400},
      {"coding chunked twice in a list", post("Transfer-Encoding: chunked, chunked\r\n", "0\r\n\r\n"), 400},
      {"coding identity", post("Transfer-Encoding: identity\r\n"), 400},
      {"coding with control character",
       post("Transfer-Encoding: \x0b"
            "chunked\r\n",
            "0\r\n\r\n"),
       400},
      {"coding empty", post("Transfer-Encoding: \r\n"), 400},
      {"two codings", post("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n", "0\r\n\r\n"), 400},
      {"coding and length", post("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", "0\r\n\r\n"), 400},
      {"length and coding", post("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n", "0\r\n\r\n"), 400},
      {"coding on HTTP/1.0", "POST /echo HTTP/1.0\r\n" + kHost + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400},
      {"two equal lengths", post("Content-Length: 2\r\nContent-Length: 2\r\n", "ab"), 400},
      {"two lengths", post("Content-Length: 2\r\ncontent-length: 3\r\n", "abc"), 400},
      {"comma in length", post("Content-Length: 2, 2\r\n", "ab"), 400},
      {"signed length", post("Content-Length: +2\r\n", "ab"), 400},
      {"negative length", post("Content-Length: -2\r\n"), 400},
      {"hexadecimal length", post("Content-Length: 0x2\r\n", "ab"), 400},
      {"empty length", post("Content-Length:\r\n"), 400},
      {"endless length", post("Content-Length: 99999999999999999999\r\n"), 400},
      {"no Host", "GET /hello HTTP/1.1\r\n\r\n", 400},
      {"no Host on HTTP/1.0", "GET /hello HTTP/1.0\r\n\r\n", 400},
      {"two Hosts", get("/hello", kHost + kHost), 400},
      {"empty Host", get("/hello", "Host:\r\n"), 400},
      {"Host list", get("/hello", "Host: localhost, evil\r\n"), 400},
      {"Host with user", get("/hello", "Host: a@localhost\r\n"), 400},
      {"Host with bad port", get("/hello", "Host: localhost:http\r\n"), 400},
      {"folded field", get("/hello", kHost + "X-A: 1\r\n 2\r\n"), 400},
      {"folded by tab", get("/hello", kHost + "X-A: 1\r\n\t2\r\n"), 400},
      {"folded first field", get("/hello", " " + kHost), 400},
      {"blank before colon", get("/hello", "Host : localhost\r\n"), 400},
      {"no colon", get("/hello", kHost + "nonsense\r\n"), 400},
      {"empty name", get("/hello", kHost + ": 1\r\n"), 400},
      {"name with brackets", get("/hello", kHost + "X(A): 1\r\n"), 400},
      {"NUL in value", get("/hello", kHost + "X-A: a\0b\r\n"s), 400},
      {"control character in value",
       get("/hello", kHost + "X-A: a\x01"
                             "b\r\n"),
       400},
      {"delete character in value",
       get("/hello", kHost + "X-A: a\x7f"
                             "b\r\n"),
       400},
      {"bare LF", "GET /hello HTTP/1.1\nHost: localhost\n\n", 400},
      {"bare LF in fields", get("/hello", kHost + "X-A: 1\nX-B: 2\r\n"), 400},
      {"bare CR in value", get("/hello", kHost + "X-A: 1\rX-B: 2\r\n"), 400},
      {"two empty lines first", "\r\n\r\n" + kGet, 400},
      {"TLS hello", "\x16\x03\x01\x02\x00\x01\x00\x01"s, 400},
      {"no version", "GET /hello\r\n\r\n", 400},
      {"three blanks", "GET  /hello HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"blank in target", get("/hello there"), 400},
      {"tab in request line", "GET\t/hello HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"lower-case protocol", "GET /hello http/1.1\r\n" + kHost + "\r\n", 400},
      {"version of two digits", "GET /hello HTTP/1.10\r\n" + kHost + "\r\n", 400},
      {"HTTP/2 preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505},
      {"HTTP/1.2", "GET /hello HTTP/1.2\r\n" + kHost + "\r\n", 505},
      {"HTTP/0.9 with version", "GET /hello HTTP/0.9\r\n" + kHost + "\r\n", 505},
      {"absolute target elsewhere", get("http://evil.example/hello"), 400},
      {"absolute target elsewhere, Host too", get("http://evil.example/hello", "Host: evil.example\r\n"), 400},
      {"absolute target and other Host", get("http://127.0.0.1/hello"), 400},
      {"absolute target with user", get("http://a@localhost/hello"), 400},
      {"absolute target of https", get("https://localhost/hello"), 400},
      {"authority target", "CONNECT localhost:80 HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"asterisk target of GET", get("*"), 400},
      {"asterisk and more", "OPTIONS *a HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"relative target", get("hello"), 400},
      {"fragment", get("/hello#a"), 400},
      {"target beyond ASCII", get("/h\xC3\xA4llo"), 400},
      {"dot segment", get("/x/../hello"), 400},
      {"escaped dot segment", get("/x/%2e%2e/hello"), 400},
      {"single dot segment", get("/./hello"), 400},
      {"escaped slash", get("/x%2fhello"), 400},
      {"escaped NUL", get("/hello%00"), 400},
      {"escaped NUL in query", get("/hello?a=%00"), 400},
      {"broken escape", get("/hello%2"), 400},
      {"escape of no number", get("/hello?a=%gg"), 400},
      {"escaped bytes that are no UTF-8", get("/hello%ff"), 400},
      {"foreign Host", get("/hello", "Host: evil.example\r\n"), 421},
      {"foreign Host that begins as ours", get("/hello", "Host: localhost.evil.example\r\n"), 421},
      {"foreign Origin", get("/hello", kHost + "Origin: http://evil.example\r\n"), 403},
      {"Origin of another port", get("/hello", kHost + "Origin: http://localhost:1\r\n"), 403},
      {"Origin null", get("/hello", kHost + "Origin: null\r\n"), 403},
      {"second Origin foreign", get("/hello", kHost + "Origin: http://localhost\r\nOrigin: http://evil.example\r\n"),
       403},
      {"unknown method", "BREW /hello HTTP/1.1\r\n" + kHost + "\r\n", 501},
      {"method in lower case", "get /hello HTTP/1.1\r\n" + kHost + "\r\n", 501},
      {"TRACE", "TRACE /hello HTTP/1.1\r\n" + kHost + "\r\n", 501},
      {"method of no token", "GE(T /hello HTTP/1.1\r\n" + kHost + "\r\n", 400},
      {"long target", get("/" + std::string(4096, 'a')), 414},
      {"endless request line", "GET /" + std::string(9000, 'a'), 414},
      {"large header", get("/hello", kHost + "X-A: " + std::string(9000, 'a') + "\r\n"), 431},
      {"many fields",
       get(
           "/hello", kHost +
                         [] {
                           std::string fields;
                           for (int i = 0; i < 100; ++i) fields += "a: b\r\n";
                           return fields;
                         }()),
       431},
      {"large body", post("Content-Length: 1048577\r\n", std::string(1048577, 'x')), 413},
      {"large body announced", post("Content-Length: 1048577\r\nExpect: 100-continue\r\n"), 413},
      {"large chunk", post("Transfer-Encoding: chunked\r\n", "100001\r\n"), 413},
      {"chunks large in sum",
       post("Transfer-Encoding: chunked\r\n", "100000\r\n" + std::string(0x100000, 'x') + "\r\n1\r\nx\r\n"), 413},
      {"chunk extension", post("Transfer-Encoding: chunked\r\n", "1;" + std::string(300, 'x') + "\r\n"), 400},
      {"chunk extension without end", post("Transfer-Encoding: chunked\r\n", "1;" + std::string(20'000, 'x')), 400},
      {"chunk of no size", post("Transfer-Encoding: chunked\r\n", "zz\r\n"), 400},
      {"chunk without CRLF", post("Transfer-Encoding: chunked\r\n", "1\r\nab0\r\n\r\n"), 400},
      {"chunk line ended by LF", post("Transfer-Encoding: chunked\r\n", "1\na\n0\n\n"), 400},
      {"trailer without end", post("Transfer-Encoding: chunked\r\n", "0\r\nX: " + std::string(20'000, 'x')), 400},
      {"other expectation", post("Expect: 200-ok\r\nContent-Length: 1\r\n"), 417},
  };
}

TEST(HttpShapes, EachRefusedShapeGetsAProblemAndTheConnectionEnds) {
  TestServer server;
  server.run();
  const auto shapes = refused_shapes();
  EXPECT_GE(shapes.size(), 40u);
  for (const auto& shape : shapes) {
    SCOPED_TRACE(shape.name);
    RawClient client(server.port());
    client.send(shape.bytes);
    client.end_sending();
    const Reply reply = client.read_last_reply();
    EXPECT_EQ(reply.status, shape.status) << reply.body;
    EXPECT_TRUE(reply.is_complete);
    EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
    EXPECT_EQ(reply.header("Connection"), "close");
    EXPECT_NE(reply.body.find("\"request_id\":\"" + reply.header("X-Request-Id") + "\""), std::string::npos)
        << reply.body;
    EXPECT_EQ(client.read_to_end(), "") << "what follows a refused request is not answered";
  }
}

TEST(HttpShapes, UnusualButRightShapesAreAnswered) {
  TestServer server;
  server.run();
  const std::string own = "localhost:" + std::to_string(server.port());
  const std::vector<Shape> shapes = {
      {"plain", kGet, 200},
      {"one empty line first", "\r\n" + kGet, 200},
      {"absolute target", get("http://LOCALHOST/hello", "Host: localhost\r\n"), 200},
      {"Host with port", get("/hello", "Host: " + own + "\r\n"), 200},
      {"Host of a tunnel", get("/hello", "Host: localhost:9999\r\nOrigin: http://localhost:9999\r\n"), 200},
      {"IPv6 Host", get("/hello", "Host: [::1]:80\r\n"), 200},
      {"own Origin", get("/hello", kHost + "Origin: http://" + own + "\r\n"), 200},
      {"escaped path", get("/%68ello"), 200},
      {"no blank after colon", get("/hello", "Host:localhost\r\n"), 200},
      {"blanks around value", get("/hello", "Host: \t localhost \t\r\n"), 200},
      {"bytes beyond ASCII in a value", get("/hello", kHost + "X-A: \xC3\xA4\r\n"), 200},
      {"HTTP/1.0", "GET /hello HTTP/1.0\r\n" + kHost + "\r\n", 200},
      {"length with zeros", post("Content-Length: 0002\r\n", "ab"), 200},
      {"no body", post(""), 200},
      {"GET with a body", get("/hello", kHost + "Content-Length: 2\r\n") + "ab", 200},
      {"expectation on HTTP/1.0",
       "POST /echo HTTP/1.0\r\n" + kHost + "Expect: 100-continue\r\nContent-Length: 1\r\n\r\na", 200},
      {"body of exactly the limit", post("Content-Length: 1048576\r\n", std::string(1048576, 'x')), 200},
      {"nothing there", get("/nothing"), 404},
      {"two slashes", get("//hello"), 404},
      {"wrong method", "PUT /hello HTTP/1.1\r\n" + kHost + "\r\n", 405},
      {"options of the server", "OPTIONS * HTTP/1.1\r\n" + kHost + "\r\n", 204},
      {"options of the server, absolute", "OPTIONS http://localhost HTTP/1.1\r\n" + kHost + "\r\n", 204},
      {"options of what is nowhere, absolute", "OPTIONS http://localhost/ HTTP/1.1\r\n" + kHost + "\r\n", 404},
      {"options of what is nowhere, with a query", "OPTIONS http://localhost?a HTTP/1.1\r\n" + kHost + "\r\n", 404},
      {"options", "OPTIONS /hello HTTP/1.1\r\n" + kHost + "\r\n", 204},
  };
  for (const auto& shape : shapes) {
    SCOPED_TRACE(shape.name);
    RawClient client(server.port());
    client.send(shape.bytes);
    client.end_sending();
    const Reply reply = client.read_last_reply();
    EXPECT_EQ(reply.status, shape.status) << reply.body;
    EXPECT_TRUE(reply.is_complete);
    EXPECT_EQ(reply.header("X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(reply.header("Cache-Control"), "no-store");
    EXPECT_EQ(reply.header("Server"), "(absent)");
    if (shape.status == 405) {
      EXPECT_EQ(reply.header("Allow"), "GET, HEAD, OPTIONS");
    }
  }
}

}  // namespace
}  // namespace colony::server::http
