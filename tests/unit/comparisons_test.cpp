// The handlers of comparisons: what is matched with what, over which boxes, and what is refused.
#include "server/api/compare.hpp"

#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/controls.hpp"
#include "tests/unit/picture_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Json compared(ApiFixture& fixture, const Json& analysis, Json options = Json::object()) {
  options.update({{"job_id", kJobId}, {"analysis_id", analysis["id"]}});
  auto response = fixture.post("/v1/comparisons", api::to_text(options));
  EXPECT_EQ(response.status, 201) << response.body;
  return json_of(response);
}

TEST(Comparisons, MatchNucleiWithNucleiAndSayWhatWasMatched) {
  ApiFixture fixture;
  auto sent = send_picture(fixture, discs_png(6, 9), "?pipeline=nuclei&um_per_px=0.05");
  const Json analysis = json_of(sent);
  EXPECT_EQ(analysis["result"]["object_kind"], "nuclei");
  const Json made = compared(fixture, analysis);
  const Json &simulated = made["result"]["simulated"], &real = made["result"]["real"];
  EXPECT_EQ(simulated["object_kind"], "nuclei");
  EXPECT_NEAR(simulated["object_area_mean_px"].get<double>() / real["object_area_mean_px"].get<double>(), 1.0, 0.02);
  EXPECT_EQ(simulated["controls"].size(), 2u);  // a nucleus has no noise to be without
  EXPECT_EQ(real["controls"].size(), 2u);
  EXPECT_EQ(real["controls"][0]["placement"], "spread");
  EXPECT_EQ(made["options"]["match"], "object_area");
  EXPECT_EQ(made["result"]["match"]["of"], "nuclei");
  const std::string words = made["result"]["verdict"].dump();
  EXPECT_THAT(words, HasSubstr("Matched by area: a nucleus of the colony has"));
  EXPECT_THAT(words, HasSubstr("Nuclei are compared with nuclei"));
  EXPECT_THAT(words, HasSubstr("The outlines of the nuclei: simulated "));
  EXPECT_THAT(words, HasSubstr("the range that both have"));
  EXPECT_EQ(made["result"]["differences"]["walls"]["range_px"], made["result"]["simulated"]["fractal"]["walls"]["d0"]["range_px"]);
  EXPECT_EQ(made["result"]["differences"]["walls"]["range_px"], real["fractal"]["walls"]["d0"]["range_px"]);
  EXPECT_THAT(words, HasSubstr("The picture. What follows for the outlines of the nuclei"));
  EXPECT_EQ(real["threshold_sweep"]["rows"].size(), 9u);
  auto figure = fixture.get(made["links"]["figure"].get<std::string>());
  EXPECT_EQ(figure.status, 200);
  EXPECT_THAT(figure.body, StartsWith("\x89PNG"));
  EXPECT_EQ(figure.body.find("pHYs"), std::string::npos) << "a figure has no size of a pixel";
  // What a cell has is stated: then cells are matched, and nuclei counted all the same.
  const Json stated = compared(fixture, analysis, {{"cell_area_px", 4000}});
  EXPECT_EQ(stated["result"]["match"]["of"], "cells");
  EXPECT_LT(stated["result"]["simulated"]["object_area_mean_px"].get<double>(), 2000.0);
  // The picture's own scale.
  const Json scaled = compared(fixture, analysis, {{"match", "um_per_px"}});
  EXPECT_EQ(scaled["result"]["simulated"]["um_per_px"], 0.05);
  EXPECT_THAT(scaled["result"]["verdict"][0].get<std::string>(), StartsWith("Matched by scale"));
  // What the figure is made of goes: the result stays, the link does not.
  EXPECT_EQ(fixture.ask("DELETE", analysis["links"]["self"].get<std::string>()).status, 204);
  auto left = fixture.get(made["links"]["self"].get<std::string>());
  EXPECT_TRUE(json_of(left)["links"]["figure"].is_null()) << left.body;
  auto list = fixture.get("/v1/comparisons?limit=5");
  const Json items = json_of(list)["items"];  // named: a loop does not keep what it calls [] on
  ASSERT_EQ(items.size(), 3u);
  for (const Json& shown : items) EXPECT_TRUE(shown["links"]["figure"].is_null());
}

