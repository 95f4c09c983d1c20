// What is checked before any handler runs, and the object that owns what handlers work with.
#include "server/api/api.hpp"

#include "engine/base/stop.hpp"
#include "server/api/analysis_work.hpp"
#include "server/api/openapi.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {

http::Response run_endpoint(const Endpoint& endpoint, Context& context, const http::Request& request) {
  auto query = Query::parse(request, endpoint.query);
  if (!query) return problem_response(query.error(), request.request_id);
  std::string_view media;
  if (!endpoint.media.empty()) {
    const auto chosen = choose_media(request.headers, endpoint.media);
    if (!chosen) {
      return problem_response(
          ProblemKind::kNotAcceptable,
          {ErrorCode::kInvalid, "offered are " + joined(endpoint.media), {{"Accept", "fits nothing offered"}}},
          request.request_id);
    }
    media = endpoint.media[*chosen];
  }
  // Asked of every POST, with a body or without: a page of another site cannot send this type unasked (CORS).
  const bool takes_json = endpoint.body_media.empty();
  if (endpoint.method == "POST" &&
      !(takes_json ? has_json_body(request.headers) : has_body_of(request.headers, endpoint.body_media))) {
    const std::string wanted = takes_json ? "application/json" : "one of " + joined(endpoint.body_media);
    return problem_response(ProblemKind::kUnsupportedMediaType,
                            {ErrorCode::kInvalid,
                             "this POST must have the Content-Type " + wanted,
                             {{"Content-Type", "must be " + wanted}}},
                            request.request_id);
  }
  try {
    return endpoint.handler(context, Call{request, std::move(*query), media});
  } catch (const Stopped&) {
    return problem_response(
        {ErrorCode::kUnavailable, "the server is ending; the work was given up, nothing was stored"},
        request.request_id);
  }
}

http::Access access_of(const Endpoint& endpoint) {
  return endpoint.access.value_or(endpoint.method == "GET" ? http::Access::kRead : http::Access::kSubmit);
}

Api::Api(JobService& jobs, http::TokenTable& tokens, ApiConfig config) {
  const SpecLimits limits{config.jobs.cells_max};
  context_ = std::unique_ptr<Context>(new Context{jobs, tokens, std::move(config), false, {}, {}});
  context_->schema_text = to_text(job_spec_schema(limits));
  context_->openapi_text =
      to_text(openapi_document(endpoints(), limits, context_->config.version, context_->config.base_path));
}

Api::~Api() { drain(); }

Status Api::start() {
  context_->worker = std::make_unique<AnalysisWorker>(
      context_->jobs.store().analyses(),
      [context = context_.get()](const AnalysisRow& row, StopFlag stop) { return work_on(*context, row, stop); });
  return context_->worker->start();
}

void Api::drain() {
  context_->draining = true;
  if (context_->worker) context_->worker->stop();
}

void Api::add_routes(http::Router& router) {
  for (const Endpoint& endpoint : endpoints()) {
    std::string pattern(endpoint.path);
    for (std::size_t open = pattern.find('{'); open != std::string::npos; open = pattern.find('{', open + 1)) {
      pattern.replace(open, pattern.find('}', open) - open + 1, "{}");
    }
    router.add(std::string(endpoint.method), pattern,
               [&endpoint, context = context_.get()](const http::Request& request) {
                 return run_endpoint(endpoint, *context, request);
               },
               endpoint.is_heavy ? http::Router::Weight::kHeavy : http::Router::Weight::kLight, access_of(endpoint));
  }
}

http::Response failure(const Error& error, const Call& call) {
  return problem_response(error, call.request.request_id);
}

http::Response json_response(int status, const Json& body) {
  http::Response response;
  response.status = status;
  response.headers.set("Content-Type", "application/json");
  response.body = to_text(body);
  return response;
}

}  // namespace colony::server::api
