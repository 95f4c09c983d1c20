// One job: its tag, waiting for a change without holding a thread, and editing name and labels.
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

const std::string kPatch = "application/merge-patch+json";

http::Response patch(ApiFixture& fixture, const std::string& body, std::vector<std::pair<std::string, std::string>> headers = {}) {
  headers.emplace_back("Content-Type", kPatch);
  return fixture.ask("PATCH", kJob, std::move(headers), body);
}

void add_event(ApiFixture& fixture) {
  Event event = fixture.jobs.history.back();
  fixture.jobs.row.last_seq = ++event.seq;
  fixture.jobs.history.push_back(event);
}

std::string tag_of(const ApiFixture& fixture) {
  return '"' + std::to_string(fixture.jobs.row.revision) + '.' + std::to_string(fixture.jobs.row.last_seq) + '"';
}

TEST(Job, HasTheTagOfItsRevisionAndLastSeq) {
  ApiFixture fixture;
  auto response = fixture.get(kJob);
  EXPECT_EQ(header(response, "ETag"), tag_of(fixture));
  EXPECT_EQ(fixture.get(kJob, {{"If-None-Match", tag_of(fixture)}}).status, 304);
  EXPECT_EQ(fixture.get(kJob, {{"If-None-Match", "\"0.0\", W/" + tag_of(fixture)}}).status, 304);
  EXPECT_EQ(fixture.get(kJob, {{"If-None-Match", "*"}}).status, 304);
  EXPECT_EQ(fixture.get("/v1/jobs/none", {{"If-None-Match", "*"}}).status, 404);
  const std::string before = tag_of(fixture);
  add_event(fixture);
  EXPECT_EQ(fixture.get(kJob, {{"If-None-Match", before}}).status, 200) << "more events";
}

TEST(Wait, AnswersAtOnceWithoutAReasonToWait) {
  ApiFixture fixture;
  fixture.jobs.row.revision = 7;
  auto plain = fixture.get(kJob, {{"Prefer", "wait=30"}});
  EXPECT_EQ(plain.later, nullptr);
  EXPECT_EQ(plain.status, 200);
  EXPECT_EQ(header(plain, "Preference-Applied"), "") << "nothing to compare with";
  auto differs = fixture.get(kJob, {{"Prefer", "wait=30"}, {"If-None-Match", "\"6.1\""}});
  EXPECT_EQ(differs.later, nullptr);
  EXPECT_EQ(differs.status, 200);
  EXPECT_EQ(header(differs, "Preference-Applied"), "wait=30");
  EXPECT_EQ(fixture.get("/v1/jobs/none", {{"Prefer", "wait=30"}, {"If-None-Match", "\"7.1\""}}).status, 404);
}

TEST(Wait, EndsWithAnotherRevisionOrAtItsTime) {
  ApiFixture fixture;
  fixture.jobs.row.revision = 7;
  const auto begin = [&](const std::string& tag) { return fixture.get(kJob, {{"Prefer", "wait=99"}, {"If-None-Match", tag}}); };
  auto response = begin("\"7.1\"");
  ASSERT_NE(response.later, nullptr);
  EXPECT_EQ(response.later->wait_max(), std::chrono::seconds(60));
  int woken = 0;
  response.later->on_ready([&] { ++woken; });
  EXPECT_EQ(fixture.jobs.followed_key, fixture.jobs.row.job_key);
  EXPECT_EQ(response.later->ask(false), nullptr);
  add_event(fixture);
  fixture.jobs.hearer({fixture.jobs.row.job_key, JobNews::Kind::kCommit});
  EXPECT_EQ(woken, 0) << "events alone wake nobody: a growing job commits twenty times a second";
  EXPECT_EQ(response.later->ask(false), nullptr);
  ++fixture.jobs.row.revision;
  fixture.jobs.hearer({fixture.jobs.row.job_key, JobNews::Kind::kChange});
  EXPECT_EQ(woken, 1);
  auto answer = response.later->ask(false);
  ASSERT_NE(answer, nullptr);
  EXPECT_EQ(answer->status, 200);
  EXPECT_EQ(header(*answer, "ETag"), tag_of(fixture));
  EXPECT_EQ(header(*answer, "Preference-Applied"), "wait=60");
  EXPECT_EQ(json_of(*answer)["revision"], 8);

  auto unchanged = begin(tag_of(fixture));
  auto last = unchanged.later->ask(true);
  EXPECT_EQ(last->status, 304);
  EXPECT_EQ(header(*last, "Preference-Applied"), "wait=60");
  auto grown = begin("W/\"8.0\"");
  ASSERT_NE(grown.later, nullptr) << "a proxy may have made the tag weak";
  EXPECT_EQ(grown.later->ask(true)->status, 200) << "the time is up and there are more events";
  fixture.jobs.row.id = "gone";
  EXPECT_EQ(unchanged.later->ask(false)->status, 404) << "deleted meanwhile";
}

