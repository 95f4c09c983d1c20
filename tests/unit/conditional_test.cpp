// Preconditions and validators: what RFC 9110 (8.8, 13), 7240 and 8288 say, and that a tag settles before the work.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/analyse.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

http::Headers fields(const std::vector<std::string>& values, std::string_view name = "If-None-Match") {
  http::Headers headers;
  for (const std::string& value : values) headers.add(name, value);
  return headers;
}

TEST(EntityTags, AreReadAsListsOverAllFields) {
  struct Case {
    std::vector<std::string> values;
    std::vector<std::string> tags;  // W/ in front of weak ones
  };
  const std::vector<Case> right = {{{R"("xyzzy")"}, {R"("xyzzy")"}},
                                   {{R"(W/"xyzzy")"}, {R"(W/"xyzzy")"}},
                                   {{R"("")"}, {R"("")"}},
                                   {{R"("xyzzy", "r2d2xxxx", "c3piozzzz")"}, {R"("xyzzy")", R"("r2d2xxxx")", R"("c3piozzzz")"}},
                                   {{R"("a,b","c")"}, {R"("a,b")", R"("c")"}},
                                   {{R"(, "a" ,, W/"b",)"}, {R"("a")", R"(W/"b")"}},
                                   {{R"("a")", R"("b")"}, {R"("a")", R"("b")"}},
                                   {{"\"\xc3\xa9\""}, {"\"\xc3\xa9\""}}};
  for (const Case& one : right) {
    const auto list = api::read_tags(fields(one.values), "If-None-Match");
    ASSERT_TRUE(list && *list) << one.values.front();
    std::vector<std::string> tags;
    for (const auto& tag : (*list)->tags) tags.push_back((tag.is_weak ? "W/" : "") + tag.text);
    EXPECT_EQ(tags, one.tags);
    EXPECT_FALSE((*list)->is_any);
  }
  EXPECT_TRUE((*api::read_tags(fields({" * "}), "If-None-Match"))->is_any);
  EXPECT_FALSE(*api::read_tags(http::Headers(), "If-None-Match"));
  for (const char* wrong : {"", "x", "\"a", "a\"", "w/\"a\"", "W/ \"a\"", "\"a\" \"b\"", "*, \"a\"", "\"a\" x", ",", "\"a b\"", "'a'"}) {
    const auto list = api::read_tags(fields({wrong}), "If-None-Match");
    ASSERT_FALSE(list) << wrong;
    EXPECT_EQ(list.error().code, ErrorCode::kMalformed);
  }
}

// The table of RFC 9110, 8.8.3.2.
TEST(EntityTags, AreComparedAsInTheStandard) {
  const auto list = [](const std::string& value) { return **api::read_tags(fields({value}), "If-None-Match"); };
  EXPECT_TRUE(api::matches_weakly(list(R"(W/"1")"), R"("1")"));
  EXPECT_FALSE(api::matches_strongly(list(R"(W/"1")"), R"("1")"));
  EXPECT_FALSE(api::matches_weakly(list(R"(W/"2")"), R"("1")"));
  EXPECT_TRUE(api::matches_weakly(list(R"("1")"), R"("1")"));
  EXPECT_TRUE(api::matches_strongly(list(R"("1")"), R"("1")"));
  EXPECT_TRUE(api::matches_strongly(list("*"), R"("1")"));
}

TEST(Prefer, WaitIsReadAsRfc7240HasIt) {
  const auto wait = [](const std::vector<std::string>& values) { return api::wait_wished(fields(values, "Prefer")); };
  EXPECT_EQ(wait({"wait=10"}), 10);
  EXPECT_EQ(wait({"respond-async, WAIT = 10 ; x=y"}), 10);
  EXPECT_EQ(wait({"respond-async", "wait=\"7\""}), 7);
  EXPECT_EQ(wait({"wait=5, wait=50"}), 5) << "of several the first counts";
  EXPECT_EQ(wait({"wait=61"}), 60) << "at most 60, and Preference-Applied says so";
  EXPECT_EQ(wait({"wait=99999999999999999999999"}), 60);
  EXPECT_EQ(wait({"wait=0"}), 0);
  for (const char* other : {"wait", "wait=", "wait=-1", "wait=1.5", "waiting=3", "return=minimal", ""}) {
    EXPECT_EQ(wait({other}), std::nullopt) << other;
  }
}

