// Preconditions and validators: what RFC 9110 (8.8, 13), 7240 and 8288 say, and that a tag settles before the work.
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
