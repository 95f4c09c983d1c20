#include "server/http/wire.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>

#include "server/http/text.hpp"

namespace colony::server::http {
namespace {

// The session alone decides about these; a handler that sets one would break the framing.
constexpr std::string_view kOwnHeaders[] = {"Content-Length", "Transfer-Encoding", "Connection", "Keep-Alive",
                                            "Date",           "X-Request-Id",      "Trailer",    "Upgrade"};

std::string two_digits(int value) {
  const std::string digits = std::to_string(value);
  return digits.size() < 2 ? "0" + digits : digits;
}

// For a page of ours: its own scripts, styles and data, nothing from elsewhere, nothing inline. For everything else, which is no page:
// nothing at all, should a browser take it for one.
constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr std::string_view kDataPolicy = "default-src 'none'; frame-ancestors 'none'";
constexpr std::string_view kExposedHeaders = "Allow, ETag, Link, Location, Preference-Applied, Retry-After, WWW-Authenticate, X-Request-Id";

void add_line(std::string& out, std::string_view name, std::string_view value) {
  out.append(name).append(": ").append(value).append("\r\n");
}

// What a handler has set stands: it may know better.
void add_policies(std::string& out, const Response& response, const WireOptions& options) {
  const auto add = [&](std::string_view name, std::string_view value) {
    if (response.headers.count(name) == 0) add_line(out, name, value);
  };
  const std::string_view type = response.headers.get("Content-Type").value_or("");
  const bool is_page = type.substr(0, 9) == "text/html";
  add("Cache-Control", "no-store");
  add("X-Content-Type-Options", "nosniff");
  add("Content-Security-Policy", is_page ? kPagePolicy : kDataPolicy);
  add("Referrer-Policy", "no-referrer");
  add("Cross-Origin-Resource-Policy", "same-origin");
  if (is_page) add("Cross-Origin-Opener-Policy", "same-origin");
  if (options.is_encrypted) add("Strict-Transport-Security", "max-age=31536000");
  if (options.varies_by_origin) add_line(out, "Vary", "Origin");
  if (!options.cors_origin.empty()) {
    add_line(out, "Access-Control-Allow-Origin", options.cors_origin);
    add_line(out, "Access-Control-Expose-Headers", kExposedHeaders);
  }
}

}  // namespace

std::optional<std::string> fault_of(const Response& response) {
  if (response.status < 200 || response.status > 599) return "a response has status " + std::to_string(response.status);
  if (response.stream && !response.body.empty()) return "a response has both a body and a stream";
  if (!has_body(response.status) && (response.stream || !response.body.empty())) {
    return "a response with status " + std::to_string(response.status) + " has a body";
  }
  for (const auto& [name, value] : response.headers.all()) {
    if (!is_token(name)) return "a response header has a name that is not a token";
    if (std::any_of(value.begin(), value.end(), is_control))
      return "the response header " + name + " holds a control character";
    for (const auto own : kOwnHeaders) {
      if (equals_without_case(name, own)) return "a handler has set the response header " + name;
    }
  }
  return std::nullopt;
}

bool has_body(int status) { return status >= 200 && status != 204 && status != 304; }

std::string write_head(const Response& response, const WireOptions& options) {
  std::string out = "HTTP/1.1 " + std::to_string(response.status) + " ";
  out.append(reason_phrase(response.status)).append("\r\n");
  for (const auto& [name, value] : response.headers.all()) add_line(out, name, value);
  add_policies(out, response, options);
  add_line(out, "X-Request-Id", options.request_id);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  add_line(out, "Date", write_date(std::chrono::duration_cast<std::chrono::seconds>(now).count()));
  if (has_body(response.status)) {
    if (options.framing == Framing::kLength) add_line(out, "Content-Length", std::to_string(response.body.size()));
    if (options.framing == Framing::kChunked) add_line(out, "Transfer-Encoding", "chunked");
  }
  if (!options.keep_alive) {
    add_line(out, "Connection", "close");
  } else if (options.version_minor == 0) {
    add_line(out, "Connection", "keep-alive");
  }
  return out.append("\r\n");
}

std::string write_chunk_size(std::size_t size) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out = "\r\n";
  for (std::size_t rest = size; rest != 0; rest /= 16) out.insert(out.begin(), kDigits[rest % 16]);
  return out;
}

// By hand, because strftime speaks the language of the locale.
std::string write_date(std::int64_t unix_time_s) {
  static constexpr std::array kDays = {"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
  static constexpr std::array kMonths = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                         "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  const std::time_t time = static_cast<std::time_t>(unix_time_s);
  std::tm parts{};
  gmtime_r(&time, &parts);
  return std::string(kDays[static_cast<std::size_t>(parts.tm_wday)]) + ", " + two_digits(parts.tm_mday) + " " +
         kMonths[static_cast<std::size_t>(parts.tm_mon)] + " " + std::to_string(parts.tm_year + 1900) + " " +
         two_digits(parts.tm_hour) + ":" + two_digits(parts.tm_min) + ":" + two_digits(parts.tm_sec) + " GMT";
}

std::string_view reason_phrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 201:
      return "Created";
    case 202:
      return "Accepted";
    case 204:
      return "No Content";
    case 206:
      return "Partial Content";
    case 303:
      return "See Other";
    case 304:
      return "Not Modified";
    case 308:
      return "Permanent Redirect";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 406:
      return "Not Acceptable";
    case 408:
      return "Request Timeout";
    case 409:
      return "Conflict";
    case 410:
      return "Gone";
    case 412:
      return "Precondition Failed";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 417:
      return "Expectation Failed";
    case 421:
      return "Misdirected Request";
    case 422:
      return "Unprocessable Content";
    case 428:
      return "Precondition Required";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    case 507:
      return "Insufficient Storage";
    default:
      return "";  // the phrase is optional; the space before it is not
  }
}

}  // namespace colony::server::http
