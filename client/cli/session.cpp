#include "client/cli/session.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "client/cli/problem.hpp"
#include "client/cli/settings.hpp"

namespace colony::client {
namespace {

constexpr std::size_t kIdLength = 36;
constexpr std::size_t kSuffixMin = 4;
constexpr int kPageLimit = 500;
constexpr int kPagesMax = 10'000;

bool is_full_id(const std::string& text) {
  if (text.size() != kIdLength) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    if (dash != (text[i] == '-')) return false;
  }
  return true;
}

std::optional<std::chrono::milliseconds> retry_after(const HttpResponse& response) {
  const auto found = response.headers.find("retry-after");
  if (found == response.headers.end()) return std::nullopt;
  const auto seconds = to_integer(found->second);
  if (!seconds || *seconds < 0) return std::nullopt;
  return std::chrono::milliseconds(std::min<std::int64_t>(*seconds, 86'400) * 1000);
}

}  // namespace

HttpClient& Session::client() {
  if (!client_) client_ = std::make_unique<HttpClient>(read_settings(env, server_flag, ca_file_flag), env.interrupt);
  return *client_;
}

HttpResponse Session::send_patiently(const HttpRequest& request) {
  for (int attempt = 1;; ++attempt) {
    const bool last = attempt >= env.retry.attempts_max;
    std::chrono::milliseconds delay = retry_delay(env.retry, attempt - 1);
    std::string why;
    try {
      HttpResponse response = client().send(request);
      const bool busy = response.status == 429 || response.status == 503;
      if (!busy || last) return response;
      if (const auto asked = retry_after(response)) delay = std::max(delay, *asked);
      // Longer than the longest delay of ours is a decision for a person, who sees "try again in ... s".
      if (delay > env.retry.max) return response;
      why = "the server is busy (HTTP " + std::to_string(response.status) + ")";
    } catch (const NotReachable& failure) {
      if (!failure.transient() || last) throw;
      why = failure.what();
    }
    env.err << "note: " << why << "; trying again in " << fixed(static_cast<double>(delay.count()) / 1000.0, 1)
            << " s (" << attempt + 1 << " of " << env.retry.attempts_max << ")" << std::endl;
    env.interrupt.wait(delay);
    if (env.interrupt.raised()) throw Failure(ExitCode::kInterrupted, "interrupted");
  }
}

std::string link_target(Session& session, const Json& row, const char* name) {
  const std::string link = row.at("links").at(name).get<std::string>();
  if (!link.starts_with('/') || link.starts_with("//")) throw Failure(ExitCode::kRefused, "the server gives a link that leads elsewhere: " + printable(link));
  const std::string& server = session.client().server();
  const std::size_t path = server.find('/', server.find("://") + 3);
  const std::string base = path == std::string::npos ? "" : server.substr(path);
  return !base.empty() && link.starts_with(base + "/") ? link.substr(base.size()) : link;
}

Target job_target(const std::string& id, const std::string& rest) { return Target("/v1/jobs/" + id + rest); }

std::string resolve_job_id(Session& session, const std::string& text) { return resolve_id(session, text, kJobs); }

std::string resolve_id(Session& session, const std::string& text, const Collection& in) {
  const std::string one = in.one;
  const std::string given = in.is_quoted ? "'" + printable(text) + "'" : "what was given";
  std::string wanted = text;
  std::transform(wanted.begin(), wanted.end(), wanted.begin(), [](unsigned char c) { return std::tolower(c); });
  const bool plausible =
      wanted.find_first_not_of("0123456789abcdef-") == std::string::npos && wanted.size() <= kIdLength;
  if (!plausible || wanted.size() < kSuffixMin) {
    throw Failure(ExitCode::kUsage, given + " is no " + one + " id: give a full id or at least its last " +
                                        std::to_string(kSuffixMin) + " characters (`colony " + in.command + "` shows them)");
  }
  if (is_full_id(wanted)) return wanted;

  std::vector<std::string> matches;
  std::optional<std::string> cursor;
  for (int page = 0; page < kPagesMax; ++page) {
    Target target(in.path);
    if (in.has_pages) target.add("limit", std::to_string(kPageLimit)).add_if("cursor", cursor);
    const Json body = get_json(session.client(), target.text());
    const auto items = body.is_object() ? body.find("items") : body.end();
    if (items == body.end() || !items->is_array())
      throw Failure(ExitCode::kRefused, std::string("the server's list at ") + in.path + " has no items");
    for (const Json& item : *items) {
      const std::string id =
          item.is_object() && item.contains("id") && item["id"].is_string() ? item["id"].get<std::string>() : "";
      if (id.ends_with(wanted)) matches.push_back(id);
    }
    const auto next = body.find("next");
    if (next == body.end() || !next->is_string()) break;
    cursor = next->get<std::string>();
  }
  if (matches.empty()) throw Failure(ExitCode::kRefused, "no " + one + "'s id ends in " + given);
  if (matches.size() > 1) {
    std::string message =
        given + " is the end of " + std::to_string(matches.size()) + " " + one + " ids; give more of it:";
    for (std::size_t i = 0; i < std::min<std::size_t>(matches.size(), 5); ++i)
      message += "\n  " + printable(matches[i]);
    if (matches.size() > 5) message += "\n  ...";
    throw Failure(ExitCode::kUsage, message);
  }
  if (!is_full_id(matches[0])) throw Failure(ExitCode::kRefused, "the server lists a " + one + " whose id is no UUID");
  return matches[0];
}

}  // namespace colony::client