TEST(Derived, AreSettledByTheirTagBeforeTheWork) {
  ApiFixture fixture;
  for (const char* path : {"/cells", "/cells?at_h=1", "/lineage", "/image?width_px=64", "/mesh?triangles_max=10000", "/series?points=7"}) {
    auto full = fixture.get(kJob + path);
    ASSERT_EQ(full.status, 200) << path;
    const std::string tag = header(full, "ETag");
    ASSERT_THAT(tag, ::testing::MatchesRegex("\"[0-9a-f]+\"")) << path;
    EXPECT_EQ(header(full, "Cache-Control"), "private, no-cache");
    for (const std::string& value : {tag, "W/" + tag, "\"other\", " + tag}) {
      fixture.jobs.folds = 0;
      auto same = fixture.get(kJob + path, {{"If-None-Match", value}});
      EXPECT_EQ(same.status, 304) << path;
      EXPECT_EQ(header(same, "ETag"), tag);
      EXPECT_EQ(header(same, "Content-Type"), "");
      EXPECT_EQ(header(same, "Cache-Control"), "private, no-cache");
      EXPECT_EQ(header(same, "Vary"), header(full, "Vary"));
      EXPECT_TRUE(same.body.empty() && !same.stream);
      EXPECT_EQ(fixture.jobs.folds, 0) << "nothing was folded for " << path;
    }
    auto other = fixture.get(kJob + path, {{"If-None-Match", "\"other\""}});
    EXPECT_EQ(other.status, 200);
    EXPECT_EQ(body_of(other), body_of(full)) << path;
    EXPECT_EQ(fixture.get(kJob + path, {{"If-None-Match", "*"}}).status, 304);
    EXPECT_EQ(fixture.get(kJob + path, {{"If-Match", tag}}).status, 200);
    fixture.jobs.folds = 0;
    EXPECT_EQ(fixture.get(kJob + path, {{"If-Match", "\"other\""}}).status, 412);
    EXPECT_EQ(fixture.jobs.folds, 0);
    EXPECT_EQ(fixture.get(kJob + path, {{"If-None-Match", tag.substr(1)}}).status, 400) << "not passed over";

    fixture.jobs.folds = 0;
    auto head = fixture.ask("HEAD", kJob + path);
    EXPECT_EQ(head.status, 200);
    EXPECT_EQ(fixture.jobs.folds, 0) << "HEAD computes nothing for " << path;
    EXPECT_NE(head.stream, nullptr) << "of unknown length";
    for (const char* name : {"ETag", "Content-Type", "Vary", "Cache-Control"}) EXPECT_EQ(header(head, name), header(full, name)) << path;
    EXPECT_EQ(fixture.ask("HEAD", kJob + path, {{"If-None-Match", tag}}).status, 304);
  }
}

TEST(Derived, ATagNamesAllThatTheAnswerIsAFunctionOf) {
  std::vector<std::string> tags;
  const auto add = [&](api::ApiConfig config, std::size_t stored, const std::string& target, const std::string& accept) {
    ApiFixture fixture(std::move(config));
    fixture.jobs.history.resize(stored);
    tags.push_back(header(fixture.get(kJob + target, {{"Accept", accept}}), "ETag"));
  };
  const api::ApiConfig now = ApiFixture::config();
  api::ApiConfig later = now;
  later.version = "0.2.0";
  add(now, 4, "/cells", "application/json");
  add(now, 5, "/cells", "application/json");
  add(now, 4, "/cells", "text/csv");
  add(now, 4, "/cells?at_h=0", "application/json");
  add(later, 4, "/cells", "application/json");
  add(now, 4, "/image?width_px=64", "image/png");
  add(now, 4, "/image?width_px=65", "image/png");
  add(now, 4, "/image?width_px=64&style=phase", "image/png");
  const std::set<std::string> distinct(tags.begin(), tags.end());
  EXPECT_EQ(distinct.size(), tags.size());
  EXPECT_FALSE(distinct.contains(""));
  tags.clear();
  add(now, 4, "/cells?at_h=1", "application/json");
  add(now, 4, "/cells?at_h=1.0", "application/json");
  add(now, 4, "/cells?at_h=1e0", "application/json");
  EXPECT_EQ(std::set<std::string>(tags.begin(), tags.end()).size(), 1u) << "one number, however it is spelled";
  tags.clear();
  add(now, 4, "/cells?at_h=1e-300", "application/json");
  add(now, 4, "/cells?at_h=2e-300", "application/json");
  EXPECT_NE(tags[0], tags[1]);
}

