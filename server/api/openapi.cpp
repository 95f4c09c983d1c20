#include "server/api/openapi.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "server/api/examples.hpp"
#include "server/api/openapi_headers.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {
namespace {

Json problem_answer(const Endpoint& endpoint, int status, std::string_view description) {
  return {{"description", description},
          {"headers", problem_headers(endpoint, status)},
          {"content", {{"application/problem+json", {{"schema", reference("Problem")}}}}}};
}

Json bound(double value) { return value == std::floor(value) ? Json(static_cast<std::int64_t>(value)) : Json(value); }

Json query_schema(const QueryParam& param) {
  switch (param.type) {
    case QueryType::kInteger:
    case QueryType::kNumber:
      return {{"type", param.type == QueryType::kInteger ? "integer" : "number"},
              {"minimum", bound(param.min)},
              {"maximum", bound(param.max)}};
    case QueryType::kBoolean:
      return {{"type", "boolean"}};
    case QueryType::kName:
      return {{"type", "string"}, {"enum", param.names}};
    case QueryType::kNames:
      return {{"type", "array"}, {"items", {{"type", "string"}, {"enum", param.names}}}};
    case QueryType::kText:
      return {{"type", "string"}};
  }
  return Json::object();
}

constexpr std::string_view kStreamText =
    "As `text/event-stream`: server-sent events. `EventSource` can read them only where no token is required, as it sends no `Authorization`, "
    "and no token is taken from an address or a cookie; where tokens are required the stream is read with `fetch` and a ReadableStream. "
    "`/docs` has such a reader, which takes a stream up again by `Last-Event-ID`.";

std::string path_parameter_text(const std::string& name) {
  if (name == "step") return "name of a step of the analysis, as its result lists them";
  return "id, a UUIDv7 in lower case";
}

Json parameters_of(const Endpoint& endpoint) {
  Json parameters = Json::array();
  if (endpoint.path.find("{job_id}") != std::string_view::npos)
    parameters.push_back({{"$ref", "#/components/parameters/job_id"}});
  for (std::size_t open = endpoint.path.find('{'); open != std::string_view::npos;
       open = endpoint.path.find('{', open + 1)) {
    const std::string name(endpoint.path.substr(open + 1, endpoint.path.find('}', open) - open - 1));
    if (name == "job_id") continue;
    parameters.push_back({{"name", name},
                          {"in", "path"},
                          {"required", true},
                          {"description", path_parameter_text(name)},
                          {"schema", {{"type", "string"}}}});
  }
  for (const QueryParam& param : endpoint.query) {
    Json one = {{"name", param.name}, {"in", "query"}, {"description", param.text}, {"schema", query_schema(param)}};
    if (param.type == QueryType::kNames) {
      one["style"] = "form";
      one["explode"] = false;
    } else if (param.repeatable) {
      one["schema"] = {{"type", "array"}, {"items", query_schema(param)}};
      one["style"] = "form";
      one["explode"] = true;
    }
    if (Json example = parameter_example(param); !example.is_null()) one["example"] = std::move(example);
    parameters.push_back(std::move(one));
  }
  add_header_parameters(endpoint, parameters);
  return parameters;
}

// The schema of an answer in one media type. NDJSON is described by the schema of one line.
Json media_schema(const Endpoint& endpoint, std::string_view media) {
  if (media == "application/x-ndjson") return reference(endpoint.schema);
  if (media == "application/json" || media == "application/schema+json") {
    if (endpoint.operation_id == "listEvents") return reference("EventList");
    if (endpoint.operation_id == "listCells") return reference("CellList");
    if (endpoint.schema.empty()) return {{"type", "object"}};
    return reference(endpoint.schema);
  }
  if (media.starts_with("image/") || media.starts_with("model/")) {
    return {{"type", "string"}, {"contentMediaType", media}};
  }
  return {{"type", "string"}};
}

Json success_answer(const Endpoint& endpoint, int status, std::string_view description) {
  Json answer = {{"description", description}};
  if (status != 204) {
    for (const std::string_view media : endpoint.media) {
      answer["content"][std::string(media)] = {{"schema", media_schema(endpoint, media)}};
    }
  }
  answer["headers"] = answer_headers(endpoint, status);
  return answer;
}

// What the request gate and the checks before a handler can answer to any request.
const std::map<int, std::string_view>& common_problems() {
  static const std::map<int, std::string_view> table = {{400, "the request cannot be read"},
                                                        {401, "no token, or none that is known and valid; see WWW-Authenticate"},
                                                        {403, "a foreign Origin, or a token whose scope does not allow this"},
                                                        {404, "there is no such thing"},
                                                        {405, "a method that the path does not have; see Allow"},
                                                        {408, "the request came too slowly"},
                                                        {413, "the body is too large"},
                                                        {414, "the target is too long"},
                                                        {421, "a Host that is not ours"},
                                                        {422, "fields or parameters are wrong"},
                                                        {429, "too many requests; see Retry-After"},
                                                        {431, "the header is too large"},
                                                        {500, "a bug in the server"},
                                                        {501, "a method or coding that is not implemented"},
                                                        {503, "not ready or too busy; see Retry-After"},
                                                        {505, "another HTTP version"}};
  return table;
}

Json responses_of(const Endpoint& endpoint) {
  std::map<int, std::string> problems;
  for (const auto& [status, text] : common_problems()) problems[status] = text;
  if (!endpoint.media.empty()) problems[406] = problem_row(ProblemKind::kNotAcceptable).title;
  for (const ProblemKind kind : endpoint.problems) {
    std::string& text = problems[problem_row(kind).status];
    const std::string code(problem_row(kind).code);
    text += (text.empty() ? "" : "; ") + code;
  }
  if (endpoint.method != "GET" && compared_by(endpoint) != Compared::kNothing) {
    problems[412] = problem_row(ProblemKind::kPreconditionFailed).title;
  }
  Json responses = Json::object();
  for (const auto& [status, description] : endpoint.answers) {
    responses[std::to_string(status)] = success_answer(endpoint, status, description);
  }
  if (endpoint.validator != Validator::kNone) {
    problems[412] = problem_row(ProblemKind::kPreconditionFailed).title;
    responses["304"] = {{"description", "the answer is as If-None-Match supposes"}, {"headers", answer_headers(endpoint, 304)}};
  }
  for (const auto& [status, text] : problems) responses[std::to_string(status)] = problem_answer(endpoint, status, text);
  responses["default"] = problem_answer(endpoint, 0, "any other problem");
  return responses;
}

// Of a bearer scheme the roles that are needed are listed (OpenAPI 3.1, 4.8.30): the scope. A server without tokens asks for none.
Json security_of(const Endpoint& endpoint) {
  constexpr std::array<const char*, 4> kScopes = {"", "read", "submit", "admin"};
  const http::Access access = access_of(endpoint);
  if (access == http::Access::kOpen) return Json::array();
  return Json::array({{{"token", Json::array({kScopes[static_cast<std::size_t>(access)]})}}});
}

Json request_body_of(const Endpoint& endpoint) {
  if (endpoint.operation_id == "submitJob") {
    return {{"required", true}, {"content", {{"application/json", {{"schema", reference("JobSpec")}}}}}};
  }
  if (endpoint.operation_id == "forkJob") {
    return {{"required", true}, {"content", {{"application/json", {{"schema", reference("ForkSpec")}}}}}};
  }
  if (endpoint.operation_id == "editJob") {
    return {{"required", true}, {"content", {{"application/merge-patch+json", {{"schema", reference("JobPatch")}}}}}};
  }
  if (endpoint.operation_id == "compare") {
    return {{"required", true}, {"content", {{"application/json", {{"schema", reference("ComparisonSpec")}}}}}};
  }
  if (endpoint.operation_id == "createToken") {
    return {{"required", true}, {"content", {{"application/json", {{"schema", reference("NewToken")}}}}}};
  }
  if (!endpoint.body_media.empty()) {
    Json content = Json::object();
    for (const std::string_view media : endpoint.body_media) {
      content[std::string(media)] = {{"schema", {{"type", "string"}, {"contentMediaType", media}}}};
    }
    return {{"required", true}, {"content", std::move(content)}};
  }
  return {{"description", "empty, or an empty object"},
          {"content", {{"application/json", {{"schema", {{"type", "object"}, {"maxProperties", 0}}}}}}}};
}

}  // namespace

