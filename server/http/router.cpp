#include "server/http/router.hpp"

#include <algorithm>
#include <exception>

#include "engine/base/check.hpp"
#include "server/http/target.hpp"
#include "server/http/text.hpp"

namespace colony::server::http {
namespace {

constexpr std::string_view kCapture = "{}";

/// "/a/b" -> a, b; "/" -> nothing; "/a/" -> a and an empty segment, which no capture takes.
std::vector<std::string> split(std::string_view path) {
  std::vector<std::string> segments;
  if (path.size() <= 1) return segments;
  for (;;) {
    path.remove_prefix(1);
    segments.emplace_back(path.substr(0, path.find('/')));
    path.remove_prefix(segments.back().size());
    if (path.empty()) return segments;
  }
}

bool matches(const std::vector<std::string>& pattern, const std::vector<std::string>& path) {
  return std::equal(pattern.begin(), pattern.end(), path.begin(), path.end(),
                    [](const auto& expected, const auto& segment) {
                      return expected == kCapture ? !segment.empty() : expected == segment;
                    });
}

/// Of two patterns that match the same path: the one whose first difference is a literal.
bool is_more_specific(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] != b[i]) return b[i] == kCapture;
  }
  return false;
}

std::vector<std::string> captures(const std::vector<std::string>& pattern, const std::vector<std::string>& path) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (pattern[i] == kCapture) out.push_back(path[i]);
  }
  return out;
}

void append_json_string(std::string& out, std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  out += '"';
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const char c = text.front();
    if (length == 0) {
      out += "\\ufffd";  // a stray byte, e.g. of a method that the gate refused
    } else if (c == '"' || c == '\\') {
      out.append("\\").append(1, c);
    } else if (is_control(c)) {
      out.append("\\u00").append(1, kDigits[static_cast<unsigned char>(c) / 16]).append(1, kDigits[c % 16]);
    } else {
      out.append(text.substr(0, length));
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  out += '"';
}

}  // namespace

Response problem(int status, std::string_view code, std::string_view title, std::string_view detail,
                 std::string_view request_id) {
  Response response;
  response.status = status;
  response.headers.set("Content-Type", "application/problem+json");
  std::string& out = response.body;
  out = "{\"type\":";
  append_json_string(out, "urn:colony:problem:" + std::string(code));
  out += ",\"title\":";
  append_json_string(out, title);
  out += ",\"status\":" + std::to_string(status) + ",\"detail\":";
  append_json_string(out, detail);
  out += ",\"request_id\":";
  append_json_string(out, request_id);
  out += "}\n";
  return response;
}

void Router::add(std::string method, std::string pattern, Handler handler, Weight weight, Access access) {
  CHECK(!pattern.empty() && pattern.front() == '/');
  auto segments = split(pattern);
  for (const auto& route : routes_) CHECK(route.method != method || route.segments != segments);
  routes_.push_back({std::move(method), std::move(segments), std::move(handler), weight, access});
}

Router::Destination Router::find(std::string_view method, std::string_view path) const {
  Destination to;
  to.is_server = path == kServerTarget;
  to.path = split(path);
  to.pattern = to.is_server ? nullptr : pattern_of(to.path);
  to.route = to.pattern ? route_of(*to.pattern, method) : nullptr;
  return to;
}

Access Router::access_of(std::string_view method, const Destination& to) {
  if (method == "OPTIONS") return Access::kOpen;
  return to.route ? to.route->access : Access::kRead;
}

bool Router::is_heavy(const Destination& to) { return to.route != nullptr && to.route->weight == Weight::kHeavy; }

void Router::set_ready(std::string_view method, const std::string& pattern, ReadyHandler handler) {
  const auto segments = split(pattern);
  const auto route = std::find_if(routes_.begin(), routes_.end(), [&](const Route& one) {
    return one.method == method && one.segments == segments;
  });
  CHECK(route != routes_.end());
  ready_.emplace_back(static_cast<std::size_t>(route - routes_.begin()), std::move(handler));
}

