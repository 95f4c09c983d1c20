#include "server/http/target.hpp"

#include <algorithm>

#include "server/http/text.hpp"

namespace colony::server::http {
namespace {

Error malformed(std::string message) { return Error{ErrorCode::kMalformed, std::move(message)}; }

bool is_path_char(char c) {
  return is_alpha(c) || is_digit(c) || std::string_view("-._~!$&'()*+,;=:@/%").find(c) != std::string_view::npos;
}

// Wider than RFC 3986: browsers leave these brackets and bars unescaped in a query, and nothing here gives
// them a meaning.
bool is_query_char(char c) {
  return is_path_char(c) || std::string_view("?[]{}|^`\\").find(c) != std::string_view::npos;
}

bool has_dot_segment(std::string_view path) {
  while (!path.empty()) {
    path.remove_prefix(1);  // the slash
    const auto segment = path.substr(0, path.find('/'));
    if (segment == "." || segment == "..") return true;
    path.remove_prefix(segment.size());
  }
  return false;
}

Result<std::string> decode_path(std::string_view text) {
  if (!std::all_of(text.begin(), text.end(), is_path_char)) {
    return malformed("the path holds a character that must be percent-escaped");
  }
  auto path = percent_decode(text, false);
  if (!path) return malformed("the path holds an invalid percent escape");
  if (std::any_of(path->begin(), path->end(), is_control))
    return malformed("the path holds an escaped control character");
  if (std::count(path->begin(), path->end(), '/') != std::count(text.begin(), text.end(), '/')) {
    return malformed("the path holds an escaped '/'");
  }
  if (!is_utf8(*path)) return malformed("the path is not UTF-8");
  if (has_dot_segment(*path)) return malformed("the path holds a '.' or '..' segment");
  return std::move(*path);
}

Result<Ok> decode_query(std::string_view text, std::vector<std::pair<std::string, std::string>>& query) {
  if (!std::all_of(text.begin(), text.end(), is_query_char)) {
    return malformed("the query holds a character that must be percent-escaped");
  }
  while (!text.empty()) {
    const auto item = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(text.size(), item.size() + 1));
    if (item.empty()) continue;
    const auto equals = item.find('=');
    auto name = percent_decode(item.substr(0, equals), true);
    auto value = percent_decode(equals == std::string_view::npos ? std::string_view() : item.substr(equals + 1), true);
    if (!name || !value) return malformed("the query holds an invalid percent escape");
    if (name->find('\0') != std::string::npos || value->find('\0') != std::string::npos) {
      return malformed("the query holds %00");
    }
    if (!is_utf8(*name) || !is_utf8(*value)) return malformed("the query is not UTF-8");
    query.emplace_back(std::move(*name), std::move(*value));
  }
  return Ok{};
}

bool is_host_name(std::string_view host) {
  return !host.empty() && std::all_of(host.begin(), host.end(), [](char c) {
    return is_alpha(c) || is_digit(c) || c == '.' || c == '-' || c == '_';
  });
}

bool is_ipv6_literal(std::string_view host) {
  return host.size() > 4 && host.front() == '[' && host.back() == ']' &&
         std::all_of(host.begin() + 1, host.end() - 1,
                     [](char c) { return hex_value(c) >= 0 || c == ':' || c == '.'; });
}

}  // namespace

std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+' && plus_is_space) {
      decoded += ' ';
    } else if (text[i] != '%') {
      decoded += text[i];
    } else {
      if (text.size() - i < 3) return std::nullopt;
      const int high = hex_value(text[i + 1]);
      const int low = hex_value(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      decoded += static_cast<char>(high * 16 + low);
      i += 2;
    }
  }
  return decoded;
}

std::optional<Authority> parse_authority(std::string_view text) {
  Authority authority;
  // The last colon outside brackets begins the port; "[::1]" alone has none.
  const auto bracket = text.rfind(']');
  const auto colon = text.find(':', bracket == std::string_view::npos ? 0 : bracket);
  const auto host = text.substr(0, colon);
  if (!is_host_name(host) && !is_ipv6_literal(host)) return std::nullopt;
  if (colon != std::string_view::npos) {
    const auto digits = text.substr(colon + 1);
    if (digits.empty() || digits.size() > 5 || !std::all_of(digits.begin(), digits.end(), is_digit))
      return std::nullopt;
    unsigned port = 0;
    for (const char c : digits) port = port * 10 + static_cast<unsigned>(c - '0');
    if (port > 65535) return std::nullopt;
    authority.port = static_cast<std::uint16_t>(port);
  }
  std::transform(host.begin(), host.end(), std::back_inserter(authority.host), to_lower);
  return authority;
}

Result<Target> parse_target(std::string_view text) {
  Target target;
  if (text.empty() || text.front() != '/') {
    constexpr std::string_view kScheme = "http://";
    if (!equals_without_case(text.substr(0, kScheme.size()), kScheme)) {
      return malformed("the request target must be a path that starts with '/', or an http:// address");
    }
    text.remove_prefix(kScheme.size());
    const auto authority = text.substr(0, text.find_first_of("/?"));
    target.authority = parse_authority(authority);
    if (!target.authority) return malformed("the request target names no valid host");
    text.remove_prefix(authority.size());
    target.is_bare = text.empty();
  }
  const auto question = text.find('?');
  auto path = decode_path(text.empty() || question == 0 ? std::string_view("/") : text.substr(0, question));
  if (!path) return path.error();
  target.path = std::move(*path);
  if (question != std::string_view::npos) {
    const auto query = decode_query(text.substr(question + 1), target.query);
    if (!query) return query.error();
  }
  return target;
}

}  // namespace colony::server::http