TEST(Derived, EventsHaveATagOnceTheJobHasEnded) {
  ApiFixture fixture;
  const std::string tag = header(fixture.get(kJob + "/events?limit=3"), "ETag");
  EXPECT_NE(tag, "");
  EXPECT_EQ(fixture.get(kJob + "/events?limit=3", {{"If-None-Match", tag}}).status, 304);
  EXPECT_EQ(fixture.get(kJob + "/events?limit=4", {{"If-None-Match", tag}}).status, 200);
  fixture.jobs.row.state = JobState::kRunning;
  auto live = fixture.get(kJob + "/events?limit=3", {{"If-None-Match", tag}});
  EXPECT_EQ(live.status, 200);
  EXPECT_EQ(header(live, "ETag"), "");
}

TEST(Lists, HaveTheTagOfTheirBytes) {
  ApiFixture fixture;
  for (const char* path : {"/v1/jobs", "/v1/jobs/counts", "/v1/service-info", "/openapi.json", "/v1/schema/job", "/docs", "/docs.css"}) {
    const std::string tag = header(fixture.get(path), "ETag");
    ASSERT_NE(tag, "") << path;
    auto same = fixture.get(path, {{"If-None-Match", tag}});
    EXPECT_EQ(same.status, 304) << path;
    EXPECT_EQ(same.body, "");
  }
  const std::string tag = header(fixture.get("/v1/jobs"), "ETag");
  auto linked = fixture.get("/v1/jobs", {{"If-None-Match", tag}});
  EXPECT_THAT(header(linked, "Link"), HasSubstr("rel=\"next\"")) << "a 304 has the fields of the 200";
  fixture.jobs.row.name = "other";
  EXPECT_EQ(fixture.get("/v1/jobs", {{"If-None-Match", tag}}).status, 200);
  EXPECT_EQ(header(fixture.get("/healthz"), "ETag"), "");
}

// RFC 9110, 13.1: a precondition of a request that changes something is held, or the request refused; no operation passes one over.
TEST(Preconditions, OfUnsafeMethodsAreNeverPassedOver) {
  for (const api::Endpoint& endpoint : api::endpoints()) {
    if (endpoint.method == "GET") continue;
    ApiFixture fixture;
    fixture.jobs.row.revision = 3;
    std::string path(endpoint.path);
    if (const std::size_t at = path.find("{job_id}"); at != std::string::npos) path.replace(at, 8, kJobId);
    if (path.find('{') != std::string::npos) continue;  // of things that are not there yet: below
    const std::string method(endpoint.method);
    const std::string type = endpoint.body_media.empty() ? "application/json" : std::string(endpoint.body_media.front());
    const bool is_about_nothing = api::compared_by(endpoint) == api::Compared::kNothing;
    const std::string body = endpoint.operation_id == "editJob"   ? R"({"name": "new"})"
                             : endpoint.operation_id == "forkJob" ? R"({"at_h": 1, "until": {"cells": 9}})"
                                                                  : "";
    for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{
             {"If-Match", "\"other\""}, {"If-Match", "W/\"3.1\""}, {"If-None-Match", "*"}}) {
      auto response = fixture.ask(method, path, {{"Content-Type", type}, {name, value}}, body);
      EXPECT_EQ(response.status, is_about_nothing ? 400 : 412) << method << " " << path << " " << name << ": " << value;
      EXPECT_THAT(faults(response), ElementsAre(name));
      EXPECT_TRUE(fixture.jobs.submitted.empty());
      EXPECT_EQ(fixture.jobs.last_actor, "") << method << " " << path;
      EXPECT_EQ(fixture.jobs.row.revision, 3u);
    }
    EXPECT_EQ(fixture.ask(method, path, {{"Content-Type", type}, {"If-Match", "x"}}, body).status, 400);
  }
  ApiFixture fixture;
  for (const char* header : {"If-Match", "If-None-Match"}) {
    EXPECT_EQ(fixture.post("/v1/tokens", R"({"name": "a", "scope": "read", "expires_h": 1})", {{header, "*"}}).status, 400);
    EXPECT_EQ(fixture.ask("DELETE", "/v1/tokens/x", {{header, "\"a\""}}).status, 400);
  }
  auto tokens = fixture.get("/v1/tokens");
  EXPECT_TRUE(json_of(tokens)["items"].empty());
}

