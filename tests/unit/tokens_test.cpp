// Tokens over the interface, and what each operation needs.
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/handlers_tokens.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Tokens, ASecretIsShownOnceAndWorksUntilItIsRevoked) {
  ApiFixture api;
  api.tokens.add({"t", "ann", http::Scope::kAdmin, {}, http::unix_time_ms() + 3'600'000});
  api.principal = {"ann", http::Scope::kAdmin, "t"};
  http::Response made = api.post("/v1/tokens", R"({"name": "bob", "scope": "submit", "expires_h": 1.5})");
  ASSERT_EQ(made.status, 201) << made.body;
  const api::Json token = json_of(made);
  const std::string secret = token["token"];
  const std::string id = token["id"];
  EXPECT_EQ(header(made, "Location"), "/v1/tokens/" + id);
  EXPECT_EQ(token["created_by"], "ann");
  const auto found = api.tokens.find(secret, http::unix_time_ms());
  EXPECT_EQ(found.verdict, http::TokenTable::Verdict::kValid);
  EXPECT_EQ(found.principal.name, "bob");
  EXPECT_EQ(found.principal.scope, http::Scope::kSubmit);
  EXPECT_EQ(api.tokens.find(secret, http::unix_time_ms() + 5'400'000).verdict, http::TokenTable::Verdict::kExpired);

  http::Response list = api.get("/v1/tokens");
  EXPECT_THAT(list.body, Not(HasSubstr("colony_")));
  EXPECT_EQ(json_of(list)["items"][0]["id"], id);

  // As a server that starts.
  http::TokenTable fresh;
  ASSERT_TRUE(api::load_tokens(api.jobs.store().tokens(), fresh));
  EXPECT_EQ(fresh.find(secret, http::unix_time_ms()).principal.token_id, id);

  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + id).status, 204);
  EXPECT_EQ(api.tokens.find(secret, http::unix_time_ms()).verdict, http::TokenTable::Verdict::kUnknown);
  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + id).status, 404);
}

TEST(Tokens, EveryFaultIsNamedAndNothingIsMade) {
  ApiFixture api;
  const auto wrong = [&](const std::string& body) {
    http::Response response = api.post("/v1/tokens", body);
    EXPECT_EQ(response.status, 422) << body;
    return faults(response);
  };
  EXPECT_THAT(wrong("{}"), ElementsAre("/name", "/scope", "/expires_h"));
  EXPECT_THAT(wrong("[]"), ElementsAre(""));
  EXPECT_THAT(wrong(R"({"name": 1, "scope": 2, "expires_h": "3", "colour": 4})"),
              ElementsAre("/name", "/scope", "/expires_h", "/colour"));
  EXPECT_THAT(wrong(R"({"name": "", "scope": "root", "expires_h": 0})"), ElementsAre("/name", "/scope", "/expires_h"));
  for (const char* name : {"local", "anonymous", "service", "-x", "a b", "a\\nb", "\u00e9", "a\\\"b"}) {
    EXPECT_THAT(wrong(R"({"scope": "read", "expires_h": 1, "name": ")" + std::string(name) + "\"}"), ElementsAre("/name"))
        << name;
  }
  for (const char* hours : {"-1", "0", "0.0009", "87600.1", "1e300"}) {
    EXPECT_THAT(wrong(R"({"scope": "read", "name": "x", "expires_h": )" + std::string(hours) + "}"),
                ElementsAre("/expires_h"));
  }
  EXPECT_EQ(api.post("/v1/tokens", "{").status, 400);
  http::Response list = api.get("/v1/tokens");
  EXPECT_TRUE(json_of(list)["items"].empty());
}

TEST(Tokens, TheSchemaStatesTheRangeThatIsChecked) {
  ApiFixture api;
  http::Response response = api.get("/openapi.json");
  const api::Json range = json_of(response)["components"]["schemas"]["NewToken"]["properties"]["expires_h"];
  for (const char* bound : {"minimum", "maximum"}) {
    const api::Json wish = {{"name", "x"}, {"scope", "read"}, {"expires_h", range.at(bound)}};
    EXPECT_EQ(api.post("/v1/tokens", wish.dump()).status, 201) << bound;
  }
}

