// The handlers of jobs and of the server itself: Request to Response over a service of fixed answers; no socket.
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

const std::string kSpec = R"({"until": {"cells": 10}})";

TEST(Submit, StoresTheCompleteSpecAndAnswers201WithLocation) {
  ApiFixture fixture;
  auto response =
      fixture.post("/v1/jobs", R"({"name": "n", "labels": {"plate": "7"}, "seed": 5, "until": {"cells": 10}})");
  EXPECT_EQ(response.status, 201);
  EXPECT_EQ(header(response, "Location"), kJob);
  EXPECT_EQ(json_of(response)["id"], kJobId);
  ASSERT_EQ(fixture.jobs.submitted.size(), 1u);
  const NewJob& job = fixture.jobs.submitted[0];
  EXPECT_EQ(job.name, "n");
  EXPECT_EQ(job.labels.at("plate"), "7");
  EXPECT_EQ(job.until_cells, 10u);
  EXPECT_EQ(job.until_time_h, 10'000.0);
  const Json spec = Json::parse(job.spec_json);
  EXPECT_EQ(spec["seed"], 5);
  EXPECT_EQ(spec["model"]["cycle"]["mean_h"], 12.0);
}

TEST(Submit, BadBodiesAreProblemsAndStoreNothing) {
  struct Case {
    std::string body;
    int status;
    std::string fault;
  };
  const std::vector<Case> cases = {
      {"", 400, ""},
      {"{", 400, ""},
      {R"({"until": {"time_h": NaN}})", 400, ""},
      {R"({"until": {"cells": 1, "cells": 2}})", 400, "/until/cells"},
      {std::string(100, '['), 400, ""},
      {"[]", 422, "-"},
      {R"({"until": {"cells": 1}, "colour": 1})", 422, "/colour"},
      {R"({"until": {"cells": 1}, "model": {"noise": {"amplitude": 0.46}}})", 422, "/model/noise/amplitude"},
      {R"({"preset": "paper"})", 422, "/until"}};
  for (const Case& one : cases) {
    for (const char* target : {"/v1/jobs", "/v1/jobs?dry_run=true"}) {
      ApiFixture fixture;
      auto response = fixture.post(target, one.body);
      EXPECT_EQ(response.status, one.status) << one.body;
      EXPECT_EQ(header(response, "Content-Type"), "application/problem+json");
      const Json problem = json_of(response);
      EXPECT_EQ(problem["status"], one.status);
      EXPECT_EQ(problem["request_id"], "request-1");
      EXPECT_EQ(problem["type"], one.status == 400 ? "urn:colony:problem:malformed" : "urn:colony:problem:invalid");
      if (one.status == 400) {
        EXPECT_THAT(problem["detail"].get<std::string>(), HasSubstr("byte offset"));
      }
      if (!one.fault.empty()) {
        EXPECT_THAT(faults(response), ElementsAre(one.fault == "-" ? "" : one.fault));
      }
      EXPECT_TRUE(fixture.jobs.submitted.empty());
    }
  }
}

// One endpoint over a context that the test holds.
http::Response submitted_to(api::Context& context, const std::string& target_query, const std::string& body) {
  const auto table = api::endpoints();
  const auto submit =
      std::find_if(table.begin(), table.end(), [](const api::Endpoint& e) { return e.operation_id == "submitJob"; });
  http::Request request;
  request.method = "POST";
  request.path = "/v1/jobs";
  request.headers.set("Content-Type", "application/json");
  if (!target_query.empty()) request.query.emplace_back(target_query, "true");
  request.body = body;
  return api::run_endpoint(*submit, context, request);
}

std::string founders(int count) {
  return R"({"until": {"cells": 100000}, "model": {"founders": {"count": )" + std::to_string(count) +
         R"(, "radius_um": 4000}}})";
}

TEST(Submit, OneAtATimeMayHaveManyFounders) {
  FakeJobs jobs;
  http::TokenTable tokens;
  api::Context context{jobs, tokens, ApiFixture::config(), false, {}, {}, true};  // another one is at it
  for (const char* query : {"", "dry_run"}) {
    auto refused = submitted_to(context, query, founders(1001));
    EXPECT_EQ(refused.status, 503);
    EXPECT_EQ(json_of(refused)["type"], "urn:colony:problem:busy");
    EXPECT_NE(header(refused, "Retry-After"), "");
  }
  EXPECT_TRUE(jobs.submitted.empty());
  EXPECT_TRUE(context.places_many) << "the turn of the other one is not taken away";
  EXPECT_EQ(submitted_to(context, "dry_run", founders(5)).status, 200) << "a small one needs no turn";
  context.places_many = false;
  EXPECT_EQ(submitted_to(context, "dry_run", founders(1001)).status, 200);
  EXPECT_FALSE(context.places_many) << "given back";
}

// By the end of the server where nothing else is said, else by who waits for the answer.
TEST(Submit, AndAllThatTakesLongIsGivenUpForNobody) {
  ApiFixture drained, left;
  drained.api().drain();
  left.gives_up = std::make_shared<std::atomic<bool>>(true);
  for (ApiFixture* const fixture : {&drained, &left}) {
    const auto expect_given_up = [](const std::string& what, http::Response response) {
      EXPECT_EQ(response.status, 503) << what;
      EXPECT_EQ(json_of(response)["type"], "urn:colony:problem:unavailable") << what;
      EXPECT_NE(header(response, "Retry-After"), "") << what;
    };
    for (const char* target : {"/v1/jobs", "/v1/jobs?dry_run=true"}) expect_given_up(target, fixture->post(target, founders(2000)));
    EXPECT_TRUE(fixture->jobs.submitted.empty());
    for (const char* path : {"/image", "/mesh", "/analysis", "/lineage"}) expect_given_up(path, fixture->get(kJob + path));
    expect_given_up("ome-tiff", fixture->get(kJob + "/image", {{"Accept", "image/tiff"}}));
  }
  *left.gives_up = false;
  left.api().drain();
  EXPECT_EQ(left.get(kJob + "/image?width_px=64").status, 200) << "the http server says when";
}

TEST(Paths, BeginWithTheBasePath) {
  api::ApiConfig config = ApiFixture::config();
  config.base_path = "/colony";
  ApiFixture fixture(config);
  EXPECT_EQ(header(fixture.post("/v1/jobs", kSpec), "Location"), "/colony" + kJob);
  EXPECT_THAT(header(fixture.get("/v1/jobs"), "Link"), HasSubstr("</colony/v1/jobs?cursor="));
  auto openapi = fixture.get("/openapi.json");
  EXPECT_EQ(json_of(openapi)["servers"][0]["url"], "/colony");
}

TEST(Submit, AThousandErrorsAreListedAndAllCounted) {
  ApiFixture fixture;
  std::string positions;
  for (int i = 0; i < 1500; ++i) positions += (i ? "," : "") + std::string("[0]");
  auto response = fixture.post(
      "/v1/jobs", R"({"until": {"cells": 1}, "model": {"founders": {"positions_um": [)" + positions + "]}}}");
  EXPECT_EQ(response.status, 422);
  EXPECT_EQ(faults(response).size(), 1000u);
  EXPECT_THAT(json_of(response)["detail"].get<std::string>(), HasSubstr("the first 1000 of 1500"));
}

TEST(Submit, EveryPostMustBeJson) {
  for (const char* type : {"", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data",
                           "application/json; charset=latin1", "application/json; charset=utf-8; x=y",
                           "application/jsonx", "application/json, text/plain"}) {
    for (const std::string& path : {std::string("/v1/jobs"), kJob + "/cancel", kJob + "/pause", kJob + "/resume"}) {
      ApiFixture fixture;
      std::vector<std::pair<std::string, std::string>> headers;
      if (*type) headers.emplace_back("Content-Type", type);
      auto response = fixture.ask("POST", path, headers, kSpec);
      EXPECT_EQ(response.status, 415) << type << path;
      EXPECT_EQ(json_of(response)["type"], "urn:colony:problem:unsupported-media-type");
    }
  }
  ApiFixture fixture;
  EXPECT_EQ(fixture.ask("POST", "/v1/jobs", {{"content-type", "Application/JSON; charset=UTF-8"}}, kSpec).status, 201);
}

TEST(Submit, DryRunAnswersSpecAndEstimateAndStoresNothing) {
  ApiFixture fixture;
  auto response = fixture.post("/v1/jobs?dry_run=true", kSpec);
  EXPECT_EQ(response.status, 200);
  const Json body = json_of(response);
  EXPECT_EQ(body["spec"]["until"]["time_h"], 10'000.0);
  EXPECT_EQ(body["estimate"]["cells"], 10);
  EXPECT_TRUE(body["estimate"]["basis"].is_string());
  EXPECT_TRUE(fixture.jobs.submitted.empty());
  auto again = fixture.post("/v1/jobs?dry_run=true", body["spec"].dump());
  EXPECT_EQ(json_of(again)["spec"], body["spec"]);
  EXPECT_EQ(fixture.post("/v1/jobs?dry_run=false", kSpec).status, 201);
}

TEST(Submit, IdempotencyKeyGivesTheSameJobOrIsRefused) {
  ApiFixture fixture;
  const auto with = [&](const std::string& key, const std::string& body) {
    return fixture.post("/v1/jobs", body, {{"Idempotency-Key", key}});
  };
  EXPECT_EQ(with("plate 7, well B2", kSpec).status, 201);
  EXPECT_EQ(with("plate 7, well B2", kSpec).status, 200);
  auto other = with("plate 7, well B2", R"({"until": {"cells": 11}})");
  EXPECT_EQ(other.status, 422);
  EXPECT_EQ(json_of(other)["type"], "urn:colony:problem:idempotency-key-reused");
  EXPECT_EQ(with(std::string(200, 'k'), kSpec).status, 201);
  for (const std::string& key : {std::string(), std::string(201, 'k'), std::string("a\tb"), std::string("\xC3\xBC")}) {
    auto refused = with(key, kSpec);
    EXPECT_EQ(refused.status, 422);
    EXPECT_THAT(faults(refused), ElementsAre("Idempotency-Key"));
  }
  auto twice = fixture.post("/v1/jobs", kSpec, {{"Idempotency-Key", "a"}, {"Idempotency-Key", "a"}});
  EXPECT_EQ(twice.status, 422);
  EXPECT_EQ(fixture.jobs.submitted.size(), 2u);
}

TEST(Submit, AFullQueueIs429WithRetryAfter) {
  ApiFixture fixture;
  fixture.jobs.next_error = Error{ErrorCode::kBusy, "1000 jobs wait"};
  auto response = fixture.post("/v1/jobs", kSpec);
  EXPECT_EQ(response.status, 429);
  EXPECT_NE(header(response, "Retry-After"), "");
}

struct QueryCase {
  std::string target;
  std::string fault;
};

TEST(Queries, EveryWrongParameterIsNamed) {
  const std::vector<QueryCase> cases = {{"/v1/jobs?colour=red", "colour"},
                                        {"/v1/jobs?limit=0", "limit"},
                                        {"/v1/jobs?limit=501", "limit"},
                                        {"/v1/jobs?limit=ten", "limit"},
                                        {"/v1/jobs?limit=+5", "limit"},
                                        {"/v1/jobs?limit=5.0", "limit"},
                                        {"/v1/jobs?limit=", "limit"},
                                        {"/v1/jobs?limit=5&limit=5", "limit"},
                                        {"/v1/jobs?state=asleep", "state"},
                                        {"/v1/jobs?state=", "state"},
                                        {"/v1/jobs?label=plate", "label"},
                                        {"/v1/jobs?label=Pl:1", "label"},
                                        {"/v1/jobs?cursor=", "cursor"},
                                        {"/v1/jobs?cursor=made-up", "cursor"},
                                        {"/v1/jobs?name=\xff", "name"},
                                        {"/v1/jobs?/x=1", "%2Fx"},
                                        {"/v1/jobs/counts?state=queued", "state"},
                                        {kJob + "?wait=1", "wait"},
                                        {kJob + "/events?after=-1", "after"},
                                        {kJob + "/events?kind=exploded", "kind"},
                                        {kJob + "/events?kind=", "kind"},
                                        {kJob + "/events?kind=divided,", "kind"},
                                        {kJob + "/events?kind=progress", "kind"},
                                        {kJob + "/events?limit=100001", "limit"},
                                        {kJob + "/events?cell_id=0", "cell_id"},
                                        {kJob + "/events?cell_id=4294967296", "cell_id"},
                                        {kJob + "/cells?at_h=NaN", "at_h"},
                                        {kJob + "/cells?at_h=-1", "at_h"},
                                        {kJob + "/cells?at_h=1e999", "at_h"},
                                        {kJob + "/cells?at_h=inf", "at_h"},
                                        {kJob + "/cells?at_h=0x1", "at_h"},
                                        {kJob + "/cells?at_h= 1", "at_h"},
                                        {kJob + "/series?points=0", "points"},
                                        {kJob + "/series?points=10001", "points"},
                                        {kJob + "/image?style=cubist", "style"},
                                        {kJob + "/image?lines=none", "lines"},
                                        {kJob + "/image?style=brightfield&colour_by=age", "colour_by"},
                                        {kJob + "/image?style=contours&colour_by=volume", "colour_by"},
                                        {kJob + "/image?style=shaded&lines=colony", "lines"},
                                        {kJob + "/image?lines=colony", "lines"},
                                        {kJob + "/image?style=labels&scale_bar=true", "scale_bar"},
                                        {kJob + "/mesh?triangles_max=999", "triangles_max"},
                                        {kJob + "/analysis?width_px=4097", "width_px"},
                                        {kJob + "/image?width_px=15", "width_px"},
                                        {kJob + "/image?width_px=1000000", "width_px"},
                                        {kJob + "/image?um_per_px=0", "um_per_px"},
                                        {kJob + "/image?um_per_px=0.000001", "um_per_px"},
                                        {kJob + "/image?scale_bar=maybe", "scale_bar"},
                                        {kJob + "/image?colour_by=mood", "colour_by"},
                                        {"/healthz?verbose=1", "verbose"}};
  for (const QueryCase& one : cases) {
    ApiFixture fixture;
    auto response = fixture.get(one.target);
    EXPECT_EQ(response.status, 422) << one.target;
    EXPECT_THAT(faults(response), ElementsAre(one.fault)) << one.target;
  }
}

TEST(Queries, AllAtOnceWithNearMisses) {
  ApiFixture fixture;
  auto response = fixture.get("/v1/jobs?limt=5&state=runing&limit=0");
  EXPECT_THAT(faults(response), ElementsAre("limt", "state", "limit"));
  const Json problem = json_of(response);
  EXPECT_THAT(problem["errors"][0]["message"].get<std::string>(), HasSubstr("did you mean limit?"));
  EXPECT_THAT(problem["errors"][1]["message"].get<std::string>(), HasSubstr("did you mean running?"));
  EXPECT_TRUE(problem["errors"][0].contains("parameter"));
}

TEST(Accept, ChoosesByWeightAndListsWhatThereIs) {
  ApiFixture fixture;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"*/*", "application/json"},
      {"text/csv", "text/csv; charset=utf-8; header=present"},
      {"application/x-ndjson;q=0.5, text/csv;q=0.4", "application/x-ndjson"},
      {"text/*", "text/csv; charset=utf-8; header=present"},
      {"application/json;q=0, */*", "application/x-ndjson"},
      {"TEXT/CSV", "text/csv; charset=utf-8; header=present"}};
  for (const auto& [accept, type] : cases) {
    EXPECT_EQ(header(fixture.get(kJob + "/events", {{"Accept", accept}}), "Content-Type"), type) << accept;
  }
  for (const char* accept : {"application/x-made-up", "", "application/json;q=0", "nonsense"}) {
    auto response = fixture.get(kJob + "/events", {{"Accept", accept}});
    EXPECT_EQ(response.status, 406) << accept;
    EXPECT_THAT(json_of(response)["detail"].get<std::string>(),
                HasSubstr("application/json, application/x-ndjson, text/csv, text/event-stream"));
  }
  EXPECT_EQ(fixture.get(kJob + "/image", {{"Accept", "text/csv"}}).status, 406);
  EXPECT_EQ(fixture.get("/v1/jobs", {{"Accept", "text/html, */*;q=0.8"}}).status, 200);
}

