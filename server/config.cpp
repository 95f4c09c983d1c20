#include "server/config.hpp"

#include <algorithm>
#include <charconv>
#include <functional>
#include <map>
#include <optional>

#include <CLI/CLI.hpp>
#include <toml++/toml.h>

namespace colony::server {
namespace {

constexpr std::uint64_t kThreadsMax = 256;  // of a job, and jobs at a time

enum class KeyType { kText, kInteger, kTexts };

struct Key {
  std::string name;  // "jobs.concurrent_max"
  KeyType type;
  std::uint64_t min, max;  // of kInteger
  std::string text;
  // Takes the value in its text form (kTexts: separated by commas); answers what is wrong with it, or nothing.
  std::function<std::string(Config&, const std::string&)> set;
};

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

std::string set_listen(Config& config, const std::string& value) {
  const std::size_t colon = value.rfind(':');
  const auto port = colon == std::string::npos ? std::nullopt : to_integer(std::string_view(value).substr(colon + 1));
  if (!port || *port > 65535) return "must be ADDRESS:PORT, e.g. 127.0.0.1:8080 (port 0: any free one)";
  std::string host = value.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  if (host == "localhost") host = "127.0.0.1";
  if (!is_loopback(host)) {
    return "'" + host +
           "' is not a loopback address (127.0.0.1, [::1]): any other needs tokens and TLS, which this version "
           "does not have, so everybody who reaches the port could do everything";
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
  return {std::move(name), KeyType::kInteger, min, max, std::move(text), std::move(set)};
}

const std::vector<Key>& keys() {
  using Size = std::size_t;
  using Big = std::uint64_t;
  static const std::vector<Key> table = {
      {"server.listen", KeyType::kText, 0, 0, "loopback address and port; default 127.0.0.1:8080", set_listen},
      {"server.data", KeyType::kText, 0, 0,
       "folder of all files; default $XDG_DATA_HOME/colony or ~/.local/share/colony", set_data},
      {"server.base_path", KeyType::kText, 0, 0,
       "where a proxy shows this server, e.g. /colony; every path must begin with it; default none", set_base_path},
      {"server.allowed_hosts", KeyType::kTexts, 0, 0, "host names a request may be for, without port", set_hosts},
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
                       "stored bytes of all ended jobs, beyond which the oldest go; default 0: no bound",
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

const Key* find_key(std::string_view name) {
  for (const Key& key : keys()) {
    if (key.name == name) return &key;
  }
  return nullptr;
}

std::string flag_of(const Key& key) {
  std::string flag = "--" + key.name;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string variable_of(const Key& key) {
  std::string name = "COLONY_" + key.name;
  for (char& c : name) c = c == '.' ? '_' : static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
  return name;
}

using Errors = std::vector<FieldError>;

void apply(const Key& key, const std::string& value, const std::string& where, Config& config, Errors& errors) {
  if (std::string wrong = key.set(config, value); !wrong.empty()) errors.push_back({where, std::move(wrong)});
}

// The text form of a TOML value of the key's type; nullopt if it has another type.
std::optional<std::string> text_of(const Key& key, const toml::node& node) {
  if (key.type == KeyType::kInteger && node.is_integer()) return std::to_string(node.as_integer()->get());
  if (key.type == KeyType::kText && node.is_string()) return node.as_string()->get();
  if (key.type != KeyType::kTexts || !node.is_array()) return std::nullopt;
  std::string joined;
  for (const toml::node& one : *node.as_array()) {
    if (!one.is_string()) return std::nullopt;
    joined += (joined.empty() ? "" : ",") + one.as_string()->get();
  }
  return joined;
}

void read_table(const toml::table& table, const std::string& prefix, const std::string& path, Config& config,
                Errors& errors) {
  for (const auto& [name, node] : table) {
    const std::string full = prefix + std::string(name.str());
    const std::string where = path + ": " + full;
    if (const Key* key = find_key(full)) {
      const auto value = text_of(*key, node);
      constexpr const char* kTypes[] = {"must be a string", "must be an integer", "must be a list of strings"};
      if (value)
        apply(*key, *value, where, config, errors);
      else
        errors.push_back({where, kTypes[static_cast<int>(key->type)]});
    } else if (const toml::table* inner = node.as_table(); inner != nullptr && prefix.empty()) {
      read_table(*inner, full + ".", path, config, errors);
    } else {
      errors.push_back({where, "unknown key"});
    }
  }
}

void read_file(const std::string& path, Config& config, Errors& errors) {
  try {
    read_table(toml::parse_file(path), "", path, config, errors);
  } catch (const toml::parse_error& error) {
    errors.push_back({path + ":" + std::to_string(error.source().begin.line), std::string(error.description())});
  }
}

void read_environment(const Environment& environment, Config& config, Errors& errors) {
  // Of the variables that begin so, only ours are known; COLONY_SERVER and COLONY_TOKEN belong to the command line.
  constexpr const char* kPrefixes[] = {"COLONY_SERVER_", "COLONY_JOBS_", "COLONY_LIMITS_", "COLONY_AUTH_",
                                       "COLONY_TLS_"};
  for (const auto& [name, value] : environment) {
    const auto key =
        std::find_if(keys().begin(), keys().end(), [&](const Key& one) { return variable_of(one) == name; });
    if (key != keys().end()) {
      apply(*key, value, name, config, errors);
    } else if (std::any_of(std::begin(kPrefixes), std::end(kPrefixes),
                           [&](const char* p) { return name.starts_with(p); })) {
      errors.push_back({name, "unknown key"});
    }
  }
}

// What was not given (0) follows from what was: together the jobs take the cores there are, and no more. Four threads where nothing
// is said: a large colony gains by them, and small ones, which gain little, rather by being grown at the same time.
void share_cores(std::uint64_t cores, JobsConfig& jobs) {
  constexpr std::uint64_t kThreadsUnasked = 4;
  cores = std::clamp<std::uint64_t>(cores, 1, kThreadsMax);
  if (jobs.threads_per_job == 0) {
    const std::uint64_t share =
        jobs.concurrent_max == 0 ? std::min(cores, kThreadsUnasked) : cores / jobs.concurrent_max;
    jobs.threads_per_job = static_cast<int>(std::max<std::uint64_t>(1, share));
  }
  if (jobs.concurrent_max == 0) {
    jobs.concurrent_max = std::max<std::uint64_t>(1, cores / static_cast<std::uint64_t>(jobs.threads_per_job));
  }
}

std::string default_data_dir(const Environment& environment) {
  const auto value = [&](const char* name) {
    const auto found =
        std::find_if(environment.begin(), environment.end(), [&](const auto& one) { return one.first == name; });
    return found == environment.end() ? std::string() : found->second;
  };
  // The XDG rule: a relative path there is to be ignored.
  if (const std::string xdg = value("XDG_DATA_HOME"); xdg.starts_with('/')) return xdg + "/colony";
  if (const std::string home = value("HOME"); !home.empty()) return home + "/.local/share/colony";
  return {};
}

}  // namespace

Result<Invocation> configure(const std::vector<std::string>& arguments, const Environment& environment,
                             std::string_view version, std::uint64_t cores) {
  CLI::App app("colonyd: grows cell colonies as jobs over HTTP", "colonyd");
  std::string config_path;
  std::map<std::string, std::vector<std::string>> given;  // by key
  app.add_option("--config", config_path, "TOML file with the same keys: [jobs] concurrent_max = 2");
  for (const Key& key : keys()) {
    std::string flags = flag_of(key);
    if (key.name == "server.listen") flags += ",--listen";
    if (key.name == "server.data") flags += ",--data";
    app.add_option_function<std::string>(
           flags, [&given, name = key.name](const std::string& value) { given[name].push_back(value); },
           key.text + " [" + variable_of(key) + "]")
        ->type_name(key.type == KeyType::kInteger ? "N" : "TEXT");
  }
  app.set_version_flag("--version", std::string(version));
  Invocation invocation;
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    invocation.print = app.help();
    return invocation;
  } catch (const CLI::CallForVersion&) {
    invocation.print = "colonyd " + std::string(version) + "\n";
    return invocation;
  } catch (const CLI::ParseError& error) {
    return Error{ErrorCode::kInvalid, "the command line is wrong", {{"command line", error.what()}}};
  }

  Errors errors;
  Config& config = invocation.config;
  config.jobs.concurrent_max = 0;  // not given
  config.jobs.threads_per_job = 0;
  if (!config_path.empty()) read_file(config_path, config, errors);
  read_environment(environment, config, errors);
  for (const auto& [name, values] : given) {
    const Key& key = *find_key(name);
    for (const std::string& value : values) apply(key, value, flag_of(key), config, errors);
  }
  if (config.store.data_dir.empty()) config.store.data_dir = default_data_dir(environment);
  if (config.store.data_dir.empty())
    errors.push_back({"--server.data", "is needed: neither XDG_DATA_HOME nor HOME is set"});
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "the configuration is wrong", std::move(errors)};
  share_cores(cores, config.jobs);
  return invocation;
}

}  // namespace colony::server