// Where tokens are needed somebody must be able to make one.
TEST(Tokens, TheLastValidAdminStays) {
  ApiFixture api;
  const auto make = [&](const char* scope, double expires_h = 2.0) {
    http::Response made = api.post("/v1/tokens", api::to_text({{"name", "x"}, {"expires_h", expires_h}, {"scope", scope}}));
    return json_of(made)["id"].get<std::string>();
  };
  const std::string first = make("admin");
  const std::string reader = make("read");
  NewToken expired{"old", "admin", {}, "local", "2020-01-01T00:00:00.000Z"};
  ASSERT_TRUE(api.jobs.store().tokens().create(expired));
  api.principal = {"x", http::Scope::kAdmin, first};
  http::Response refused = api.ask("DELETE", "/v1/tokens/" + first);
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("urn:colony:problem:last-admin-token"));
  EXPECT_THAT(refused.body, HasSubstr("colonyd token create"));
  EXPECT_TRUE(api.tokens.is_alive(first, http::unix_time_ms()));
  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + reader).status, 204);
  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/made-up").status, 404);
  for (const double soon_over_h : {api::kTokenLifeMin_h, 0.99}) {
    make("admin", soon_over_h);
    refused = api.ask("DELETE", "/v1/tokens/" + first);
    EXPECT_EQ(refused.status, 409) << "one that is over in " << soon_over_h << " h is nobody to leave the server to";
    EXPECT_THAT(refused.body, HasSubstr("at least " + std::to_string(api::kSpareAdminLife_h) + " h more"));
  }
  const std::string second = make("admin");
  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + first).status, 204);
  api.principal.token_id = second;
  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + second).status, 409);
  api.principal = {};  // a server without tokens locks nobody out
  EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + second).status, 204);
}

// Its request was let in before: it may have waited for the turn that the removal had.
TEST(Tokens, ATokenThatHasEndedMakesAndRemovesNone) {
  ApiFixture api;
  const std::string wish = R"({"name": "x", "expires_h": 1, "scope": "admin"})";
  http::Response kept = api.post("/v1/tokens", wish);
  const std::string other = json_of(kept)["id"];
  for (const bool expires : {false, true}) {
    if (expires) api.tokens.add({"t", "ann", http::Scope::kAdmin, {}, http::unix_time_ms() - 1});
    api.principal = {"ann", http::Scope::kAdmin, "t"};
    http::Response made = api.post("/v1/tokens", wish);
    EXPECT_EQ(made.status, 401);
    EXPECT_THAT(made.body, HasSubstr("request-1"));
    EXPECT_THAT(header(made, "WWW-Authenticate"), HasSubstr("invalid_token"));
    EXPECT_EQ(api.ask("DELETE", "/v1/tokens/" + other).status, 401);
    http::Response list = api.get("/v1/tokens");
    EXPECT_EQ(json_of(list)["items"].size(), 1u) << "none more, and the other one stays";
  }
}

