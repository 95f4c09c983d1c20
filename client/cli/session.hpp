// session: what every command shares: the environment, the global options, the connection (made when first used).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/cli/environment.hpp"
#include "client/cli/failure.hpp"
#include "client/cli/http_client.hpp"
#include "client/cli/text.hpp"

namespace colony::client {

struct Session {
  explicit Session(Environment& environment) : env(environment) {}

  Environment& env;
  std::string server_flag;
  std::string ca_file_flag;
  bool json = false;

  HttpClient& client();

  /// Sends again, with growing delays, after a lost connection or a 429 or 503; says so on standard error. The last
  /// answer or failure is the caller's. Only for requests that may be repeated.
  HttpResponse send_patiently(const HttpRequest& request);

 private:
  std::unique_ptr<HttpClient> client_;
};

/// What ids are looked up in.
struct Collection {
  const char* path;     // of its list
  const char* one;      // "job"
  const char* command;  // that lists it
  bool has_pages = true;
  bool is_quoted = true;  // whether errors repeat what was given for an id: where it may be a secret, nothing may keep it
};
inline constexpr Collection kJobs{"/v1/jobs", "job", "list"};
inline constexpr Collection kAnalyses{"/v1/analyses", "analysis", "analyses"};
inline constexpr Collection kComparisons{"/v1/comparisons", "comparison", "comparisons"};
inline constexpr Collection kTokens{"/v1/tokens", "token", "tokens list", false, false};

/// The full id for a full id (not looked up) or for the unique end of one, found in the server's list.
/// Errors: kUsage for what cannot be an id or is ambiguous (the candidates are named), kRefused when none ends so.
std::string resolve_id(Session& session, const std::string& text, const Collection& in);
std::string resolve_job_id(Session& session, const std::string& text);

/// A link of an answer as a target of this client: links begin with the server's base path, and so does --server.
/// Failure kRefused if it leads elsewhere.
std::string link_target(Session& session, const Json& row, const char* name);

/// "/v1/jobs/<id>" plus `rest`.
Target job_target(const std::string& id, const std::string& rest = {});

}  // namespace colony::client
