// http_client: one request, one answer, over libcurl. Nothing of curl is visible here.
// Promise: an answer is complete or an exception; no redirects are followed (a token goes to the named server only);
//          loopback servers are never asked through a proxy; Ctrl-C ends a wait at once.
// Errors:  NotReachable; Failure kInterrupted; whatever a sink throws. HTTP statuses are not errors here (problem.hpp).
// Threads: one at a time.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/environment.hpp"
#include "client/cli/settings.hpp"

namespace colony::client {

/// A path with query, percent-encoded as it grows. add_if leaves out what is not set.
class Target {
 public:
  explicit Target(std::string path) : text_(std::move(path)) {}
  Target& add(std::string_view name, std::string_view value);
  Target& add_if(std::string_view name, const std::optional<std::string>& value);
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct HttpRequest {
  std::string method = "GET";
  std::string target = {};  // starts with '/'
  std::string accept = "application/json";
  std::vector<std::pair<std::string, std::string>> headers = {};  // besides Accept, Authorization and the body's
  std::optional<std::string> body = std::nullopt;
  std::string body_type = "application/json";
};

struct HttpResponse {
  int status = 0;
  std::map<std::string, std::string> headers;  // names in lower case; the last of equal names
  std::string body;                            // empty if a sink took it
  bool ok() const { return status >= 200 && status < 300; }
};

class HttpClient {
 public:
  using Sink = std::function<void(std::string_view)>;

  HttpClient(Settings settings, Interrupt& interrupt);
  ~HttpClient();

  /// The whole answer in memory, at most kBodyBytesMax.
  HttpResponse send(const HttpRequest& request);

  /// The body of a 2xx answer goes to `sink` piece by piece; any other answer comes back in memory. `silence_max`: give
  /// up when the server sends nothing for so long.
  HttpResponse receive(const HttpRequest& request, const Sink& sink, std::chrono::seconds silence_max = kSilenceMax);

  const std::string& server() const { return settings_.server; }

  static constexpr std::size_t kBodyBytesMax = 256u << 20;
  static constexpr std::chrono::seconds kSilenceMax{300};  // a fold of a large colony comes before the first byte

 private:
  class Transfer;
  const Settings settings_;
  Interrupt& interrupt_;
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace colony::client
