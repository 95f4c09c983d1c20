// gate_fuzz: bytes of a connection through the request gate: HeadScanner, examine, BodyReader, in pieces and at once.
// Input:   one byte that says how the rest is cut, then what a client sends.
// Promise checked: how bytes arrive changes nothing; what passes has one framing, one Host, a clean target, a body within its bound; what
//                  is refused has a status and says why; bytes behind a body stay where they are.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include "server/http/body_reader.hpp"
#include "server/http/gate.hpp"

namespace {

using namespace colony::server::http;

void require(bool holds) {
  if (!holds) std::abort();
}

const GatePolicy& policy() {
  static const GatePolicy one = {{"127.0.0.1", "localhost", "[::1]"}, 8080, 2048, 20, 512, 1000, "/v1/analyses", 4000};
  return one;
}

void check_refusal(const Refusal& refusal) {
  require(refusal.status >= 400 && refusal.status < 600 && !refusal.code.empty() && !refusal.title.empty());
}

struct Scan {
  HeadScanner::State state = HeadScanner::State::kNeedMore;
  std::size_t head_size = 0;
  int refused = 0;
  friend bool operator==(const Scan&, const Scan&) = default;
};

Scan scan(std::string_view bytes, std::size_t step) {
  HeadScanner scanner;
  Scan result;
  for (std::size_t size = 0; result.state == HeadScanner::State::kNeedMore && size < bytes.size();) {
    size = std::min(bytes.size(), size + step);
    result.state = scanner.scan(bytes.substr(0, size), policy());
  }
  if (result.state == HeadScanner::State::kComplete) result.head_size = scanner.head_size();
  if (result.state == HeadScanner::State::kRefused) {
    check_refusal(scanner.refusal());
    result.refused = scanner.refusal().status;
  }
  return result;
}

void check_head(const RequestHead& head) {
  require(!(head.content_length && head.chunked));
  require(head.headers.count("Host") == 1 && head.headers.count("Content-Length") <= 1);
  require(head.headers.count("Transfer-Encoding") == (head.chunked ? 1 : 0));
  require(!head.content_length || *head.content_length <= head.body_bytes_max);
  require(!head.method.empty() && (head.target.path.starts_with('/') || (head.target.path == "*" && head.method == "OPTIONS")));
  require(head.version_minor == 0 || head.version_minor == 1);
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  require(std::none_of(head.target.path.begin(), head.target.path.end(), is_control));
  for (const char* dots : {"/./", "/../"}) require((head.target.path + "/").find(dots) == std::string::npos);
  for (const auto& [name, value] : head.headers.all()) {
    require(!name.empty() && name.find_first_of(" \t:\r\n") == std::string::npos);
    require(value.find_first_of("\r\n") == std::string::npos && value.find('\0') == std::string::npos);
  }
  require(std::none_of(head.request_id.begin(), head.request_id.end(), is_control));
}

struct Body {
  BodyReader::State state = BodyReader::State::kNeedMore;
  std::string body, rest;
  friend bool operator==(const Body&, const Body&) = default;
};

Body read_body(const RequestHead& head, std::string_view bytes, std::size_t step) {
  BodyReader reader(head, head.body_bytes_max);
  Body result;
  std::size_t given = 0;
  result.state = reader.feed(result.rest);
  while (result.state == BodyReader::State::kNeedMore && given < bytes.size()) {
    const std::string_view piece = bytes.substr(given, step);
    given += piece.size();
    result.rest += piece;
    result.state = reader.feed(result.rest);
  }
  if (result.state == BodyReader::State::kComplete) {
    result.body = reader.take_body();
    result.rest += bytes.substr(given);
    require(result.body.size() <= head.body_bytes_max);
    require(!head.content_length || result.body.size() == *head.content_length);
    require(bytes.ends_with(result.rest));
  } else {
    result.rest.clear();
  }
  // Which of several faults is told depends on which byte came last.
  if (result.state == BodyReader::State::kRefused) check_refusal(reader.refusal());
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t step = 1 + data[0] % 64;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Scan whole = scan(bytes, bytes.size());
  require(whole == scan(bytes, step));
  if (whole.state != HeadScanner::State::kComplete) return 0;
  require(whole.head_size <= bytes.size());
  RequestHead head;
  if (const auto refusal = examine(bytes.substr(0, whole.head_size), policy(), head)) {
    check_refusal(*refusal);
    return 0;
  }
  check_head(head);
  const std::string_view rest = bytes.substr(whole.head_size);
  // All at once, in equal pieces, byte by byte: one reading.
  const Body body = read_body(head, rest, std::max<std::size_t>(1, rest.size()));
  require(body == read_body(head, rest, step));
  require(body == read_body(head, rest, 1));
  return 0;
}