Json openapi_document(std::span<const Endpoint> table, const SpecLimits& limits, std::string_view version,
                      std::string_view base_path) {
  Json paths = Json::object();
  for (const Endpoint& endpoint : table) {
    std::string method(endpoint.method);
    std::transform(method.begin(), method.end(), method.begin(),
                   [](char c) { return static_cast<char>(c - 'A' + 'a'); });
    Json operation = {
        {"operationId", endpoint.operation_id}, {"tags", Json::array({tag_of(endpoint)})},
        {"summary", endpoint.summary}, {"parameters", parameters_of(endpoint)}};
    if (std::find(endpoint.media.begin(), endpoint.media.end(), "text/event-stream") != endpoint.media.end()) {
      operation["description"] = kStreamText;
    }
    if (endpoint.method != "GET" && compared_by(endpoint) == Compared::kNothing) {
      operation["description"] = "Takes no preconditions: with If-Match or If-None-Match it is refused (400) and nothing is done.";
    }
    if (endpoint.method == "POST" || endpoint.method == "PATCH") operation["requestBody"] = request_body_of(endpoint);
    if (const Json examples = request_examples(endpoint.operation_id); !examples.is_null()) {
      for (auto& [media, content] : operation["requestBody"]["content"].items()) content["examples"] = examples;
    }
    operation["security"] = security_of(endpoint);
    operation["responses"] = responses_of(endpoint);
    paths[std::string(endpoint.path)][method] = std::move(operation);
  }
  Json schemas = component_schemas(limits);
  add_component_examples(schemas);
  return {{"openapi", "3.1.0"},
          {"info",
           {{"title", "Colony"},
            {"version", version},
            {"summary", "Grow cell colonies as jobs; watch, fetch and measure them"},
            {"description",
             "Units are in names: _h, _um, _um2, _um3, _rad; wall times _at, RFC 3339 UTC. Errors are problem "
             "documents (RFC 9457) that name every wrong field at once."}}},
          {"jsonSchemaDialect", "https://json-schema.org/draft/2020-12/schema"},
          {"servers", Json::array({{{"url", base_path.empty() ? "/" : base_path}}})},
          {"tags", tag_list()},
          {"paths", std::move(paths)},
          {"components",
           {{"securitySchemes",
             {{"token",
               {{"type", "http"},
                {"scheme", "bearer"},
                {"description",
                 "A token with scope read, submit or admin, each including those before it. A server that listens to its own "
                 "machine alone may be set to need none (auth.mode = \"local\")."}}}}},
            {"parameters",
             {{"job_id",
               {{"name", "job_id"},
                {"in", "path"},
                {"required", true},
                {"description", "id of the job, a UUIDv7 in lower case"},
                {"example", kExampleId},
                {"schema", {{"type", "string"}}}}}}},
            {"schemas", std::move(schemas)}}}};
}

}  // namespace colony::server::api
