// The parts of server/http that need no socket: target, scanner, problem, wire.
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "server/http/body_reader.hpp"
#include "server/http/gate.hpp"
#include "server/http/router.hpp"
#include "server/http/text.hpp"
#include "server/http/wire.hpp"

namespace colony::server::http {
namespace {

GatePolicy policy() { return {{"127.0.0.1", "localhost", "[::1]"}, 8080, 8192, 100, 4096, 1000}; }

TEST(HttpTarget, DecodesPathAndQuery) {
  const auto target = parse_target("/v1/jobs/%C3%A4%20b?label=a%3Db&x&&name=two+words&q=%26");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/v1/jobs/\xC3\xA4 b");
  const std::vector<std::pair<std::string, std::string>> query = {
      {"label", "a=b"}, {"x", ""}, {"name", "two words"}, {"q", "&"}};
  EXPECT_EQ(target->query, query);
  EXPECT_FALSE(target->authority);
  const auto absolute = parse_target("http://LocalHost:81?a=1");
  ASSERT_TRUE(absolute);
  EXPECT_EQ(absolute->path, "/");
  EXPECT_EQ(absolute->authority, (Authority{"localhost", std::uint16_t{81}}));
}

TEST(HttpTarget, RefusesWhatTwoReadersCouldReadInTwoWays) {
  for (const char* text : {"",
                           "*",
                           "a",
                           "a:80",
                           "https://localhost/",
                           "http:///x",
                           "http://u@localhost/",
                           "http://localhost:99999/",
                           "/a/../b",
                           "/a/%2e%2E/b",
                           "/.",
                           "/./a",
                           "/..",
                           "/a%2fb",
                           "/a%2Fb",
                           "/%00",
                           "/%0a",
                           "/%7f",
                           "/%zz",
                           "/%4",
                           "/%",
                           "/a#b",
                           "/a\"b",
                           "/a\\b",
                           "/\xC3\xA4",
                           "/%ff",
                           "/%c0%ae",
                           "/%ed%a0%80",
                           "/a?b=%00",
                           "/a?%f5=1",
                           "/a?b#c",
                           "/a?b=%q0"}) {
    EXPECT_FALSE(parse_target(text)) << text;
  }
  EXPECT_TRUE(parse_target("/...")) << "three dots are a name";
}

TEST(HttpTarget, Authority) {
  EXPECT_EQ(parse_authority("[::1]:80"), (Authority{"[::1]", std::uint16_t{80}}));
  EXPECT_EQ(parse_authority("127.0.0.1"), (Authority{"127.0.0.1", std::nullopt}));
  for (const char* text : {"", ":80", "a:", "a:b", "a:123456", "a:70000", "a b", "a,b", "::1", "[::1", "[]", "[::1]x",
                           "a/b", "a@b", "a:80:80"}) {
    EXPECT_FALSE(parse_authority(text)) << text;
  }
}

TEST(HttpGate, ScannerSeesTheEndHoweverTheBytesCome) {
  const std::string head = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  HeadScanner scanner;
  for (std::size_t size = 0; size < head.size(); ++size) {
    ASSERT_EQ(scanner.scan(std::string_view(head).substr(0, size), policy()), HeadScanner::State::kNeedMore) << size;
  }
  EXPECT_EQ(scanner.scan(head + "rest", policy()), HeadScanner::State::kComplete);
  EXPECT_EQ(scanner.head_size(), head.size());
}

TEST(HttpGate, HeaderOfExactlyTheLimitPasses) {
  GatePolicy tight = policy();
  const std::string head = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  tight.header_bytes_max = head.size();
  HeadScanner exact;
  EXPECT_EQ(exact.scan(head, tight), HeadScanner::State::kComplete);
  tight.header_bytes_max = head.size() - 1;
  HeadScanner beyond;
  ASSERT_EQ(beyond.scan(head, tight), HeadScanner::State::kRefused);
  EXPECT_EQ(beyond.refusal().status, 431);
}

TEST(HttpGate, OnePathTakesLargerBodies) {
  GatePolicy with_path = policy();
  with_path.large_body_path = "/v1/analyses";
  with_path.large_body_bytes_max = 5000;
  struct Case {
    const char* line;
    const char* framing;
    int status;  // 0: passes
    bool may_be_large;
  };
  const Case cases[] = {{"POST /v1/analyses?name=a", "Content-Length: 5000", 0, true},
                        {"POST /v1/analyses", "Content-Length: 5001", 413, false},
                        {"POST /v1/analyses", "Content-Length: 1000", 0, false},
                        {"POST /v1/analyses", "Transfer-Encoding: chunked", 0, true},
                        {"PUT /v1/analyses", "Content-Length: 1001", 413, false},
                        {"POST /v1/analyses/", "Content-Length: 1001", 413, false},
                        {"POST /v1/jobs", "Content-Length: 1001", 413, false},
                        {"POST /v1/jobs", "Transfer-Encoding: chunked", 0, false}};
  for (const Case& one : cases) {
    RequestHead head;
    const auto refusal = examine(
        std::string(one.line) + " HTTP/1.1\r\nHost: localhost\r\n" + one.framing + "\r\n\r\n", with_path, head);
    EXPECT_EQ(refusal ? refusal->status : 0, one.status) << one.line << " " << one.framing;
    EXPECT_EQ(head.may_be_large, one.may_be_large) << one.line << " " << one.framing;
  }
}

TEST(HttpGate, ReadsWhatTheSessionNeeds) {
  RequestHead head;
  const auto refusal = examine(
      "PUT /a?b=c HTTP/1.1\r\nHOST: LOCALHOST:9000\r\nConnection: TE, close\r\nContent-Length:  007 \r\n"
      "X-Request-Id: run-1.a_b\r\nExpect: 100-Continue\r\nOrigin: http://localhost:9000\r\n\r\n",
      policy(), head);
  EXPECT_FALSE(refusal);
  EXPECT_EQ(head.method, "PUT");
  EXPECT_EQ(head.content_length, 7u);
  EXPECT_EQ(head.request_id, "run-1.a_b");
  EXPECT_TRUE(head.expects_continue);
  EXPECT_FALSE(head.keep_alive);
  RequestHead old;
  EXPECT_FALSE(examine("GET / HTTP/1.0\r\nHost: [::1]\r\nConnection: Keep-Alive\r\nExpect: 100-continue\r\n\r\n",
                       policy(), old));
  EXPECT_TRUE(old.keep_alive);
  EXPECT_FALSE(old.expects_continue) << "HTTP/1.0 knows no 100";
}

TEST(HttpGate, EveryPrefixAndEveryDamagedByteIsDecidedWithoutHarm) {
  const std::string good =
      "POST http://localhost/a%20b?c=%41 HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n";
  RequestHead whole;
  ASSERT_FALSE(examine(good, policy(), whole));
  for (std::size_t i = 0; i < good.size(); ++i) {
    RequestHead head;
    EXPECT_TRUE(examine(good.substr(0, i), policy(), head)) << i;
    for (int byte = 0; byte < 256; ++byte) {
      std::string damaged = good;
      damaged[i] = static_cast<char>(byte);
      HeadScanner scanner;
      if (scanner.scan(damaged, policy()) != HeadScanner::State::kComplete) continue;
      RequestHead damaged_head;
      const auto refusal = examine(std::string_view(damaged).substr(0, scanner.head_size()), policy(), damaged_head);
      if (refusal) continue;
      // What passes still has one framing and a path that is clean.
      EXPECT_FALSE(damaged_head.chunked && damaged_head.content_length);
      EXPECT_TRUE(is_utf8(damaged_head.target.path));
      EXPECT_EQ(damaged_head.target.path.front(), '/');
    }
  }
}

BodyReader::State feed_bytewise(BodyReader& reader, std::string_view bytes, std::string& input) {
  auto state = reader.feed(input);
  for (const char c : bytes) {
    if (state != BodyReader::State::kNeedMore) {
      input += c;
      continue;
    }
    input += c;
    state = reader.feed(input);
  }
  return state;
}

TEST(HttpBody, ChunksByteByByteAndTheNextRequestStays) {
  RequestHead head;
  head.chunked = true;
  BodyReader reader(head, 10);
  std::string input;
  ASSERT_EQ(feed_bytewise(reader, "3;a=b\r\nabc\r\n7\r\ndefghij\r\n0\r\nX-Sum: 1\r\n\r\nGET", input),
            BodyReader::State::kComplete);
  EXPECT_EQ(reader.take_body(), "abcdefghij");
  EXPECT_EQ(input, "GET");
}

// Beast 1.81 asserts (in a build with assertions the process ends) when the last chunk of an empty body comes in pieces.
TEST(HttpBody, AnEmptyChunkedBodyByteByByte) {
  RequestHead head;
  head.chunked = true;
  for (const std::string bytes : {"0\r\n\r\n", "000\r\n\r\n", "0;a\r\n\r\n", "0\r\nA: b\r\n\r\n"}) {
    BodyReader reader(head, 10);
    std::string input;
    EXPECT_EQ(feed_bytewise(reader, bytes + "GET", input), BodyReader::State::kComplete) << bytes;
    EXPECT_EQ(input, "GET") << bytes;
    EXPECT_EQ(reader.take_body(), "") << bytes;
  }
}

TEST(HttpBody, RefusesWhatIsTooLargeOrMalformed) {
  const std::string extension(300, 'x');
  const std::string endless(20'000, '0');
  const std::pair<std::string, int> cases[] = {
      {"b\r\nabcdefghijk\r\n0\r\n\r\n", 413},
      {"6\r\nabcdef\r\n6\r\nabcdef\r\n0\r\n\r\n", 413},
      {"ffffffffffffffff1\r\n", 400},
      {"ffffffffffffffff\r\n", 413},
      {"x\r\n", 400},
      {"-1\r\n", 400},
      {" 1\r\na\r\n", 400},
      {"1\r\nab0\r\n", 400},
      {"1\na\r\n", 400},
      {"1;" + extension + "\r\na\r\n", 400},
      {"1;" + endless, 400},
      {"0\r\nX: " + endless, 400},
      {endless, 400},
      {"\r\n", 400},
  };
  for (const auto& [bytes, status] : cases) {
    RequestHead head;
    head.chunked = true;
    BodyReader reader(head, 10);
    std::string input = bytes;
    ASSERT_EQ(reader.feed(input), BodyReader::State::kRefused) << bytes.substr(0, 40);
    EXPECT_EQ(reader.refusal().status, status) << bytes.substr(0, 40);
  }
}

TEST(HttpBody, ExtensionsAreBoundedInSum) {
  RequestHead head;
  head.chunked = true;
  BodyReader reader(head, 1000);
  const std::string chunk = "1;" + std::string(200, 'x') + "\r\na\r\n";
  auto state = BodyReader::State::kNeedMore;
  int count = 0;
  for (; state == BodyReader::State::kNeedMore && count < 1000; ++count) {
    std::string input = chunk;
    state = reader.feed(input);
  }
  EXPECT_EQ(state, BodyReader::State::kRefused);
  EXPECT_LT(count, 30);
}

// Beast reads such a line again with every piece; each reading must not cost a part of the bound.
TEST(HttpBodyReader, AnOpenQuoteIsReadAlikeInPiecesAndAtOnce) {
  RequestHead head;
  head.chunked = true;
  const std::string bytes = "55;a;a=\"b\r\n\r\n" + std::string(60, 'x');
  for (const std::size_t step : {bytes.size(), std::size_t{8}, std::size_t{1}}) {
    BodyReader reader(head, 1000);
    std::string input;
    auto state = BodyReader::State::kNeedMore;
    for (std::size_t at = 0; at < bytes.size() && state == BodyReader::State::kNeedMore; at += step) {
      input += bytes.substr(at, step);
      state = reader.feed(input);
    }
    EXPECT_EQ(state, BodyReader::State::kNeedMore) << step;
  }
}

TEST(HttpProblem, IsJsonWhateverItIsGiven) {
  const auto response = problem(400, "bad-request", "a \"title\"", "\\ \n \x01 \xff \xC3\xA4 \x7f", "r");
  EXPECT_EQ(response.headers.get("Content-Type"), "application/problem+json");
  EXPECT_EQ(response.body,
            "{\"type\":\"urn:colony:problem:bad-request\",\"title\":\"a \\\"title\\\"\",\"status\":400,"
            "\"detail\":\"\\\\ \\u000a \\u0001 \\ufffd \xC3\xA4 \\u007f\",\"request_id\":\"r\"}\n");
}

TEST(HttpWire, DateAndChunk) {
  EXPECT_EQ(write_date(784111777), "Sun, 06 Nov 1994 08:49:37 GMT");
  EXPECT_EQ(write_date(0), "Thu, 01 Jan 1970 00:00:00 GMT");
  EXPECT_EQ(write_chunk_size(31), "1f\r\n");
  EXPECT_EQ(write_chunk_size(64 * 1024), "10000\r\n");
}

TEST(HttpWire, FaultsOfResponses) {
  Response response;
  EXPECT_FALSE(fault_of(response));
  response.headers.set("Location", "/a\r\nSet-Cookie: b");
  EXPECT_TRUE(fault_of(response));
  response.headers = Headers();
  response.headers.set("Content-Length", "1");
  EXPECT_TRUE(fault_of(response));
  response.headers = Headers();
  response.status = 304;
  EXPECT_FALSE(fault_of(response));
  response.body = "x";
  EXPECT_TRUE(fault_of(response));
}

TEST(HttpHeaders, NamesHaveNoCase) {
  Headers headers;
  headers.add("A", "1");
  headers.add("a", "2");
  EXPECT_EQ(headers.get("a"), "1");
  EXPECT_EQ(headers.count("A"), 2u);
  headers.set("a", "3");
  EXPECT_EQ(headers.all().size(), 1u);
  EXPECT_EQ(headers.get("A"), "3");
}

}  // namespace
}  // namespace colony::server::http
