// sse_fuzz: the ids by which a stream is taken up again: as the client reads them from a stream, and as the server reads them from a request.
// Input:   one byte that says how the rest is cut, then bytes of a stream; the same bytes as the text of `after` and Last-Event-ID.
// Promise checked: how bytes arrive changes nothing; an id can stand in a header; what a reconnect needs outlives a cut; a number is read only if it is
//                  written as one.
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/failure.hpp"
#include "client/cli/sse.hpp"
#include "server/api/query.hpp"

namespace {

using namespace colony;

void require(bool holds) {
  if (!holds) std::abort();
}

struct Reading {
  std::vector<std::pair<std::string, std::string>> events;
  std::string last_id;
  std::optional<std::chrono::milliseconds> retry;
  friend bool operator==(const Reading&, const Reading&) = default;
};

Reading read(std::string_view bytes, std::size_t step) {
  client::SseParser parser;
  Reading reading;
  for (std::size_t at = 0; at < bytes.size(); at += step) {
    parser.feed(bytes.substr(at, step),
                [&](const client::SseEvent& event) { reading.events.emplace_back(event.name, event.data); });
  }
  reading.last_id = parser.last_id();
  reading.retry = parser.retry();
  // What was cut is forgotten; the id is not.
  parser.reconnect();
  require(parser.last_id() == reading.last_id);
  parser.feed("\n\n", [](const client::SseEvent&) { std::abort(); });
  require(parser.last_id() == reading.last_id);
  return reading;
}

/// The definition, the slow way: digits alone, and within 64 bits.
std::optional<std::uint64_t> number_of(std::string_view text) {
  if (text.empty()) return std::nullopt;
  std::uint64_t value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    const auto digit = static_cast<std::uint64_t>(c - '0');
    constexpr std::uint64_t kMax = std::numeric_limits<std::uint64_t>::max();
    if (value > kMax / 10 || value * 10 > kMax - digit) return std::nullopt;
    value = value * 10 + digit;
  }
  return value;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t step = 1 + data[0] % 16;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Reading whole = read(bytes, std::max<std::size_t>(1, bytes.size()));
  require(whole == read(bytes, step));
  require(whole.last_id.find_first_of("\r\n") == std::string::npos && whole.last_id.find('\0') == std::string::npos);
  require(!whole.retry || whole.retry->count() >= 0);
  for (const std::string_view text : {bytes, std::string_view(whole.last_id)}) {
    require(server::api::parse_integer(text) == number_of(text));
  }
  return 0;
}
