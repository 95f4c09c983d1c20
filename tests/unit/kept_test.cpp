// Kept answers: found are the bytes that were made; the bound on them; what needs no work at all; and that work obeys the end of the server.
#include "server/api/kept.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/picture_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;

http::Response answer(const std::string& body) {
  http::Response response;
  response.headers.set("Content-Type", "image/png");
  response.body = body;
  return response;
}

TEST(Kept, ThoseUsedLastStayWithinTheBound) {
  api::KeptAnswers kept(100, 10);
  EXPECT_FALSE(kept.find("\"a\""));
  kept.keep("\"a\"", {}, answer(std::string(40, 'a')));
  kept.keep("\"b\"", {}, answer(std::string(40, 'b')));
  ASSERT_TRUE(kept.find("\"a\"")) << "now used last";
  kept.keep("\"c\"", {}, answer(std::string(40, 'c')));
  EXPECT_FALSE(kept.find("\"b\""));
  const auto found = kept.find("\"a\"");
  ASSERT_TRUE(found && kept.find("\"c\""));
  EXPECT_EQ(found->body, std::string(40, 'a'));
  EXPECT_EQ(found->status, 200);
  EXPECT_EQ(header(*found, "Content-Type"), "image/png");
  EXPECT_EQ(header(*found, "ETag"), "\"a\"");
  EXPECT_EQ(header(*found, "Cache-Control"), "private, no-cache");
  kept.keep("\"large\"", {}, answer(std::string(101, 'l')));
  EXPECT_FALSE(kept.find("\"large\""));
  EXPECT_TRUE(kept.find("\"a\"") && kept.find("\"c\"")) << "not thrown out for what is not kept";
  kept.keep("\"a\"", {}, answer(std::string(40, 'a')));  // two made it at once
  kept.keep("\"d\"", {}, answer(std::string(20, 'd')));
  EXPECT_TRUE(kept.find("\"a\"") && kept.find("\"c\"") && kept.find("\"d\"")) << "counted once: 100 bytes";
  kept.keep("\"all\"", {}, answer(std::string(100, 'e')));
  EXPECT_TRUE(kept.find("\"all\""));
  EXPECT_FALSE(kept.find("\"d\""));
}

TEST(Kept, AreSoManyAtMostHoweverSmall) {
  api::KeptAnswers kept(1000, 3);
  const auto tag = [](int number) { return '"' + std::to_string(number) + '"'; };
  for (int i = 0; i < 100; ++i) {
    kept.keep(tag(i), {}, answer(i % 2 == 0 ? "" : "x"));
    EXPECT_TRUE(kept.find(tag(0))) << "used last, each time";
  }
  EXPECT_TRUE(kept.find(tag(99)) && kept.find(tag(98)));
  EXPECT_FALSE(kept.find(tag(97)));
}

TEST(Kept, WhatWasMadeOfSomethingGoesWithIt) {
  api::KeptAnswers kept(100, 10);
  kept.keep("\"step\"", {"analysis"}, answer(std::string(40, 's')));
  kept.keep("\"figure\"", {"comparison", "analysis"}, answer(std::string(40, 'f')));
  kept.keep("\"other\"", {"another"}, answer(std::string(20, 'o')));
  kept.drop("comparison");
  EXPECT_FALSE(kept.find("\"figure\""));
  EXPECT_TRUE(kept.find("\"step\"") && kept.find("\"other\""));
  kept.keep("\"figure\"", {"comparison", "analysis"}, answer(std::string(40, 'f')));
  kept.drop("analysis");
  EXPECT_FALSE(kept.find("\"figure\"") || kept.find("\"step\""));
  kept.drop("never there");
  kept.keep("\"large\"", {}, answer(std::string(80, 'l')));
  EXPECT_TRUE(kept.find("\"large\"") && kept.find("\"other\"")) << "its bytes went, too: there is room for 80";
}