TEST(Tokens, WhatGivesWayIsLoggedAndUnknown) {
  std::vector<std::string> lines;
  api::ApiConfig config = ApiFixture::config();
  config.jobs.log = [&lines](const std::string& line) { lines.push_back(line); };
  ApiFixture api(config);
  TokenStore& store = api.jobs.store().tokens();
  const auto expired = [](std::size_t number, const char* at) {
    NewToken token{"old", "read", {}, "local", at};
    for (std::size_t i = 0; i < 4; ++i) token.secret_hash[i] = static_cast<std::uint8_t>(number >> (8 * i));
    return token;
  };
  const auto oldest = store.create(expired(0, "2019-01-01T00:00:00.000Z"));
  ASSERT_TRUE(oldest);
  api.tokens.add({oldest->row.id, "old", http::Scope::kRead, oldest->row.secret_hash, 1});
  std::vector<std::thread> threads;  // several at once share a commit
  for (std::size_t part = 0; part < 9; ++part) {
    threads.emplace_back([&, part] {
      for (std::size_t i = 1 + part; i < kTokensMax; i += 9) EXPECT_TRUE(store.create(expired(i, "2020-01-01T00:00:00.000Z")));
    });
  }
  for (std::thread& thread : threads) thread.join();
  ASSERT_EQ(store.list()->size(), kTokensMax);
  EXPECT_EQ(api.tokens.expires_unix_ms(oldest->row.id), 1);
  EXPECT_EQ(api.post("/v1/tokens", R"({"name": "x", "scope": "read", "expires_h": 1})").status, 201);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr(oldest->row.id));
  EXPECT_EQ(api.tokens.expires_unix_ms(oldest->row.id), 0) << "not known any more";
}

TEST(Tokens, WhoAsksIsWrittenDown) {
  ApiFixture api;
  api.principal = {"ann", http::Scope::kSubmit, "t"};
  EXPECT_EQ(api.post("/v1/jobs", R"({"until": {"cells": 5}})").status, 201);
  EXPECT_EQ(api.jobs.submitted.at(0).submitted_by, "ann");
  for (const char* command : {"/cancel", "/pause", "/resume"}) {
    api.jobs.last_actor.clear();
    EXPECT_EQ(api.post(kJob + command, "").status, 202);
    EXPECT_EQ(api.jobs.last_actor, "ann") << command;
  }
}

// The table of scopes, as a reader of DESIGN.md has it: read for GET, submit for the rest, and these.
TEST(Tokens, WhatEachOperationNeeds) {
  std::vector<std::string> open, admin;
  for (const api::Endpoint& endpoint : api::endpoints()) {
    const std::string name = std::string(endpoint.method) + " " + std::string(endpoint.path);
    switch (api::access_of(endpoint)) {
      case http::Access::kOpen:
        open.push_back(name);
        break;
      case http::Access::kAdmin:
        admin.push_back(name);
        break;
      case http::Access::kRead:
        EXPECT_EQ(endpoint.method, "GET") << name;
        break;
      case http::Access::kSubmit:
        EXPECT_NE(endpoint.method, "GET") << name;
        break;
    }
    // Whatever holds data of somebody stands under /v1 and needs a token.
    const bool is_data = endpoint.path.starts_with("/v1/");
    EXPECT_FALSE(is_data && api::access_of(endpoint) == http::Access::kOpen) << name;
  }
  EXPECT_THAT(open, ::testing::IsSupersetOf({"GET /openapi.json", "GET /healthz", "GET /readyz"}));
  EXPECT_THAT(admin, ::testing::IsSupersetOf({"POST /v1/tokens", "GET /v1/tokens", "DELETE /v1/tokens/{token_id}"}));
}

TEST(Tokens, TheDescriptionSaysWhatIsNeeded) {
  ApiFixture api;
  http::Response response = api.get("/openapi.json");
  const api::Json document = json_of(response);
  const auto needed = [&](const char* path, const char* method) { return document["paths"][path][method]["security"].dump(); };
  EXPECT_EQ(needed("/v1/jobs", "get"), R"([{"token":["read"]}])");
  EXPECT_EQ(needed("/v1/jobs", "post"), R"([{"token":["submit"]}])");
  EXPECT_EQ(needed("/v1/tokens", "get"), R"([{"token":["admin"]}])");
  EXPECT_EQ(needed("/healthz", "get"), "[]");
  EXPECT_EQ(document["components"]["securitySchemes"]["token"]["scheme"], "bearer");
  EXPECT_TRUE(document["paths"]["/v1/jobs"]["get"]["responses"].contains("401"));
}

}  // namespace
}  // namespace colony::server::testing
