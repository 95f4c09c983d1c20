#include "server/api/endpoints_service.hpp"

namespace colony::server::api {
namespace {

constexpr std::string_view kJson = "application/json";

// An Endpoint with an access of its own.
Endpoint with(http::Access access, Endpoint endpoint) {
  endpoint.access = access;
  return endpoint;
}

}  // namespace

// Open is what holds nothing of anybody: whether the server lives, and the description that is the same for everybody.
std::vector<Endpoint> service_endpoints() {
  using enum ProblemKind;
  using http::Access;
  return {
      {"GET",
       "/v1/schema/job",
       "getJobSchema",
       "JSON Schema (2020-12) of a job spec",
       {kJson, "application/schema+json"},
       {},
       {{200, "the schema"}},
       "",
       {},
       get_job_schema},
      with(Access::kOpen, {"GET",
                           "/openapi.json",
                           "getOpenapi",
                           "This description",
                           {kJson},
                           {},
                           {{200, "the description"}},
                           "",
                           {},
                           get_openapi}),
      {"GET",
       "/v1/service-info",
       "getServiceInfo",
       "Version, limits, presets and parameters",
       {kJson},
       {},
       {{200, "facts"}},
       "ServiceInfo",
       {},
       get_service_info},
      with(Access::kAdmin,
           {"POST",
            "/v1/tokens",
            "createToken",
            "Make a token. Its secret is in this answer and nowhere else",
            {kJson},
            {},
            {{201, "the token with its secret"}},
            "CreatedToken",
            {kMalformed, kUnsupportedMediaType, kLimit},
            post_token}),
      with(Access::kAdmin, {"GET",
                            "/v1/tokens",
                            "listTokens",
                            "All tokens without their secrets, newest first",
                            {kJson},
                            {},
                            {{200, "the tokens"}},
                            "TokenList",
                            {},
                            get_tokens}),
      with(Access::kAdmin, {"DELETE",
                            "/v1/tokens/{token_id}",
                            "deleteToken",
                            "Revoke a token: requests with it are refused and streams opened with it end, at once",
                            {},
                            {},
                            {{204, "it is worth nothing any more"}},
                            "",
                            {kNotFound},
                            delete_token}),
      with(Access::kOpen,
           {"GET", "/healthz", "getHealth", "Alive", {kJson}, {}, {{200, "alive"}}, "Health", {}, get_healthz}),
      with(Access::kOpen, {"GET",
                           "/readyz",
                           "getReadiness",
                           "Ready: database writable, disk free, not draining",
                           {kJson},
                           {},
                           {{200, "ready"}},
                           "Health",
                           {},
                           get_readyz}),
  };
}

}  // namespace colony::server::api