TEST(Preconditions, OfAJobAreHeldAgainstItsRevision) {
  ApiFixture fixture;
  fixture.jobs.row.revision = 3;
  const auto status = [&](const std::string& what, const char* header, const char* value) {
    return what == "DELETE" ? fixture.ask("DELETE", kJob, {{header, value}}).status
           : what == "PATCH"
               ? fixture.ask("PATCH", kJob, {{"Content-Type", "application/merge-patch+json"}, {header, value}}, "{}").status
               : fixture.post(kJob + what, what == "/fork" ? R"({"at_h": 1, "until": {"cells": 9}})" : "", {{header, value}}).status;
  };
  for (const char* what : {"/cancel", "/pause", "/resume", "/fork", "/verify", "PATCH", "DELETE"}) {
    fixture.jobs.row.revision = 3;
    EXPECT_EQ(status(what, "If-None-Match", "\"3.99\""), 412) << what;
    EXPECT_EQ(status(what, "If-None-Match", "\"1.1\", W/\"3.0\""), 412) << what;
    EXPECT_EQ(status(what, "If-Match", "\"2.0\""), 412) << what;
    EXPECT_LT(status(what, "If-None-Match", "\"2.0\", \"other\""), 300) << what;
    fixture.jobs.row.revision = 3;
    EXPECT_LT(status(what, "If-Match", "\"2.0\", \"3.0\""), 300) << what;
    EXPECT_LT(status(what, "If-Match", "*"), 300) << what;
  }
  const std::string none = "/v1/jobs/01890000-0000-7000-8000-00000000ffff/verify";
  EXPECT_EQ(fixture.post(none, "", {{"If-None-Match", "*"}}).status, 404);
}

// A repetition of what was done already is answered as before, whatever became of the origin meanwhile (13.1.1 allows it).
TEST(Preconditions, DoNotUndoAnIdempotencyKey) {
  ApiFixture fixture;
  fixture.jobs.row.revision = 3;
  const std::vector<std::pair<std::string, std::string>> headers = {{"Idempotency-Key", "k"}, {"If-Match", "\"3.0\""}};
  EXPECT_EQ(fixture.post(kJob + "/verify", "", headers).status, 201);
  fixture.jobs.row.revision = 4;
  EXPECT_EQ(fixture.post(kJob + "/verify", "", headers).status, 200);
  EXPECT_EQ(fixture.post(kJob + "/verify", "", {{"Idempotency-Key", "other"}, {"If-Match", "\"3.0\""}}).status, 412);
}

// The list's tag changes with the job that was just made: what a client repeats for safety would be told that nothing was done.
TEST(Preconditions, AreRefusedByACollectionThatIsAddedTo) {
  ApiFixture fixture;
  const std::string spec = R"({"until": {"cells": 5}})";
  for (const char* path : {"/v1/jobs", "/v1/comparisons", "/v1/analyses"}) {
    const std::string tag = header(fixture.get(path), "ETag"), type = path == std::string("/v1/analyses") ? "image/png" : "application/json";
    ASSERT_NE(tag, "");
    for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{
             {"If-Match", tag}, {"If-Match", "*"}, {"If-None-Match", "*"}, {"If-None-Match", "\"other\""}}) {
      auto refused = fixture.ask("POST", path, {{"Content-Type", type}, {"Idempotency-Key", "k"}, {name, value}}, spec);
      EXPECT_EQ(refused.status, 400) << path << " " << name;
      EXPECT_THAT(faults(refused), ElementsAre(name));
    }
  }
  EXPECT_TRUE(fixture.jobs.submitted.empty());
  auto openapi = fixture.get("/openapi.json");
  const Json paths = json_of(openapi)["paths"];
  for (const char* path : {"/v1/jobs", "/v1/comparisons", "/v1/analyses", "/v1/tokens"}) {
    const Json& post = paths[path]["post"];
    EXPECT_THAT(post["description"].get<std::string>(), HasSubstr("no preconditions")) << path;
    EXPECT_FALSE(post["responses"].contains("412")) << path;
    for (const Json& parameter : post["parameters"]) EXPECT_FALSE(parameter.value("name", "").starts_with("If-")) << path;
  }
}