TEST(Jobs, UnknownOnesAre404) {
  ApiFixture fixture;
  const std::string other = "/v1/jobs/01890000-0000-7000-8000-00000000dead";
  for (const char* what : {"", "/events", "/cells", "/series", "/image", "/mesh", "/analysis", "/lineage", "/log"}) {
    auto response = fixture.get(other + what);
    EXPECT_EQ(response.status, 404) << what;
    EXPECT_THAT(json_of(response)["detail"].get<std::string>(), HasSubstr("dead"));
  }
  for (const char* what : {"/cancel", "/pause", "/resume"}) EXPECT_EQ(fixture.post(other + what, "").status, 404);
  EXPECT_EQ(fixture.ask("DELETE", other).status, 404);
  EXPECT_EQ(fixture.get(other + "/events", {{"Accept", "text/event-stream"}}).status, 404);
}

TEST(Jobs, WhatBelongsToLaterVersionsIsNotThere) {
  ApiFixture fixture;
  for (const std::string& path : {std::string("/v1/sweeps")}) {
    EXPECT_EQ(fixture.get(path).status, 404) << path;
  }
  EXPECT_EQ(fixture.ask("PUT", kJob).status, 405);
}

TEST(Jobs, HaveTheirFieldsAndLinks) {
  ApiFixture fixture;
  auto response = fixture.get(kJob);
  const Json job = json_of(response);
  EXPECT_EQ(job["state"], "succeeded");
  EXPECT_EQ(job["reason"], "cells");
  EXPECT_TRUE(job["detail"].is_null());
  EXPECT_EQ(job["digest"], fixture.jobs.row.digest.hex());
  EXPECT_EQ(job["links"]["events"], kJob + "/events");
  EXPECT_EQ(job["progress"]["fraction"], 1.0);
  EXPECT_TRUE(job["progress"]["eta_s"].is_null());
  EXPECT_EQ(job["spec"]["seed"], 3);
}

