#include "client/cli/settings.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <sstream>

#include <curl/curl.h>
#include <toml++/toml.h>

#include "client/cli/failure.hpp"

namespace colony::client {
namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& message) {
  throw Failure(ExitCode::kUsage, where + ": " + message);
}

std::string url_part(CURLU* url, CURLUPart part) {
  char* text = nullptr;
  if (curl_url_get(url, part, &text, 0) != CURLUE_OK) return {};
  const std::unique_ptr<char, void (*)(void*)> owner(text, curl_free);
  return text;
}

std::string checked_server(std::string server, const std::string& where) {
  while (!server.empty() && server.back() == '/') server.pop_back();
  if (server.find("://") == std::string::npos) refuse(where, "'" + server + "' has no scheme; write http://" + server);
  const std::unique_ptr<CURLU, void (*)(CURLU*)> url(curl_url(), curl_url_cleanup);
  if (curl_url_set(url.get(), CURLUPART_URL, server.c_str(), CURLU_NON_SUPPORT_SCHEME) != CURLUE_OK) {
    refuse(where, "'" + server + "' is not a URL");
  }
  const std::string scheme = url_part(url.get(), CURLUPART_SCHEME);
  if (scheme != "http" && scheme != "https") refuse(where, "the scheme must be http or https, not '" + scheme + "'");
  for (const CURLUPart part : {CURLUPART_QUERY, CURLUPART_FRAGMENT, CURLUPART_USER, CURLUPART_PASSWORD}) {
    if (!url_part(url.get(), part).empty())
      refuse(where, "'" + server + "' must be scheme, host, port and base path only");
  }
  return server;
}

std::string checked_token(std::string token, const std::string& where) {
  const bool plain = std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < '\x7f'; });
  if (!plain) refuse(where, "a token holds neither spaces nor control characters");  // it would break the header apart
  return token;
}

std::string checked_ca_file(const std::string& path, const std::string& where) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) refuse(where, "there is no file '" + path + "'");
  return path;
}

void read_file(const std::filesystem::path& path, Settings& settings) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return;
  toml::table table;
  try {
    table = toml::parse_file(path.string());
  } catch (const toml::parse_error& wrong) {
    std::ostringstream where;
    where << path.string() << ":" << wrong.source().begin.line;
    refuse(where.str(), std::string(wrong.description()));
  }
  for (const auto& [key, value] : table) {
    const std::string where = path.string() + ": " + std::string(key.str());
    const auto text = value.value<std::string>();
    if (key.str() != "server" && key.str() != "token" && key.str() != "ca_file") {
      refuse(where, "unknown key; known are server, token and ca_file");
    }
    if (!value.is_string() || !text) refuse(where, "must be a string");
    if (key.str() == "server") {
      settings.server = checked_server(*text, where);
    } else if (key.str() == "ca_file") {
      settings.ca_file = checked_ca_file(*text, where);
    } else {
      settings.token = checked_token(*text, where);
    }
  }
}

}  // namespace

bool is_loopback(const std::string& server) {
  const std::size_t begin = server.find("://") + 3;
  std::string host = server.substr(begin, server.find_first_of("/?#", begin) - begin);
  if (const auto colon = host.rfind(':'); colon != std::string::npos && host.back() != ']') host.resize(colon);
  if (host == "localhost" || host == "[::1]") return true;
  const bool is_number = host.find_first_not_of("0123456789.") == std::string::npos;
  return is_number && host.starts_with("127.");
}

Settings read_settings(const Environment& env, const std::string& server_flag, const std::string& ca_file_flag) {
  Settings settings;
  const auto config_home = env.variable("XDG_CONFIG_HOME");
  const auto home = env.variable("HOME");
  if (config_home && !config_home->empty()) {
    read_file(std::filesystem::path(*config_home) / "colony" / "config.toml", settings);
  } else if (home && !home->empty()) {
    read_file(std::filesystem::path(*home) / ".config" / "colony" / "config.toml", settings);
  }
  if (const auto server = env.variable("COLONY_SERVER"); server && !server->empty()) {
    settings.server = checked_server(*server, "COLONY_SERVER");
  }
  if (const auto token = env.variable("COLONY_TOKEN"); token && !token->empty()) {
    settings.token = checked_token(*token, "COLONY_TOKEN");
  }
  if (const auto ca_file = env.variable("COLONY_CA_FILE"); ca_file && !ca_file->empty()) {
    settings.ca_file = checked_ca_file(*ca_file, "COLONY_CA_FILE");
  }
  if (!server_flag.empty()) settings.server = checked_server(server_flag, "--server");
  if (!ca_file_flag.empty()) settings.ca_file = checked_ca_file(ca_file_flag, "--ca-file");
  if (!settings.token.empty() && !settings.server.starts_with("https://") && !is_loopback(settings.server)) {
    refuse(settings.server, "a token would travel in the clear; write https://");
  }
  return settings;
}

}  // namespace colony::client
