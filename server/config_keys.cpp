#include "server/config_keys.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include <arpa/inet.h>

namespace colony::server {
namespace {

using Key = ConfigKey;
using Type = ConfigKey::Type;

std::optional<std::uint64_t> to_integer(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t at = 0;
  for (std::size_t comma = text.find(','); comma != std::string::npos; comma = text.find(',', at)) {
    parts.push_back(text.substr(at, comma - at));
    at = comma + 1;
  }
  parts.push_back(text.substr(at));
  return parts;
}

std::string set_listen(Config& config, const std::string& value) {
  const std::size_t colon = value.rfind(':');
  const auto port = colon == std::string::npos ? std::nullopt : to_integer(std::string_view(value).substr(colon + 1));
  if (!port || *port > 65535) return "must be ADDRESS:PORT, e.g. 127.0.0.1:8080 (port 0: any free one)";
  std::string host = value.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  if (host == "localhost") host = "127.0.0.1";
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET, host.c_str(), bytes.data()) != 1 && inet_pton(AF_INET6, host.c_str(), bytes.data()) != 1) {
    return "'" + host + "' is not an IP address";
  }
  config.http.address = host;
  config.http.port = static_cast<std::uint16_t>(*port);
  return {};
}

std::string set_data(Config& config, const std::string& value) {
  if (value.empty()) return "must not be empty";
  config.store.data_dir = value;
  return {};
}

std::string set_hosts(Config& config, const std::string& value) {
  std::vector<std::string> hosts = split(value);
  if (std::find(hosts.begin(), hosts.end(), "") != hosts.end()) return "must be one or more host names without port";
  config.http.allowed_hosts = std::move(hosts);
  return {};
}

std::string set_flag(bool& flag, const std::string& value) {
  if (value != "true" && value != "false") return "must be true or false";
  flag = value == "true";
  return {};
}

std::string set_cors_origins(Config& config, const std::string& value) {
  std::vector<std::string> origins = split(value);
  for (const std::string& origin : origins) {
    const std::size_t host = origin.starts_with("https://") ? 8 : origin.starts_with("http://") ? 7 : 0;
    const bool is_plain = std::all_of(origin.begin(), origin.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || std::string_view(".-:/[]").find(c) != std::string_view::npos;
    });
    if (host == 0 || host == origin.size() || !is_plain || origin.find('/', host) != std::string::npos) {
      return "'" + origin + "' is not an origin as browsers send it: https://host or https://host:port, lower case, "
             "no path, no '*'";
    }
  }
  config.http.cors_origins = std::move(origins);
  return {};
}

std::string set_auth_mode(Config& config, const std::string& value) {
  if (value != "local" && value != "required") {
    return "must be local (every user of this machine may do everything) or required (tokens)";
  }
  config.http.tokens_required = value == "required";
  return {};
}

std::string set_log_format(Config& config, const std::string& value) {
  if (value != "text" && value != "json") return "must be text or json";
  config.log_format = value == "json" ? LogFormat::kJson : LogFormat::kText;
  return {};
}

std::string set_base_path(Config& config, const std::string& value) {
  // Only what needs no escape in a URL: the same text then stands in the address, in Location and in openapi.json.
  const bool right = std::all_of(value.begin(), value.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.' || c == '/';
  });
  const bool has_empty_segment = value.find("//") != std::string::npos || value.ends_with('/');
  const bool has_dots =
      (value + "/").find("/./") != std::string::npos || (value + "/").find("/../") != std::string::npos;
  if (!value.empty() && (!right || value.front() != '/' || has_empty_segment || has_dots)) {
    return "must be empty or like /colony: segments of a-z, A-Z, 0-9, '-', '_' and '.', no '/' at the end";
  }
  config.http.base_path = value;
  return {};
}

template <class T>
Key integer_key(std::string name, std::uint64_t min, std::uint64_t max, std::string text, T& (*field)(Config&)) {
  auto set = [min, max, field](Config& config, const std::string& value) -> std::string {
    const auto integer = to_integer(value);
    if (!integer || *integer < min || *integer > max) {
      return "must be an integer within " + std::to_string(min) + " to " + std::to_string(max);
    }
    field(config) = static_cast<T>(*integer);
    return {};
  };
  return {std::move(name), Type::kInteger, std::move(text), std::move(set)};
}

Key flag_key(std::string name, std::string text, bool& (*field)(Config&)) {
  auto set = [field](Config& config, const std::string& value) { return set_flag(field(config), value); };
  return {std::move(name), Type::kBoolean, std::move(text), std::move(set)};
}