TEST(Jobs, ListsPassFiltersAndLinkTheNextPage) {
  ApiFixture fixture;
  auto response = fixture.get("/v1/jobs?state=running&kind=colony&name=a b&label=plate:7:x,y&label=k:&limit=7");
  EXPECT_EQ(response.status, 200);
  const JobFilter& filter = fixture.jobs.asked_filter;
  EXPECT_EQ(filter.state, JobState::kRunning);
  EXPECT_EQ(filter.kind, "colony");
  EXPECT_EQ(filter.name, "a b");
  EXPECT_THAT(filter.labels, ElementsAre(std::pair<std::string, std::string>("plate", "7:x,y"),
                                         std::pair<std::string, std::string>("k", "")));
  EXPECT_EQ(fixture.jobs.asked_limit, 7u);
  EXPECT_EQ(json_of(response)["next"], "a cursor&");
  EXPECT_EQ(header(response, "Link"),
            "</v1/"
            "jobs?state=running&kind=colony&name=a%20b&label=plate%3A7%3Ax%2Cy&label=k%3A&limit=7&cursor=a%20cursor%26>"
            "; rel=\"next\"");
  auto last = fixture.get("/v1/jobs?cursor=x");
  EXPECT_TRUE(json_of(last)["next"].is_null());
  EXPECT_EQ(header(last, "Link"), "");
  EXPECT_EQ(fixture.jobs.asked_limit, 50u);
  auto counts = fixture.get("/v1/jobs/counts");
  EXPECT_EQ(counts.body, R"({"queued":1,"running":2,"paused":3,"succeeded":4,"failed":5,"cancelled":6})");
}

