#include "server/http/gate.hpp"

#include <algorithm>

#include "server/http/text.hpp"

namespace colony::server::http {
namespace {

constexpr std::size_t kRequestIdBytesMax = 64;
constexpr std::size_t kContentLengthDigitsMax = 18;  // fits 64 bits without a check for overflow
constexpr std::string_view kMethods[] = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};

Refusal bad_request(std::string detail) { return {400, "bad-request", "The request is malformed", std::move(detail)}; }

Refusal header_too_large(std::string detail) {
  return {431, "header-too-large", "The header is too large", std::move(detail)};
}

Refusal target_too_long(std::size_t limit) {
  return {414, "target-too-long", "The request target is too long",
          "the request target may have at most " + std::to_string(limit) + " bytes"};
}

using Check = std::optional<Refusal>;

Check read_version(std::string_view version, RequestHead& head) {
  const bool is_version = version.size() == 8 && version.substr(0, 5) == "HTTP/" && is_digit(version[5]) &&
                          version[6] == '.' && is_digit(version[7]);
  if (!is_version) return bad_request("the request line must end in HTTP/1.1 or HTTP/1.0");
  if (version[5] != '1' || version[7] > '1') {
    return Refusal{505, "version-not-supported", "The HTTP version is not supported",
                   "this server speaks HTTP/1.1 and HTTP/1.0"};
  }
  head.version_minor = version[7] - '0';
  return std::nullopt;
}

// Leaves the target in `target`; it is parsed later, when the fields have given the request its id.
Check read_request_line(std::string_view line, RequestHead& head, std::string_view& target) {
  const auto first = line.find(' ');
  const auto last = line.rfind(' ');
  if (first == std::string_view::npos || first == last)
    return bad_request("the request line needs a method, a target and a version");
  const auto method = line.substr(0, first);
  target = line.substr(first + 1, last - first - 1);
  if (!is_token(method)) return bad_request("the method is not a token");
  if (target.empty() || target.find_first_of(" \t") != std::string_view::npos) {
    return bad_request("the request line must hold exactly two single spaces");
  }
  head.method = method;
  return read_version(line.substr(last + 1), head);
}

Check read_field(std::string_view line, const GatePolicy& policy, RequestHead& head) {
  if (line.front() == ' ' || line.front() == '\t') return bad_request("a header field is folded over two lines");
  const auto colon = line.find(':');
  if (colon == std::string_view::npos) return bad_request("a header line has no colon");
  const auto name = line.substr(0, colon);
  if (!is_token(name))
    return bad_request("a header field name is empty or holds a character that is not allowed, such as a blank");
  if (head.headers.all().size() >= policy.header_fields_max) {
    return header_too_large("the header may have at most " + std::to_string(policy.header_fields_max) + " fields");
  }
  head.headers.add(name, trim_blanks(line.substr(colon + 1)));
  return std::nullopt;
}

void read_request_id(RequestHead& head) {
  const auto id = head.headers.get("X-Request-Id");
  if (!id || id->empty() || id->size() > kRequestIdBytesMax || head.headers.count("X-Request-Id") > 1) return;
  const auto allowed = [](char c) { return is_alpha(c) || is_digit(c) || c == '.' || c == '_' || c == '-'; };
  if (std::all_of(id->begin(), id->end(), allowed)) head.request_id = *id;
}

Check read_framing(RequestHead& head) {
  for (const char* name : {"Content-Length", "Transfer-Encoding", "Host"}) {
    if (head.headers.count(name) > 1) return bad_request(std::string("the header holds more than one ") + name);
  }
  const auto length = head.headers.get("Content-Length");
  const auto coding = head.headers.get("Transfer-Encoding");
  if (length && coding) return bad_request("the header holds both Content-Length and Transfer-Encoding");
  if (coding) {
    if (head.version_minor == 0) return bad_request("HTTP/1.0 has no Transfer-Encoding");
    if (*coding != "chunked") return bad_request("the only Transfer-Encoding accepted is chunked");
    head.chunked = true;
  }
  if (length) {
    if (length->empty() || length->size() > kContentLengthDigitsMax ||
        !std::all_of(length->begin(), length->end(), is_digit)) {
      return bad_request("Content-Length must be one decimal number of at most " +
                         std::to_string(kContentLengthDigitsMax) + " digits");
    }
    std::uint64_t value = 0;
    for (const char c : *length) value = value * 10 + static_cast<std::uint64_t>(c - '0');
    head.content_length = value;
  }
  return std::nullopt;
}

void read_connection(RequestHead& head) {
  bool close = false;
  bool keep_alive = false;
  for (const auto& [name, value] : head.headers.all()) {
    if (!equals_without_case(name, "Connection")) continue;
    close = close || list_holds(value, "close");
    keep_alive = keep_alive || list_holds(value, "keep-alive");
  }
  head.keep_alive = !close && (head.version_minor == 1 || keep_alive);
}

bool is_allowed(const Authority& authority, const GatePolicy& policy) {
  return std::find(policy.allowed_hosts.begin(), policy.allowed_hosts.end(), authority.host) !=
         policy.allowed_hosts.end();
}

// A page may call us only if it was served by us: its origin is the very authority this request went to (which may be
// the near end of a tunnel, with another port), or one of our hosts with our own port. Another server on this machine
// is foreign.
bool is_own_origin(std::string_view origin, const Authority& host, const GatePolicy& policy) {
  std::uint16_t default_port = 80;
  if (origin.substr(0, 7) == "http://") {
    origin.remove_prefix(7);
  } else if (origin.substr(0, 8) == "https://") {
    origin.remove_prefix(8);
    default_port = 443;
  } else {
    return false;
  }
  const auto authority = parse_authority(origin);
  if (!authority || !is_allowed(*authority, policy)) return false;
  const std::uint16_t port = authority->port.value_or(default_port);
  return port == policy.port || (authority->host == host.host && port == host.port.value_or(default_port));
}

Check read_addressee(std::string_view target, const GatePolicy& policy, RequestHead& head) {
  const auto host_text = head.headers.get("Host");
  if (!host_text) return bad_request("the header holds no Host");
  const auto host = parse_authority(*host_text);
  if (!host) return bad_request("Host must be a host name or address, with or without a port");

  if (target.size() > policy.target_bytes_max) return target_too_long(policy.target_bytes_max);
  if (target == kServerTarget && head.method == "OPTIONS") {
    head.target.path = kServerTarget;
  } else {
    auto parsed = parse_target(target);
    if (!parsed) return bad_request(parsed.error().message);
    head.target = std::move(*parsed);
    if (head.target.is_bare && head.method == "OPTIONS") head.target.path = kServerTarget;  // RFC 9112, 3.2.4
  }
  if (head.target.authority) {
    if (!is_allowed(*head.target.authority, policy))
      return bad_request("the request target names a host that is not served here");
    if (*head.target.authority != *host) return bad_request("the request target and Host name different hosts");
  }

  if (!is_allowed(*host, policy)) {
    return Refusal{
        421, "misdirected-request", "The request was sent to the wrong server",
        "Host names a host that is not served here; allowed_hosts of the configuration lists those that are"};
  }
  for (const auto& [name, value] : head.headers.all()) {
    if (!equals_without_case(name, "Origin") || is_own_origin(value, *host, policy)) continue;
    const bool is_listed =
        std::find(policy.cors_origins.begin(), policy.cors_origins.end(), value) != policy.cors_origins.end();
    if (is_listed && head.headers.count("Origin") == 1) {
      head.cors_origin = value;
    } else {
      return Refusal{403, "foreign-origin", "The request comes from another site's page",
                     "Origin is not an address of this server, so the request is not carried out"};
    }
  }
  return std::nullopt;
}

Check read_expectation(const GatePolicy& policy, RequestHead& head) {
  head.body_bytes_max = policy.body_bytes_max;
  if (head.method == "POST" && !policy.large_body_path.empty() && head.target.path == policy.large_body_path) {
    head.body_bytes_max = std::max(policy.body_bytes_max, policy.large_body_bytes_max);
  }
  if (head.content_length.value_or(0) > head.body_bytes_max) {
    return Refusal{413, "body-too-large", "The body is too large",
                   "the body may have at most " + std::to_string(head.body_bytes_max) + " bytes"};
  }
  head.may_be_large = head.body_bytes_max > policy.body_bytes_max &&
                      (head.chunked || head.content_length.value_or(0) > policy.body_bytes_max);
  for (const auto& [name, value] : head.headers.all()) {
    if (!equals_without_case(name, "Expect") || head.version_minor == 0) continue;  // HTTP/1.0 knows no Expect
    if (!equals_without_case(value, "100-continue")) {
      return Refusal{417, "expectation-failed", "The expectation cannot be met",
                     "the only Expect accepted is 100-continue"};
    }
    head.expects_continue = head.chunked || head.content_length.value_or(0) > 0;
  }
  return std::nullopt;
}

Check read_method(const RequestHead& head) {
  if (std::find(std::begin(kMethods), std::end(kMethods), head.method) != std::end(kMethods)) return std::nullopt;
  return Refusal{501, "method-not-implemented", "The method is not implemented",
                 "this server knows GET, HEAD, POST, PUT, PATCH, DELETE and OPTIONS"};
}

}  // namespace