Key path_key(std::string name, std::string text, std::string& (*field)(Config&)) {
  auto set = [field](Config& config, const std::string& value) -> std::string {
    if (value.empty()) return "must not be empty";
    field(config) = value;
    return {};
  };
  return {std::move(name), Type::kText, std::move(text), std::move(set)};
}

Key timeout_key(std::string name, std::string text, std::int64_t& (*field)(Config&)) {
  return integer_key<std::int64_t>(std::move(name), 10, 3'600'000, std::move(text), field);
}

}  // namespace

const std::vector<ConfigKey>& config_keys() {
  using Size = std::size_t;
  using Big = std::uint64_t;
  static const std::vector<Key> table = {
      {"server.listen", Type::kText,
       "address and port; default 127.0.0.1:8080; other than loopback needs tokens, and TLS or a proxy that does it",
       set_listen},
      {"server.data", Type::kText,
       "folder of all files; default $XDG_DATA_HOME/colony or ~/.local/share/colony", set_data},
      {"server.base_path", Type::kText,
       "where a proxy shows this server, e.g. /colony; every path must begin with it; default none", set_base_path},
      {"server.allowed_hosts", Type::kTexts, "host names a request may be for, without port", set_hosts},
      {"server.cors_origins", Type::kTexts, "other sites whose pages may ask, e.g. https://lab.example; default none",
       set_cors_origins},
      flag_key("server.behind_proxy", "a proxy in front does TLS; default false",
               [](Config& c) -> bool& { return c.http.behind_proxy; }),
      flag_key("server.trust_forwarded_for",
               "the proxy appends the client's address to X-Forwarded-For: count and log by it; default false",
               [](Config& c) -> bool& { return c.http.trusts_forwarded_for; }),
      {"auth.mode", Type::kText, "local: every user of this machine may do everything (default); required: tokens",
       set_auth_mode},
      path_key("tls.certificate", "PEM file of the certificate and its chain",
               [](Config& c) -> std::string& { return c.http.tls_certificate; }),
      path_key("tls.key", "PEM file of its key, without a passphrase",
               [](Config& c) -> std::string& { return c.http.tls_key; }),
      {"log.format", Type::kText, "text or json, a line each on standard error; default text", set_log_format},
      integer_key<Size>("jobs.concurrent_max", 1, kThreadsMax,
                        "colonies growing at a time; default: as many as the cores hold with threads_per_job each",
                        [](Config& c) -> Size& { return c.jobs.concurrent_max; }),
      integer_key<int>(
          "jobs.threads_per_job", 1, kThreadsMax,
          "threads a colony may decide on; default: the cores a job has with concurrent_max of them, or up "
          "to 4 if that is not given either",
          [](Config& c) -> int& { return c.jobs.threads_per_job; }),
      integer_key<Size>("jobs.queued_max", 1, 1'000'000, "jobs waiting; default 1000",
                        [](Config& c) -> Size& { return c.jobs.queued_max; }),
      integer_key<Big>("jobs.events_per_s_max", 0, 1'000'000,
                       "events a second of a job; it waits rather than be faster; 0 (default): as fast as it decides",
                       [](Config& c) -> Big& { return c.jobs.events_per_s_max; }),
      integer_key<Big>("jobs.keep_days", 0, 36'500, "days an ended job is kept; default 0: for ever (label keep=true: always)",
                       [](Config& c) -> Big& { return c.jobs.retention.keep_days; }),
      integer_key<Big>("jobs.keep_bytes", 0, 1'000'000'000'000'000,
                       "stored bytes of ended jobs (those with keep=true not counted), beyond which the oldest go; default 0: no bound",
                       [](Config& c) -> Big& { return c.jobs.retention.keep_bytes; }),
      integer_key<Big>("limits.cells_max", 1, 4'294'967'295, "cells of a job; default 1000000",
                       [](Config& c) -> Big& { return c.jobs.cells_max; }),
      integer_key<Big>("limits.events_max", 1, 1'000'000'000'000, "events of a job; default 50000000",
                       [](Config& c) -> Big& { return c.jobs.events_max; }),
      integer_key<Big>("limits.cached_cells_max", 1, 1'000'000'000,
                       "cells of all folded colonies kept; default 2000000",
                       [](Config& c) -> Big& { return c.jobs.cached_cells_max; }),
      integer_key<Size>("limits.cached_colonies_max", 1, 10'000,
                        "folded colonies kept for pictures and tables; default 16",
                        [](Config& c) -> Size& { return c.jobs.cached_colonies_max; }),
      integer_key<Size>("limits.header_bytes_max", 1024, 1'048'576, "header of a request; default 8192",
                        [](Config& c) -> Size& { return c.http.header_bytes_max; }),
      integer_key<Size>("limits.body_bytes_max", 1024, 1'073'741'824, "body of a request; default 1048576",
                        [](Config& c) -> Size& { return c.http.body_bytes_max; }),
      integer_key<Size>("limits.image_bytes_max", 1024, 1'073'741'824, "body with a picture; default 33554432",
                        [](Config& c) -> Size& { return c.http.large_body_bytes_max; }),
      integer_key<Big>("limits.stored_image_bytes_max", 0, 1'000'000'000'000'000,
                       "pictures of all analyses together; default 4 x 10^9",
                       [](Config& c) -> Big& { return c.stored_image_bytes_max; }),
      integer_key<Size>("limits.analyses_waiting_max", 1, 100'000, "analyses not done yet; default 100",
                        [](Config& c) -> Size& { return c.analyses_waiting_max; }),
      integer_key<Size>("limits.connections_max", 1, 100'000, "open connections; default 2000",
                        [](Config& c) -> Size& { return c.http.connections_max; }),
      integer_key<Size>("limits.connections_per_address_max", 1, 100'000, "of them from one address; default 200",
                        [](Config& c) -> Size& { return c.http.connections_per_address_max; }),
      integer_key<double>("limits.requests_per_s", 0, 1'000'000,
                          "requests of a token, or of an address without one, in the long run; default 200; 0: no limit",
                          [](Config& c) -> double& { return c.http.requests_per_s; }),
      integer_key<double>("limits.requests_burst", 1, 1'000'000, "so many at once; default 1000",
                          [](Config& c) -> double& { return c.http.requests_burst; }),
      integer_key<double>("limits.failed_tokens_per_min", 0, 1'000'000,
                          "wrong tokens of an address; default 30; 0: no limit",
                          [](Config& c) -> double& { return c.http.failed_tokens_per_min; }),
      flag_key("limits.count_loopback",
               "limit connections, and requests without a token, of this machine's own addresses, too; default false",
               [](Config& c) -> bool& { return c.http.limits_loopback; }),
      timeout_key("limits.handshake_timeout_ms", "of TLS; default 10000",
                  [](Config& c) -> std::int64_t& { return c.http.handshake_timeout_ms; }),
      timeout_key("limits.header_timeout_ms", "from its first byte to its last; default 10000",
                  [](Config& c) -> std::int64_t& { return c.http.header_timeout_ms; }),
      timeout_key("limits.body_timeout_ms", "likewise; default 30000",
                  [](Config& c) -> std::int64_t& { return c.http.body_timeout_ms; }),
      timeout_key("limits.idle_timeout_ms", "between two requests; default 60000",
                  [](Config& c) -> std::int64_t& { return c.http.idle_timeout_ms; }),
      timeout_key("limits.write_timeout_ms", "a reader that takes nothing; default 30000",
                  [](Config& c) -> std::int64_t& { return c.http.write_timeout_ms; }),
      integer_key<Size>("limits.requests_waiting_max", 1, 100'000, "requests waiting for a worker; default 256",
                        [](Config& c) -> Size& { return c.http.requests_waiting_max; }),
      integer_key<Big>("limits.disk_free_bytes_min", 0, 1'000'000'000'000'000,
                       "free disk below which /readyz refuses; default 10^8",
                       [](Config& c) -> Big& { return c.disk_free_bytes_min; }),
      integer_key<Big>("limits.database_bytes_max", 0, 1'000'000'000'000'000,
                       "size of the database, beyond which jobs pause; default 0: as much as the disk holds",
                       [](Config& c) -> Big& { return c.store.database_bytes_max; }),
      integer_key<Big>("limits.free_bytes_min", 0, 1'000'000'000'000'000,
                       "free disk with which jobs that the disk paused go on; default 16777216",
                       [](Config& c) -> Big& { return c.jobs.free_bytes_min; }),
  };
  return table;
}

bool is_loopback(const std::string& host) {
  if (host == "::1") return true;
  if (!host.starts_with("127.")) return false;
  int dots = 0;
  std::string octet;
  for (const char c : host + ".") {
    if (c != '.') {
      octet += c;
      continue;
    }
    const auto value = to_integer(octet);
    if (octet.size() > 3 || !value || *value > 255) return false;
    octet.clear();
    ++dots;
  }
  return dots == 4;
}

std::optional<double> to_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

}  // namespace colony::server