std::optional<Response> Router::dispatch_ready(Request& request, const Destination& to) const {
  if (!to.route) return std::nullopt;
  const auto ready = std::find_if(ready_.begin(), ready_.end(), [&](const auto& one) { return &routes_[one.first] == to.route; });
  if (ready == ready_.end()) return std::nullopt;
  request.path_params = captures(*to.pattern, to.path);
  try {
    auto response = ready->second(request);
    if (response) report_if_failed(request, *response);
    return response;
  } catch (const std::exception&) {
    return std::nullopt;  // memory, say: a worker tries again and reports
  }
}

void Router::advertise(std::string_view pattern, std::string name, std::string value) {
  adverts_.push_back({split(pattern), std::move(name), std::move(value)});
}

void Router::report_failure(const Request& request, std::string_view what) const {
  if (failure_log_) failure_log_(request, what);
}

void Router::report_if_failed(const Request& request, const Response& response) const {
  if (response.status != 500) return;
  report_failure(request, response.failure.empty() ? "a handler answered 500 and did not say why" : response.failure);
}

// The pattern is chosen before the method: DELETE /v1/jobs/counts must not fall through to the job named "counts".
const std::vector<std::string>* Router::pattern_of(const std::vector<std::string>& path) const {
  const std::vector<std::string>* pattern = nullptr;
  for (const auto& route : routes_) {
    if (matches(route.segments, path) && (!pattern || is_more_specific(route.segments, *pattern)))
      pattern = &route.segments;
  }
  return pattern;
}

const Router::Route* Router::route_of(const std::vector<std::string>& pattern, std::string_view method) const {
  const Route* head = nullptr;
  for (const auto& route : routes_) {
    if (route.segments != pattern) continue;
    if (route.method == method) return &route;
    if (route.method == "GET" && method == "HEAD") head = &route;
  }
  return head;
}

std::string Router::allow_of(const Destination& to) const {
  std::string allow;
  for (const auto& route : routes_) {
    if (!to.is_server && route.segments != *to.pattern) continue;
    for (const std::string_view method : {std::string_view(route.method), std::string_view(route.method == "GET" ? "HEAD" : "")}) {
      if (!method.empty() && !list_holds(allow, method)) allow.append(allow.empty() ? "" : ", ").append(method);
    }
  }
  return allow + (allow.empty() ? "OPTIONS" : ", OPTIONS");
}

Response Router::answer_options(const Destination& to) const {
  Response response;
  response.status = 204;
  for (const auto& advert : adverts_) {
    if (to.pattern && advert.segments == *to.pattern) response.headers.set(advert.name, advert.value);
  }
  response.headers.set("Allow", allow_of(to));
  return response;
}

Response Router::dispatch(Request& request, const Destination& to) const {
  if (!to.route && request.method == "OPTIONS" && (to.pattern || to.is_server)) return answer_options(to);
  if (!to.pattern) {
    return problem(404, "not-found", "There is nothing here", "no resource has the path " + request.path,
                   request.request_id);
  }
  if (!to.route) {
    const std::string allow = allow_of(to);
    Response response = problem(405, "method-not-allowed", "The method is not allowed here",
                                request.path + " does not take " + request.method + ", but " + allow, request.request_id);
    response.headers.set("Allow", allow);
    return response;
  }

  request.path_params = captures(*to.pattern, to.path);
  std::string what = "an exception that is not a std::exception";
  try {
    Response response = to.route->handler(request);
    report_if_failed(request, response);
    return response;
  } catch (const std::exception& error) {
    what = error.what();
  } catch (...) {
  }
  report_failure(request, what);
  return problem(500, "internal", "The server made a mistake", "the server's log has more under this request_id",
                 request.request_id);
}

}  // namespace colony::server::http