TEST(Wait, TakesAtMostHalfOfTheConnections) {
  api::ApiConfig config = ApiFixture::config();
  config.connections_max = 6;
  ApiFixture fixture(config);
  const auto ask = [&] { return fixture.get(kJob, {{"Prefer", "wait=9"}, {"If-None-Match", tag_of(fixture)}}); };
  std::vector<http::Response> waiting;
  for (int i = 0; i < 3; ++i) {
    waiting.push_back(ask());
    ASSERT_NE(waiting.back().later, nullptr);
  }
  auto fourth = ask();
  EXPECT_EQ(fourth.later, nullptr);
  EXPECT_EQ(fourth.status, 304);
  EXPECT_EQ(header(fourth, "Preference-Applied"), "") << "it did not wait, and says so";
  waiting.pop_back();
  EXPECT_NE(ask().later, nullptr) << "given back";
  fixture.api().drain();
  EXPECT_EQ(ask().later, nullptr);
}

TEST(Patch, PassesOnWhatIsNamedAndNothingElse) {
  ApiFixture fixture;
  EXPECT_EQ(patch(fixture, R"({"name": "new"})").status, 200);
  EXPECT_EQ(fixture.jobs.asked_change.name, "new");
  EXPECT_TRUE(fixture.jobs.asked_change.labels.empty());
  EXPECT_FALSE(fixture.jobs.asked_change.drops_labels);
  EXPECT_EQ(fixture.jobs.asked_change.labels_max, api::kLabelsMax);
  EXPECT_EQ(fixture.jobs.asked_actor, "local");
  EXPECT_EQ(fixture.jobs.asked_revisions, std::nullopt);
  EXPECT_EQ(patch(fixture, R"({"name": null, "labels": {"plate": "8", "old": null}})").status, 200);
  EXPECT_EQ(fixture.jobs.asked_change.name, "");
  const std::map<std::string, std::optional<std::string>> labels = {{"plate", "8"}, {"old", std::nullopt}};
  EXPECT_EQ(fixture.jobs.asked_change.labels, labels);
  EXPECT_EQ(patch(fixture, R"({"labels": null})").status, 200);
  EXPECT_TRUE(fixture.jobs.asked_change.drops_labels);
  EXPECT_EQ(fixture.jobs.asked_change.name, std::nullopt);
  auto response = patch(fixture, "{}");
  EXPECT_EQ(response.status, 200);
  EXPECT_EQ(header(response, "ETag"), tag_of(fixture));
}

TEST(Patch, IfMatchComparesTheRevisionAlone) {
  ApiFixture fixture;
  fixture.jobs.row.revision = 3;
  EXPECT_EQ(patch(fixture, "{}", {{"If-Match", "\"3.999\""}}).status, 200) << "the job may have grown";
  EXPECT_THAT(*fixture.jobs.asked_revisions, ElementsAre(3));
  EXPECT_EQ(patch(fixture, "{}", {{"If-Match", "\"9.1\", \"4.1\""}}).status, 200);
  EXPECT_EQ(patch(fixture, "{}", {{"If-Match", "*"}}).status, 200);
  EXPECT_EQ(fixture.jobs.asked_revisions, std::nullopt);
  for (const char* other : {"\"3.1\"", "W/\"6.1\"", "\"6\"", "\"x\"", "\"06.x\""}) {
    auto refused = patch(fixture, R"({"name": "n"})", {{"If-Match", other}});
    EXPECT_EQ(refused.status, 412) << other;
    EXPECT_EQ(json_of(refused)["type"], "urn:colony:problem:precondition-failed");
    EXPECT_THAT(faults(refused), ElementsAre("If-Match"));
  }
  EXPECT_EQ(patch(fixture, "{}", {{"If-Match", "6.1"}}).status, 400) << "an unreadable condition is not passed over";
  for (const char* command : {"/cancel", "/pause", "/resume"}) {
    EXPECT_EQ(fixture.post(kJob + command, "", {{"If-Match", "\"5.1\""}}).status, 412) << command;
    EXPECT_EQ(fixture.post(kJob + command, "", {{"If-Match", "\"6.1\""}}).status, 202) << command;
  }
  EXPECT_EQ(fixture.ask("DELETE", kJob, {{"If-Match", "\"5.1\""}}).status, 412);
  EXPECT_EQ(fixture.ask("DELETE", kJob, {{"If-Match", "\"6.1\""}}).status, 204);
}

