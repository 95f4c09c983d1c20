// The pages that describe the service itself: service-info, schema, OpenAPI, health.
#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Meta, ServiceInfoSchemaAndOpenapi) {
  ApiFixture fixture;
  auto info = fixture.get("/v1/service-info");
  const Json facts = json_of(info);
  EXPECT_EQ(facts["version"], "0.1.0");
  EXPECT_EQ(facts["parameters"].size(), param_table().size());
  EXPECT_EQ(facts["presets"][0]["name"], "paper");
  EXPECT_EQ(facts["limits"]["json_depth_max"], 32);
  EXPECT_EQ(facts["limits"]["jobs_concurrent_max"], 1);
  EXPECT_EQ(facts["limits"]["jobs_threads_per_job"], 1);
  auto schema = fixture.get("/v1/schema/job", {{"Accept", "application/schema+json"}});
  EXPECT_EQ(json_of(schema)["$schema"], "https://json-schema.org/draft/2020-12/schema");

  auto response = fixture.get("/openapi.json");
  const Json openapi = json_of(response);
  EXPECT_EQ(openapi["openapi"], "3.1.0");
  std::size_t operations = 0;
  for (const auto& [path, item] : openapi["paths"].items()) operations += item.size();
  EXPECT_EQ(operations, api::endpoints().size());
  // Every reference resolves, and every problem a handler can answer is stated.
  const std::string text = openapi.dump();
  for (std::size_t at = text.find("\"#/"); at != std::string::npos; at = text.find("\"#/", at + 1)) {
    const std::string pointer = text.substr(at + 2, text.find('"', at + 1) - at - 2);
    EXPECT_TRUE(openapi.contains(Json::json_pointer(pointer))) << pointer;
  }
  for (const api::Endpoint& endpoint : api::endpoints()) {
    std::string method(endpoint.method);
    for (char& c : method) c = static_cast<char>(std::tolower(c));
    const Json& responses = openapi["paths"][std::string(endpoint.path)][method]["responses"];
    for (const auto& [status, description] : endpoint.answers) EXPECT_TRUE(responses.contains(std::to_string(status)));
    for (const api::ProblemKind kind : endpoint.problems) {
      EXPECT_TRUE(responses.contains(std::to_string(api::problem_row(kind).status))) << endpoint.path;
    }
  }
}

TEST(Meta, ProblemTableIsWhole) {
  std::set<std::string_view> codes;
  int index = 0;
  for (const api::ProblemRow& row : api::problem_table()) {
    EXPECT_EQ(static_cast<int>(row.kind), index++);
    EXPECT_TRUE(codes.insert(row.code).second) << row.code;
    EXPECT_GE(row.status, 400);
    EXPECT_EQ(row.retry_after_s > 0, row.status == 429 || row.status == 503);
  }
  EXPECT_EQ(api::problem_row(api::problem_kind_of(ErrorCode::kNotReached)).code, "time-not-reached");
}

TEST(Meta, HealthNeedsNoWorker) {
  ApiFixture fixture;
  http::Router router;
  fixture.api().add_routes(router);
  http::Request request;
  request.method = "GET";
  request.path = "/healthz";
  const auto ready = router.dispatch_ready(request);
  ASSERT_TRUE(ready);
  EXPECT_EQ(ready->body, fixture.get("/healthz").body);
  request.query.emplace_back("x", "1");
  EXPECT_EQ(router.dispatch_ready(request)->status, 422) << "held to what every request is";
}

TEST(Meta, AProblemOf500SaysWhyToTheLogAlone) {
  const Error error{ErrorCode::kInternal, "check failed: event.digest == digest at engine/colony.cpp:77", {{"/secret", "field"}}};
  const auto response = api::problem_response(error, "id-7");
  EXPECT_EQ(response.failure, error.message);
  EXPECT_EQ(response.body.find("check failed"), std::string::npos) << response.body;
  EXPECT_EQ(response.body.find("/secret"), std::string::npos) << response.body;
  EXPECT_NE(response.body.find("the server's log has more under this request_id"), std::string::npos) << response.body;
  EXPECT_NE(response.body.find("id-7"), std::string::npos);
  EXPECT_EQ(api::problem_response({ErrorCode::kStorage, "the disk is full"}, "id").failure, "") << "an operator's matter, and no bug";
}

TEST(Meta, HealthAndReadiness) {
  ApiFixture fixture;
  EXPECT_EQ(fixture.get("/healthz").body, R"({"status":"ok"})");
  EXPECT_EQ(fixture.get("/readyz").status, 200);
  fixture.api().drain();
  auto draining = fixture.get("/readyz");
  EXPECT_EQ(draining.status, 503);
  EXPECT_NE(header(draining, "Retry-After"), "");
  EXPECT_EQ(fixture.get("/healthz").status, 200);

  api::ApiConfig config = ApiFixture::config();
  config.disk_free_bytes_min = std::uint64_t{1} << 62;  // no disk has this much
  ApiFixture full(config);
  EXPECT_EQ(full.get("/readyz").status, 503);
}

}  // namespace
}  // namespace colony::server::testing