TEST(Comparisons, WarnWhereAnObjectIsNotKnownToBeACell) {
  ApiFixture fixture;
  auto sent = send_picture(fixture, discs_png(6, 9));
  const Json analysis = json_of(sent);
  const std::string kind = analysis["result"]["object_kind"];
  EXPECT_TRUE(kind == "objects" || kind == "regions") << kind;
  const Json made = compared(fixture, analysis);
  EXPECT_THAT(made["result"]["verdict"].dump(), HasSubstr("Warning: "));
  EXPECT_EQ(made["result"]["simulated"]["object_kind"], "cells");
  EXPECT_EQ(made["result"]["real"]["object_kind"], kind);
  const double real = made["result"]["real"]["object_area_mean_px"];
  EXPECT_NEAR(made["result"]["simulated"]["object_area_mean_px"].get<double>() / real, 1.0, 0.02);
  // 36 objects that are 144 cells: a quarter of the pixels a cell, and nothing left to warn of.
  const Json counted = compared(fixture, analysis, {{"cell_count", 144}});
  EXPECT_NEAR(counted["result"]["simulated"]["object_area_mean_px"].get<double>() / real, 0.25, 0.02);
  EXPECT_EQ(counted["result"]["verdict"].dump().find("Warning: "), std::string::npos);
  auto none = fixture.post("/v1/comparisons", api::to_text({{"job_id", kJobId}, {"analysis_id", analysis["id"]}, {"match", "um_per_px"}}));
  EXPECT_EQ(none.status, 422);
  EXPECT_THAT(faults(none), ElementsAre("/match"));
  for (const auto& [options, pointer] : std::vector<std::pair<Json, const char*>>{{{{"cell_count", 0}}, "/cell_count"},
                                                                                  {{{"cell_count", 1.5}}, "/cell_count"},
                                                                                  {{{"cell_area_px", 0.5}}, "/cell_area_px"},
                                                                                  {{{"cell_area_px", 9}, {"cell_count", 9}}, "/cell_area_px"},
                                                                                  {{{"match", "by eye"}}, "/match"},
                                                                                  {{{"match", "um_per_px"}, {"cell_count", 9}}, "/match"}}) {
    Json body = options;
    body.update({{"job_id", kJobId}, {"analysis_id", analysis["id"]}});
    auto refused = fixture.post("/v1/comparisons", api::to_text(body));
    EXPECT_EQ(refused.status, 422) << body;
    EXPECT_THAT(faults(refused), ElementsAre(pointer)) << body;
  }
}

/// One lattice seen whole and through a window: over their own ranges its slopes differ, since boxes beyond a cell's size see the plane; over the
/// range of both they are alike.
TEST(Comparisons, AreJudgedOverTheBoxesThatBothHave) {
  const LabelImage whole = *hexagonal_control(std::vector<LabelArea>(169, {1, 5000}));
  LabelImage window(240, 240);
  for (std::int64_t row = 0; row < 240; ++row) {
    for (std::int64_t column = 0; column < 240; ++column) {
      window.at(row, column) = whole.at(row + whole.height_px / 2 - 120, column + whole.width_px / 2 - 120);
    }
  }
  const LineReport large = analyse_lines(whole, 0, {}), small = analyse_lines(window, 0, {});
  ASSERT_TRUE(large.walls.dimensions && small.walls.dimensions);
  ASSERT_TRUE(dimensions_differ(large.walls.dimensions->capacity, small.walls.dimensions->capacity)) << "the mistake to be caught";
  api::ComparedSide a, b;
  api::judge_common_range(large, {{"hexagonal", large}}, ObjectKind::kCells, small, {{"hexagonal", small}}, ObjectKind::kCells, a, b);
  ASSERT_TRUE(a.lines.walls.dimensions && b.lines.walls.dimensions);
  EXPECT_EQ(a.lines.walls.dimensions->side_max_px, small.walls.dimensions->side_max_px);
  EXPECT_EQ(b.lines.walls.dimensions->counts, small.walls.dimensions->counts);
  EXPECT_FALSE(dimensions_differ(a.lines.walls.dimensions->capacity, b.lines.walls.dimensions->capacity));
  EXPECT_EQ(a.controls[0].lines.walls.dimensions->side_max_px, small.walls.dimensions->side_max_px);
  EXPECT_EQ(a.findings.walls.finding, Finding::kShortRange);
  // Where a side has no figures the other keeps its own.
  api::ComparedSide c, d;
  api::judge_common_range(large, {}, ObjectKind::kCells, {{{}, "too few"}, {{}, "too few"}}, {}, ObjectKind::kNuclei, c, d);
  EXPECT_EQ(c.lines.walls.dimensions->side_max_px, large.walls.dimensions->side_max_px);
  EXPECT_EQ(d.lines.walls.reason, "too few");
}