TEST(Patch, EveryWrongMemberIsNamed) {
  struct Case {
    std::string body;
    int status;
    std::vector<std::string> faults;
  };
  const std::string long_name(201, 'n');
  const std::vector<Case> cases = {
      {"", 400, {""}},
      {"[]", 422, {""}},
      {"null", 422, {""}},
      {R"({"name": 1, "labels": []})", 422, {"/name", "/labels"}},
      {R"({"name": ")" + long_name + "\"}", 422, {"/name"}},
      {R"({"labels": {"Big": "x", "ok": 1, "fine": "y", "BAD": null}})", 422, {"/labels/Big", "/labels/ok", "/labels/BAD"}},
      {R"({"state": "failed", "nmae": "x"})", 422, {"/state", "/nmae"}},
      {R"({"name": "a", "name": "b"})", 400, {"/name"}}};
  for (const Case& one : cases) {
    ApiFixture fixture;
    auto response = patch(fixture, one.body);
    EXPECT_EQ(response.status, one.status) << one.body;
    if (one.body.empty()) continue;
    EXPECT_EQ(faults(response), one.faults) << one.body;
    EXPECT_EQ(fixture.jobs.asked_actor, "") << "the service was not asked";
  }
  ApiFixture fixture;
  auto response = patch(fixture, R"({"state": 1, "nmae": 1})");
  EXPECT_THAT(body_of(response), HasSubstr("only name and labels"));
  EXPECT_THAT(body_of(response), HasSubstr("did you mean name?"));
}

TEST(Bodies, OfAnotherTypeAre415AndToldWhatIsTaken) {
  ApiFixture fixture;
  for (const char* type : {"application/json", "text/plain", ""}) {
    auto response = fixture.ask("PATCH", kJob, {{"Content-Type", type}}, "{}");
    EXPECT_EQ(response.status, 415) << type;
    EXPECT_EQ(header(response, "Accept-Patch"), kPatch);
  }
  EXPECT_EQ(header(fixture.ask("POST", "/v1/jobs", {{"Content-Type", "text/plain"}}, "{}"), "Accept-Post"), "application/json");
  EXPECT_EQ(header(fixture.ask("POST", "/v1/analyses", {{"Content-Type", "text/plain"}}, "x"), "Accept-Post"),
            "image/png, image/tiff, image/jpeg");
  auto options = fixture.ask("OPTIONS", kJob);
  EXPECT_EQ(options.status, 204);
  EXPECT_EQ(header(options, "Accept-Patch"), kPatch);
  EXPECT_THAT(header(options, "Allow"), HasSubstr("PATCH"));
  EXPECT_EQ(header(fixture.ask("OPTIONS", "/v1/jobs"), "Accept-Post"), "application/json");
}

TEST(Links, OfAJobBeginWithTheBasePath) {
  api::ApiConfig config = ApiFixture::config();
  config.base_path = "/colony";
  ApiFixture fixture(config);
  const Json job = [&] {
    auto response = fixture.get(kJob);
    return json_of(response);
  }();
  for (const auto& [name, link] : job["links"].items()) EXPECT_EQ(link.get<std::string>().find("/colony" + kJob), 0u) << name;
}

}  // namespace
}  // namespace colony::server::testing