// The revision is compared by whoever does the thing, as it does it: nothing that comes in between is lost.
TEST(Preconditions, OfWhatChangesAJobAreComparedWithTheAct) {
  for (const char* what : {"/cancel", "/pause", "/resume", "DELETE"}) {
    ApiFixture fixture;
    fixture.jobs.row.revision = 3;
    fixture.jobs.before_acting = [&] { fixture.jobs.row.revision = 4; };
    auto response = std::string(what) == "DELETE" ? fixture.ask("DELETE", kJob, {{"If-Match", "\"3.1\""}})
                                                  : fixture.post(kJob + what, "", {{"If-Match", "\"3.1\""}});
    EXPECT_EQ(response.status, 412) << what;
    EXPECT_THAT(faults(response), ElementsAre("If-Match"));
    EXPECT_EQ(fixture.jobs.last_actor, "");
  }
}

TEST(Preconditions, OfOtherThingsAreHeldAgainstTheirGet) {
  ApiFixture fixture;
  // An analysis: its tag is that of its bytes.
  AnalysisStore& analyses = fixture.jobs.store().analyses();
  NewAnalysis wanted;
  wanted.options_json = api::to_text(api::encode_image_options({}));
  wanted.media_type = "image/png";
  wanted.image = "not looked at";
  const auto made = analyses.create(wanted, {1'000'000, 10});
  ASSERT_TRUE(made) << made.error().message;
  const std::string path = "/v1/analyses/" + made->id;
  const std::string of_it = header(fixture.get(path), "ETag");
  ASSERT_NE(of_it, "");
  EXPECT_EQ(fixture.ask("DELETE", path, {{"If-Match", "\"other\""}}).status, 412);
  EXPECT_EQ(fixture.ask("DELETE", path, {{"If-None-Match", of_it}}).status, 412);
  EXPECT_EQ(fixture.ask("DELETE", path, {{"If-None-Match", "*"}}).status, 412);
  EXPECT_EQ(fixture.ask("DELETE", path, {{"If-Match", of_it}}).status, 204);
  EXPECT_EQ(fixture.ask("DELETE", path, {{"If-Match", of_it}}).status, 404);
}

TEST(Links, LeadThroughEveryPageOfEvents) {
  api::ApiConfig config = ApiFixture::config();
  config.base_path = "/colony";
  ApiFixture fixture(config);
  std::vector<std::uint64_t> seqs;
  std::string target = kJob + "/events?limit=4&kind=founded,divided,finished";
  for (int page = 0; page < 100 && !target.empty(); ++page) {
    auto response = fixture.get(target);
    ASSERT_EQ(response.status, 200) << target;
    const std::string link = header(response, "Link");
    const Json body = json_of(response);
    for (const Json& event : body["items"]) seqs.push_back(event["seq"].get<std::uint64_t>());
    EXPECT_EQ(body["next"].is_null(), link.empty()) << "body and Link say the same";
    target.clear();
    if (link.empty()) break;
    ASSERT_THAT(link, ::testing::MatchesRegex("</colony/v1/jobs/[^>]*>; rel=\"next\""));
    target = link.substr(8, link.find('>') - 8);
    for (std::size_t at; (at = target.find("%2C")) != std::string::npos;) target.replace(at, 3, ",");
  }
  std::vector<std::uint64_t> expected;
  for (const Event& event : fixture.jobs.history) {
    if (event.kind() == EventKind::kFounded || event.kind() == EventKind::kDivided || event.kind() == EventKind::kFinished)
      expected.push_back(event.seq);
  }
  EXPECT_EQ(seqs, expected);
  EXPECT_EQ(header(fixture.get(kJob + "/events?limit=100000"), "Link"), "");
}

}  // namespace
}  // namespace colony::server::testing
