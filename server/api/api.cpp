// What is checked before any handler runs, and the object that owns what handlers work with.
#include "server/api/api.hpp"

#include "server/api/analysis_work.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/docs.hpp"
#include "server/api/feed.hpp"
#include "server/api/job_texts.hpp"
#include "server/api/kept.hpp"
#include "server/api/openapi.hpp"
#include "server/api/pages.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {

namespace {

/// Accept-Post, Accept-Patch: what a body may be.
std::string accept_name(const Endpoint& endpoint) { return endpoint.method == "POST" ? "Accept-Post" : "Accept-Patch"; }
std::string body_offer(const Endpoint& endpoint) {
  return endpoint.body_media.empty() ? "application/json" : joined(endpoint.body_media);
}

}  // namespace

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
  if ((endpoint.method == "POST" || endpoint.method == "PATCH") &&
      !(takes_json ? has_json_body(request.headers) : has_body_of(request.headers, endpoint.body_media))) {
    const std::string offered = body_offer(endpoint);
    const std::string wanted = (endpoint.body_media.size() > 1 ? "one of " : "") + offered;
    http::Response response = problem_response(ProblemKind::kUnsupportedMediaType,
                                               {ErrorCode::kInvalid,
                                                "this " + std::string(endpoint.method) + " must have the Content-Type " + wanted,
                                                {{"Content-Type", "must be " + wanted}}},
                                               request.request_id);
    response.headers.set(accept_name(endpoint), offered);
    return response;
  }
  auto if_match = read_tags(request.headers, "If-Match");
  if (!if_match) return problem_response(if_match.error(), request.request_id);
  auto if_none_match = read_tags(request.headers, "If-None-Match");
  if (!if_none_match) return problem_response(if_none_match.error(), request.request_id);
  try {
    const Call call{request, std::move(*query), media, std::move(*if_match), std::move(*if_none_match)};
    if (auto refused = refused_before(endpoint, context, call)) return std::move(*refused);
    http::Response response = endpoint.handler(context, call);
    if (!response.later) apply_conditions(endpoint, call, response);
    return response;
  } catch (const Stopped&) {
    http::Response response = problem_response(
        {ErrorCode::kUnavailable, "the server is ending; the work was given up, nothing was stored"}, request.request_id);
    response.gave_up = true;
    return response;
  }
}

// A request for a job as it is, without any condition. All others are run, also those that will be refused.
std::optional<http::Response> answer_now(const Endpoint& endpoint, Context& context, const http::Request& request) {
  if (!request.query.empty() || request.path_params.size() != 1) return std::nullopt;
  for (const char* name : {"If-Match", "If-None-Match", "Prefer", "Range"}) {
    if (request.headers.count(name) > 0) return std::nullopt;
  }
  if (!choose_media(request.headers, endpoint.media)) return std::nullopt;
  const auto text = context.job_texts->find(request.path_params[0]);
  if (!text) return std::nullopt;
  return job_answer(*text);
}

http::Access access_of(const Endpoint& endpoint) {
  return endpoint.access.value_or(endpoint.method == "GET" ? http::Access::kRead : http::Access::kSubmit);
}

Api::Api(JobService& jobs, http::TokenTable& tokens, ApiConfig config) {
  const SpecLimits limits{config.jobs.cells_max};
  context_ = std::unique_ptr<Context>(new Context{jobs, tokens, std::move(config), false, {}, {}});
  context_->job_texts = std::make_shared<JobTexts>(jobs, context_->config.base_path);
  context_->pages = std::make_shared<Pages>(jobs, context_->config.base_path);
  context_->feeds = std::make_shared<Feeds>(jobs);
  context_->kept = std::make_shared<KeptAnswers>(kKeptBytesMax, kKeptEntriesMax);
  context_->schema_text = to_text(job_spec_schema(limits));
  const Json openapi = openapi_document(endpoints(), limits, context_->config.version, context_->config.base_path);
  context_->openapi_text = to_text(openapi);
  context_->docs_text = docs_page(openapi, context_->config.base_path, context_->config.tokens_required);
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
    if (endpoint.method == "POST" || endpoint.method == "PATCH") router.advertise(pattern, accept_name(endpoint), body_offer(endpoint));
    router.add(std::string(endpoint.method), pattern,
               [&endpoint, context = context_.get()](const http::Request& request) {
                 return run_endpoint(endpoint, *context, request);
               },
               endpoint.is_heavy ? http::Router::Weight::kHeavy : http::Router::Weight::kLight, access_of(endpoint));
    // Asked by who wants to know whether the process lives: not whether a worker is free.
    if (endpoint.handler == &get_healthz) {
      router.set_ready("GET", pattern, [&endpoint, context = context_.get()](const http::Request& request) {
        return std::make_optional(run_endpoint(endpoint, *context, request));
      });
    }
    if (endpoint.handler == &get_job) {
      router.set_ready("GET", pattern, [&endpoint, context = context_.get()](const http::Request& request) {
        return answer_now(endpoint, *context, request);
      });
    }
  }
}

http::Response failure(const Error& error, const Call& call) {
  return problem_response(error, call.request.request_id);
}

http::Response job_response(const Context& context, int status, const JobView& view) {
  http::Response response = json_response(status, encode_job(view, context.config.base_path));
  stamp(response, job_tag(view.job));
  return response;
}

http::Response json_response(int status, const Json& body) {
  http::Response response;
  response.status = status;
  response.headers.set("Content-Type", "application/json");
  response.body = to_text(body);
  return response;
}

}  // namespace colony::server::api