/// The server is told to end: whatever still has to be made is now 503. So what is not is an answer without work.
TEST(Kept, StepsObjectsAndFiguresAreSettledByTheirTagOrFoundWithoutWork) {
  ApiFixture fixture;
  auto sent = send_picture(fixture, discs_png(6, 9), "?pipeline=nuclei&um_per_px=0.05");
  const Json analysis = json_of(sent);
  auto compared = fixture.post("/v1/comparisons", api::to_text({{"job_id", kJobId}, {"analysis_id", analysis["id"]}}));
  ASSERT_EQ(compared.status, 201) << compared.body;
  const std::string self = analysis["links"]["self"], steps = self + "/steps/";
  const std::vector<std::string> names{analysis["result"]["steps"][0]["name"], analysis["result"]["steps"][1]["name"]};
  struct Row {
    std::string made, other;  // two answers of one handler
    std::vector<std::pair<std::string, std::string>> other_headers;
  };
  const std::string figure = json_of(compared)["links"]["figure"];
  const std::vector<Row> rows{{steps + names[0], steps + names[1], {}}, {self + "/objects", self + "/objects", {{"Accept", "text/csv"}}}, {figure, "", {}}};
  std::vector<http::Response> before;
  for (const Row& row : rows) before.push_back(fixture.get(row.made));
  fixture.api().drain();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const std::string tag = header(before[i], "ETag");
    ASSERT_EQ(before[i].status, 200) << row.made;
    fixture.jobs.folds = 0;
    EXPECT_EQ(fixture.get(row.made, {{"If-None-Match", tag}}).status, 304) << row.made;
    auto head = fixture.ask("HEAD", row.made);
    EXPECT_EQ(head.status, 200);
    EXPECT_EQ(header(head, "ETag"), tag);
    auto again = fixture.get(row.made);
    ASSERT_EQ(again.status, 200) << row.made << " was kept";
    EXPECT_EQ(again.body, before[i].body);
    for (const char* name : {"Content-Type", "ETag", "Cache-Control", "Vary"}) EXPECT_EQ(header(again, name), header(before[i], name)) << name;
    EXPECT_EQ(fixture.jobs.folds, 0) << row.made;
    if (!row.other.empty()) {
      EXPECT_EQ(fixture.get(row.other, row.other_headers).status, 503) << row.other;
      auto other_head = fixture.ask("HEAD", row.other, row.other_headers);
      EXPECT_EQ(other_head.status, 200) << "its tag needs no work";
      auto headers = row.other_headers;
      headers.emplace_back("If-None-Match", header(other_head, "ETag"));
      EXPECT_EQ(fixture.get(row.other, headers).status, 304) << row.other;
    }
  }
  // Gone is gone, also what is kept.
  EXPECT_EQ(fixture.ask("DELETE", self).status, 204);
  for (const Row& row : rows) EXPECT_EQ(fixture.get(row.made).status, 404) << row.made;
}

TEST(Kept, AFigureObeysTheEndOfTheServer) {
  ApiFixture fixture;
  auto sent = send_picture(fixture, discs_png(6, 9), "?pipeline=nuclei");
  auto compared = fixture.post("/v1/comparisons", api::to_text({{"job_id", kJobId}, {"analysis_id", json_of(sent)["id"]}}));
  const std::string figure = json_of(compared)["links"]["figure"];
  fixture.api().drain();
  EXPECT_EQ(fixture.get(figure).status, 503);
}

TEST(Kept, WhatTakesLongHoldsAtMostHalfOfTheWorkers) {
  for (const char* operation : {"drawStep", "listObjects", "drawComparison", "analyseImage", "compare"}) {
    const auto all = api::endpoints();
    const auto at = std::find_if(all.begin(), all.end(), [&](const api::Endpoint& one) { return one.operation_id == operation; });
    ASSERT_NE(at, all.end()) << operation;
    EXPECT_TRUE(at->is_heavy) << operation;
  }
}

}  // namespace
}  // namespace colony::server::testing