HeadScanner::State HeadScanner::refuse(Refusal refusal) {
  refusal_ = std::move(refusal);
  return State::kRefused;
}

HeadScanner::State HeadScanner::scan(std::string_view bytes, const GatePolicy& policy) {
  const std::size_t end = std::min(bytes.size(), policy.header_bytes_max);
  while (position_ < end) {
    const char c = bytes[position_];
    if (c == '\r') {
      if (position_ + 1 == end) break;
      if (bytes[position_ + 1] != '\n') return refuse(bad_request("the header holds a CR without LF"));
      const bool line_is_empty = position_ == line_begin_;
      position_ += 2;
      if (line_is_empty) {
        return first_line_ended_ ? State::kComplete : refuse(bad_request("the request line is empty"));
      }
      first_line_ended_ = true;
      line_begin_ = position_;
      continue;
    }
    if (c == '\n') return refuse(bad_request("the header holds an LF without CR"));
    if (is_control(c) && c != '\t') return refuse(bad_request("the header holds a control character"));
    ++position_;
  }
  if (bytes.size() < policy.header_bytes_max) return State::kNeedMore;
  // Without the end of its first line what is too long is the target (or a method that nobody knows).
  if (!first_line_ended_) return refuse(target_too_long(policy.target_bytes_max));
  return refuse(header_too_large("the header may have at most " + std::to_string(policy.header_bytes_max) + " bytes"));
}

std::optional<Refusal> examine(std::string_view bytes, const GatePolicy& policy, RequestHead& head) {
  std::string_view target;
  bool is_first = true;
  while (bytes.substr(0, 2) != "\r\n") {
    const auto line = bytes.substr(0, bytes.find("\r\n"));
    if (line.size() == bytes.size()) return bad_request("the header has no end");
    bytes.remove_prefix(line.size() + 2);
    auto refusal = is_first ? read_request_line(line, head, target) : read_field(line, policy, head);
    if (refusal) return refusal;
    is_first = false;
  }
  if (is_first) return bad_request("the request line is empty");
  read_request_id(head);
  if (auto refusal = read_framing(head)) return refusal;
  read_connection(head);
  if (auto refusal = read_addressee(target, policy, head)) return refusal;
  if (auto refusal = read_method(head)) return refusal;
  return read_expectation(policy, head);
}

}  // namespace colony::server::http
