#include "client/cli/sse.hpp"

#include "client/cli/failure.hpp"
#include "client/cli/text.hpp"

namespace colony::client {

void SseParser::feed(std::string_view bytes, const Handler& handle) {
  for (const char c : bytes) {
    const bool second_of_crlf = after_cr_ && c == '\n';
    after_cr_ = c == '\r';
    if (second_of_crlf) continue;
    if (c != '\r' && c != '\n') {
      if (line_.size() + data_.size() >= kEventBytesMax) {
        throw Failure(ExitCode::kRefused, "the server's event stream holds an event of more than 64 MiB");
      }
      line_ += c;
      continue;
    }
    std::string_view line = line_;
    if (at_start_ && line.substr(0, 3) == "\xEF\xBB\xBF") line.remove_prefix(3);
    at_start_ = false;
    take_line(line, handle);
    line_.clear();
  }
}

void SseParser::reconnect() {
  line_.clear();
  after_cr_ = false;
  at_start_ = true;
  name_.clear();
  data_.clear();
  has_data_ = false;
  id_ = last_id_;
}

void SseParser::take_line(std::string_view line, const Handler& handle) {
  if (line.empty()) {
    // The id counts from here on even when the event carries no data.
    last_id_ = id_;
    if (has_data_) {
      SseEvent event;
      if (!name_.empty()) event.name = name_;
      event.data = data_;
      name_.clear();
      data_.clear();
      has_data_ = false;
      handle(event);
    }
    name_.clear();
    return;
  }
  if (line.front() == ':') return;
  const std::size_t colon = line.find(':');
  const std::string_view field = line.substr(0, colon);
  std::string_view value = colon == std::string_view::npos ? std::string_view() : line.substr(colon + 1);
  if (!value.empty() && value.front() == ' ') value.remove_prefix(1);
  if (field == "event") {
    name_ = value;
  } else if (field == "data") {
    if (has_data_) data_ += '\n';
    data_ += value;
    has_data_ = true;
  } else if (field == "id") {
    if (value.find('\0') == std::string_view::npos) id_ = value;
  } else if (field == "retry") {
    const bool digits = !value.empty() && value.find_first_not_of("0123456789") == std::string_view::npos;
    if (const auto delay_ms = to_integer(value); digits && delay_ms) retry_ = std::chrono::milliseconds(*delay_ms);
  }
}

}  // namespace colony::client
