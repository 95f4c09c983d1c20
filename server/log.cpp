#include "server/log.hpp"

#include <nlohmann/json.hpp>

#include "server/http/tokens.hpp"

namespace colony::server {
namespace {

using Json = nlohmann::ordered_json;

// Bytes that are not UTF-8 (only ever an echo of bad input) become U+FFFD.
LogLine json_line(std::string_view level, const Json& line) {
  return {std::string(level), line.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

// A line of text stays one line, and a terminal is not told anything by a stranger.
std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f) {
      out += c;
    } else {
      out += {'\\', 'x', "0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 15]};
    }
  }
  return out;
}

std::string safe(std::string_view text) { return http::without_tokens(text); }

}  // namespace

LogLine log_event(LogFormat format, std::string_view time, std::string_view level, std::string_view message) {
  if (format == LogFormat::kText) return {std::string(level), plain(safe(message))};
  return json_line(level, {{"time", time}, {"level", level}, {"event", "message"}, {"message", safe(message)}});
}

// Whatever a client has chosen is searched for secrets: it may have put one in the wrong place.
LogLine log_access(LogFormat format, std::string_view time, const http::AccessRecord& record) {
  if (format == LogFormat::kText) {
    const std::string text = record.method + " " + record.path + " " + std::to_string(record.status) + (record.peer_left ? " peer left " : " ") +
                             std::to_string(record.duration_us) + " us " + std::to_string(record.body_bytes) + " B " +
                             (record.actor.empty() ? "-" : record.actor) + " " + record.remote + " [" + record.request_id + "]";
    return {"info", plain(safe(text))};
  }
  const auto text_or_null = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(safe(text)); };
  Json line = {{"time", time},
               {"level", "info"},
               {"event", "request"},
               {"request_id", safe(record.request_id)},
               {"remote", record.remote},
               {"method", safe(record.method)},
               {"path", safe(record.path)},
               {"status", record.status},
               {"duration_us", record.duration_us},
               {"bytes", record.body_bytes},
               {"actor", text_or_null(record.actor)},
               {"token_id", text_or_null(record.token_id)}};
  if (record.peer_left) line["peer_left"] = true;
  return json_line("info", line);
}

LogLine log_failure(LogFormat format, std::string_view time, const http::Request& request, std::string_view what) {
  if (format == LogFormat::kText) {
    const std::string text = request.method + " " + request.path + " [" + request.request_id + "]: " + std::string(what);
    return {"error", plain(safe(text))};
  }
  return json_line("error", {{"time", time},
                             {"level", "error"},
                             {"event", "failure"},
                             {"request_id", safe(request.request_id)},
                             {"method", safe(request.method)},
                             {"path", safe(request.path)},
                             {"message", safe(what)},
                             {"actor", safe(request.principal.name)}});
}

}  // namespace colony::server
