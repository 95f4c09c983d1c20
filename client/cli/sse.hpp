// sse: reads a stream of server-sent events as its bytes arrive, cut anywhere.
// Source:  WHATWG HTML, section "Server-sent events": CR, LF or CRLF; a byte order mark; comments; many data lines.
// Errors:  Failure kRefused when one event exceeds kEventBytesMax: a stream without ends of lines must not fill the
// memory.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace colony::client {

struct SseEvent {
  std::string name = "message";
  std::string data;
};

class SseParser {
 public:
  using Handler = std::function<void(const SseEvent&)>;
  static constexpr std::size_t kEventBytesMax = 64u << 20;

  void feed(std::string_view bytes, const Handler& handle);

  /// Forgets an event that was cut; keeps what a reconnect needs (last id, retry).
  void reconnect();

  const std::string& last_id() const { return last_id_; }
  std::optional<std::chrono::milliseconds> retry() const { return retry_; }

 private:
  void take_line(std::string_view line, const Handler& handle);

  std::string line_;
  bool after_cr_ = false;
  bool at_start_ = true;
  std::string name_;
  std::string data_;
  bool has_data_ = false;
  std::string id_;
  std::string last_id_;
  std::optional<std::chrono::milliseconds> retry_;
};

}  // namespace colony::client
