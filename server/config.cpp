#include "server/config.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>

#include <CLI/CLI.hpp>
#include <toml++/toml.h>

#include "server/config_keys.hpp"

namespace colony::server {
namespace {

using Key = ConfigKey;
using KeyType = ConfigKey::Type;

const Key* find_key(std::string_view name) {
  for (const Key& key : config_keys()) {
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
  if (key.type == KeyType::kBoolean && node.is_boolean()) return node.as_boolean()->get() ? "true" : "false";
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
      constexpr const char* kTypes[] = {"must be a string", "must be an integer", "must be a list of strings",
                                        "must be true or false"};
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
                                       "COLONY_TLS_",    "COLONY_LOG_"};
  for (const auto& [name, value] : environment) {
    const auto key =
        std::find_if(config_keys().begin(), config_keys().end(), [&](const Key& one) { return variable_of(one) == name; });
    if (key != config_keys().end()) {
      apply(*key, value, name, config, errors);
    } else if (std::any_of(std::begin(kPrefixes), std::end(kPrefixes),
                           [&](const char* p) { return name.starts_with(p); })) {
      errors.push_back({name, "unknown key"});
    }
  }
}

// What no key alone can tell.
void check_together(const Config& config, Errors& errors) {
  const http::ServerConfig& http = config.http;
  const bool has_tls = !http.tls_certificate.empty();
  if (has_tls != !http.tls_key.empty()) {
    errors.push_back({has_tls ? "tls.key" : "tls.certificate", "is needed: certificate and key go together"});
  }
  if (http.trusts_forwarded_for && !http.behind_proxy) {
    errors.push_back({"server.trust_forwarded_for",
                      "needs server.behind_proxy: without a proxy anybody can write X-Forwarded-For"});
  }
  if (is_loopback(http.address)) return;
  if (!http.tokens_required) {
    errors.push_back({"server.listen", "'" + http.address +
                                           "' is not a loopback address (127.0.0.1, [::1]): everybody who reaches the "
                                           "port could do everything. Set auth.mode = \"required\" and make a token "
                                           "(colonyd token create)"});
  }
  if (!has_tls && !http.behind_proxy) {
    errors.push_back({"server.listen", "'" + http.address +
                                           "' is not a loopback address, and tokens would travel in the clear: set "
                                           "tls.certificate and tls.key, or server.behind_proxy = true if a proxy in "
                                           "front does TLS"});
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
  for (const Key& key : config_keys()) {
    std::string flags = flag_of(key);
    if (key.name == "server.listen") flags += ",--listen";
    if (key.name == "server.data") flags += ",--data";
    app.add_option_function<std::string>(
           flags, [&given, name = key.name](const std::string& value) { given[name].push_back(value); },
           key.text + " [" + variable_of(key) + "]")
        ->type_name(key.type == KeyType::kInteger ? "N" : key.type == KeyType::kBoolean ? "true|false" : "TEXT");
  }
  app.set_version_flag("--version", std::string(version));
  Invocation invocation;
  // `colonyd token create`; the flags of the server, --data above all, may stand anywhere.
  TokenRequest token;
  std::string expires_h;
  CLI::App* const token_app = app.add_subcommand("token", "tokens, while the server is stopped")->fallthrough();
  token_app->require_subcommand(1);
  CLI::App* const create_app =
      token_app->add_subcommand("create", "make a token and print its secret, this once")->fallthrough();
  create_app->add_option("--name", token.name, "of whom it stands for")->required();
  create_app->add_option("--scope", token.scope, "read, submit or admin")->required();
  create_app->add_option("--expires-h", expires_h, "hours from now, 0.001 to 87600")->required();
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
  if (create_app->parsed()) {
    const auto hours = to_number(expires_h);
    if (!hours) errors.push_back({"--expires-h", "must be a number"});
    token.expires_h = hours.value_or(0.0);
    invocation.token = token;
  }
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
  if (errors.empty()) check_together(config, errors);
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "the configuration is wrong", std::move(errors)};
  share_cores(cores, config.jobs);
  return invocation;
}

}  // namespace colony::server
