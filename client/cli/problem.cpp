#include "client/cli/problem.hpp"

namespace colony::client {
namespace {

std::string text_member(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? printable(found->get<std::string>()) : std::string();
}

}  // namespace

std::string problem_text(const HttpResponse& response, const std::string& body_name) {
  const Json body = Json::parse(response.body, nullptr, false);
  std::string out;
  if (body.is_object() && body.contains("title")) {
    out = text_member(body, "title");
    const std::string detail = text_member(body, "detail");
    if (!detail.empty() && detail != out) out += ": " + detail;
    if (const auto errors = body.find("errors"); errors != body.end() && errors->is_array()) {
      for (const Json& error : *errors) {
        if (!error.is_object()) continue;
        std::string field = text_member(error, error.contains("pointer") ? "pointer" : "parameter");
        if (field.empty()) field = body_name;
        out += "\n  " + field + ": " + text_member(error, "message");
      }
    }
  } else {
    out = "HTTP " + std::to_string(response.status) + " from the server";
    if (!response.body.empty()) out += ": " + printable(response.body.substr(0, 200));
  }
  std::string request_id = body.is_object() ? text_member(body, "request_id") : std::string();
  if (request_id.empty() && response.headers.contains("x-request-id")) {
    request_id = printable(response.headers.at("x-request-id"));
  }
  if (!request_id.empty()) out += "\n  request id: " + request_id;
  if (const auto later = response.headers.find("retry-after"); later != response.headers.end()) {
    out += "\n  try again in " + printable(later->second) + " s";
  }
  return out;
}

void require_ok(const HttpResponse& response, const std::string& body_name) {
  if (!response.ok()) throw Failure(ExitCode::kRefused, problem_text(response, body_name));
}

Json body_json(const HttpResponse& response) {
  Json body = Json::parse(response.body, nullptr, false);
  if (body.is_discarded()) {
    throw Failure(ExitCode::kRefused, "the server's answer is not JSON (is this a colony server?): " +
                                          printable(response.body.substr(0, 200)));
  }
  return body;
}

Json get_json(HttpClient& client, const std::string& target) {
  HttpRequest request;
  request.target = target;
  const HttpResponse response = client.send(request);
  require_ok(response);
  return body_json(response);
}

}  // namespace colony::client