TEST(Commands, AnswerByWhatChanged) {
  ApiFixture fixture;
  for (const char* what : {"/cancel", "/pause", "/resume"}) {
    EXPECT_EQ(fixture.post(kJob + what, "").status, 202);
    EXPECT_EQ(fixture.post(kJob + what, "{}").status, 202);
    EXPECT_EQ(fixture.post(kJob + what, "{").status, 400);
    auto unknown = fixture.post(kJob + what, R"({"force": true})");
    EXPECT_EQ(unknown.status, 422);
    EXPECT_THAT(faults(unknown), ElementsAre("/force"));
    fixture.jobs.next_error = Error{ErrorCode::kConflict, "it has succeeded"};
    auto refused = fixture.post(kJob + what, "");
    EXPECT_EQ(refused.status, 409);
    EXPECT_EQ(json_of(refused)["type"], "urn:colony:problem:job-terminal");
  }
  auto gone = fixture.ask("DELETE", kJob);
  EXPECT_EQ(gone.status, 204);
  EXPECT_EQ(gone.body, "");
  fixture.jobs.next_error = Error{ErrorCode::kConflict, "it is running"};
  auto refused = fixture.ask("DELETE", kJob);
  EXPECT_EQ(refused.status, 409);
  EXPECT_EQ(json_of(refused)["type"], "urn:colony:problem:job-not-terminal");
}

}  // namespace
}  // namespace colony::server::testing