TEST(Comparisons, RefuseWhatIsWrong) {
  ApiFixture fixture;
  auto sent = send_picture(fixture, discs_png(6, 9), "?pipeline=nuclei");
  const Json analysis = json_of(sent);
  auto wrong = fixture.post("/v1/comparisons", R"({"job_id":"x","at_h":-1,"colour":1})");
  EXPECT_EQ(wrong.status, 422);
  EXPECT_THAT(faults(wrong), ElementsAre("/at_h", "/colour", "/analysis_id"));
  auto nobody = fixture.post("/v1/comparisons", R"({"job_id":"x","analysis_id":"y"})");
  EXPECT_EQ(nobody.status, 422) << "the resource is there, what it names is not";
  EXPECT_THAT(faults(nobody), ElementsAre("/analysis_id"));
  auto no_job = fixture.post("/v1/comparisons",
                             api::to_text({{"job_id", "x"}, {"analysis_id", analysis["id"]}}));
  EXPECT_EQ(no_job.status, 422);
  EXPECT_THAT(faults(no_job), ElementsAre("/job_id"));
  auto too_early = fixture.post("/v1/comparisons", api::to_text({{"job_id", kJobId}, {"analysis_id", analysis["id"]}, {"at_h", 9e6}}));
  EXPECT_EQ(too_early.status, 409) << too_early.body;
  EXPECT_THAT(faults(too_early), ElementsAre("/at_h"));
  auto list = fixture.get("/v1/comparisons");
  EXPECT_EQ(json_of(list)["items"].size(), 0u) << "nothing was stored";
}

TEST(Comparisons, OfALargeColonyPictureAreWorkedOnLaterThoughThePhotographIsSmall) {
  ApiFixture fixture;
  // One ring that encloses half a million pixels: at so many a cell, six cells take millions.
  std::vector<std::uint8_t> rows(900 * 900, 255);
  for (int y = 0; y < 900; ++y) {
    for (int x = 0; x < 900; ++x) {
      const int distance2 = (x - 450) * (x - 450) + (y - 450) * (y - 450);
      if (distance2 <= 421 * 421 && distance2 >= 419 * 419) rows[static_cast<std::size_t>(900 * y + x)] = 0;
    }
  }
  auto sent = send_picture(fixture, colony::testing::png_file(900, 900, {}, rows));
  ASSERT_EQ(sent.status, 201) << sent.body;
  const Json analysis = json_of(sent);
  auto response = fixture.post("/v1/comparisons", api::to_text({{"job_id", kJobId}, {"analysis_id", analysis["id"]}}));
  ASSERT_EQ(response.status, 202) << response.body;
  EXPECT_EQ(json_of(response)["state"], "queued");
}

TEST(Comparisons, TheEstimateOfTheirSizeIsThatOfTheFrame) {
  const FakeJobs jobs;
  Colony colony(jobs.spec.params);
  for (const Event& event : jobs.history) colony.apply(event);
  PictureSpec spec;
  api::Match match;
  match.area_px = 4000.0;
  spec.um_per_px = *api::matched_scale(colony, match, {});
  const auto frame = frame_of(colony, spec);
  ASSERT_TRUE(frame);
  const auto pixels = static_cast<double>(frame->width_px * frame->height_px);
  const auto estimate = static_cast<double>(api::compared_px_estimate(colony, match));
  EXPECT_GT(estimate, 0.6 * pixels);
  EXPECT_LT(estimate, 1.3 * pixels);
}

}  // namespace
}  // namespace colony::server::testing
