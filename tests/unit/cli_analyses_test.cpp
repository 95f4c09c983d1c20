// The command line on analyses and comparisons, and the report: whose requests all ask for one moment, and whose page says which.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/report.hpp"
#include "tests/unit/cli_fixture.hpp"

namespace colony::client {
namespace {

using test::FakeConnection;
using test::FakeRequest;
using test::FakeServer;
using test::json_answer;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kOther = "0190aaaa-bbbb-7ccc-8ddd-00000000beef";

std::string row_json(const std::string& id, const std::string& more) {
  return R"({"id":")" + id + R"(","name":"n","state":"succeeded","failure_code":null,"detail":null,"created_at":"2026-01-01T00:00:00Z",)" +
         R"("finished_at":null,)" + more + "}";
}
const std::string kAnalysisMembers = R"("media_type":"image/png","image_bytes":77,"links":{"self":"x"})";

TEST_F(Cli, AnalysesAreListedShownAndDeletedByTheEndOfTheirId) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    const std::string line = request.line();
    if (line.starts_with("DELETE")) return to.send("HTTP/1.1 204 X\r\nConnection: close\r\n\r\n");
    if (line.find("?limit") != std::string::npos) {
      return to.send(json_answer(200, R"({"items":[)" + row_json(kId, kAnalysisMembers) + "," + row_json(kOther, kAnalysisMembers) + R"(],"next":null})"));
    }
    return to.send(json_answer(200, row_json(kOther, kAnalysisMembers + R"(,"result":{"segmentation":{"object_count":36},"verdict":["It follows."]})")));
  });
  use(server);
  EXPECT_EQ(run({"analyses"}), 0) << err();
  EXPECT_THAT(out(), HasSubstr(kOther));
  EXPECT_THAT(out(), HasSubstr("image/png"));
  EXPECT_EQ(run({"analysis", "beef"}), 0) << err();
  EXPECT_THAT(out(), HasSubstr("objects: 36\n- It follows.\n"));
  EXPECT_EQ(run({"delete-analysis", "beef"}), 0) << err();
  EXPECT_EQ(server.requests().back().line(), "DELETE /v1/analyses/" + kOther + " HTTP/1.1");
  EXPECT_EQ(run({"comparisons"}), 0) << err();
  EXPECT_EQ(run({"delete-comparison", "beef"}), 0) << err();
  EXPECT_EQ(server.requests().back().line(), "DELETE /v1/comparisons/" + kOther + " HTTP/1.1");
  EXPECT_EQ(run({"analysis", "0123"}), 4);
  EXPECT_THAT(err(), HasSubstr("no analysis's id ends in '0123'"));
  EXPECT_EQ(run({"analysis", "no"}), 2);
  EXPECT_THAT(err(), HasSubstr("`colony analyses` shows them"));
}

TEST_F(Cli, CompareTakesTheEndOfAnAnalysisId) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    if (request.line().starts_with("GET /v1/analyses")) {
      return to.send(json_answer(200, R"({"items":[)" + row_json(kOther, kAnalysisMembers) + R"(],"next":null})"));
    }
    return to.send(json_answer(422, R"({"title":"stop","status":422})"));
  });
  use(server);
  EXPECT_EQ(run({"compare", kId, "beef"}), 4);
  EXPECT_THAT(server.requests().back().body, HasSubstr(R"("analysis_id":")" + kOther));
}

TEST_F(Cli, MeasureTakesAScale) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) { to.send(json_answer(422, R"({"title":"stop","status":422})")); });
  use(server);
  EXPECT_EQ(run({"measure", kId, "--um-per-px", "0.25"}), 4);
  EXPECT_THAT(server.requests().back().line(), HasSubstr("/analysis?um_per_px=0.25 "));
  EXPECT_EQ(run({"measure", kId, "--width-px", "900"}), 4);
  EXPECT_THAT(server.requests().back().line(), HasSubstr("/analysis?width_px=900 "));
}

TEST_F(Cli, ARefusedPictureIsCalledByItsName) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) {
    to.send(json_answer(422, R"({"title":"Invalid","status":422,"errors":[{"pointer":"","message":"all its pixels are alike"}]})"));
  });
  use(server);
  write_file("white.png", "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(run({"analyze", path("white.png")}), 4);
  EXPECT_THAT(err(), HasSubstr(path("white.png") + ": all its pixels are alike"));
}

Json line_json(bool is_measured) {
  if (!is_measured) {
    return Json::parse(R"({"d0":null,"d0_smallest_cover":null,"d1":null,"finding":"no_figures","crossover":null,"curve":[],"local_slopes":[],"reason":"too few sides"})");
  }
  return Json::parse(R"({"d0":{"value":1.511,"se":0.01,"r2":0.999,"range_px":[3,60]},"d0_smallest_cover":{"value":1.522},"d1":{"value":1.533},
    "finding":"wandering","crossover":{"found":true},"curve":[{"side_px":3,"count_mean":10}],"local_slopes":[],"reason":null})");
}

/// Members that the page shows and the rest of an answer need not have.
Json analysis_json() {
  const Json lines = {{"walls", line_json(true)}, {"outline", line_json(false)}};
  Json control = lines;
  control["name"] = "hexagonal";
  const Json classes = Json::parse(R"([{"sides":4,"count":3,"share":0.1,"gibson_share":0.0},{"sides":5,"count":9,"share":0.3,"gibson_share":0.289}])");
  Json sides = {{"other_count", 2}, {"classes", classes}, {"sides_mean", 4.83}, {"difference_max", 0.2}, {"chi_square", nullptr}, {"degrees", 0}, {"p_value", 0.0001}};
  Json given = sides;
  given.update({{"hole_count", 198}, {"hole_px", 1024}, {"hole_max_px", 300}, {"sides_mean", 5.91}, {"p_value", 0.74}});
  sides["interior_count"] = 95;
  sides["not_judged"] = "80 of 97 are hidden";
  sides["holes_given"] = given;
  return {{"time_h", 50.0}, {"last_seq", 41}, {"digest", "digest-of-50-h"}, {"cell_count", 97}, {"visible_cell_count", 17}, {"um_per_px", 0.0625}, {"px_per_cell_diameter", 31.5},
          {"fractal", lines}, {"controls", {control}}, {"verdict", {"It follows."}}, {"neighbours", sides},
          {"colony", {{"area_px", 5}}}, {"cells", {{"measured_count", 15}, {"area_px", {{"mean", 800.5}, {"sd", 1}, {"min", 790}, {"max", 810}}}, {"solidity", nullptr}}}, {"apart", {{"share", 0}}}, {"packing", {{"void_share", 0.00022239622863492336}, {"union_um3", 81234.5678}, {"reason", nullptr}}},
          {"growth", {{"lag", nullptr}, {"exponential", {{"from_h", 0.0}, {"to_h", 65.25}, {"row_count", 40}, {"doubling_time_h", 14.876543}, {"low", 14.1}, {"high", nullptr}, {"r2", 0.99}}}, {"reason", nullptr}}}, {"sibling_straightness", {{"difference", 0.0123}, {"t", 2.5}}},
          {"rings", {{{"inner_px", 0}, {"outer_px", 10.5}, {"cell_count", 4}, {"covered_px", 300}, {"area_mean_px", 75}, {"area_se_px", 2.25},
                      {"density_per_px", 0.013333}, {"active_share", nullptr}}}}};
}

Json report_job_json() {
  return Json::parse(R"({"id":")" + kId + R"(","name":"n","state":"running","reason":null,"created_at":"x","finished_at":null,"engine_version":"1",
    "last_seq":99,"digest":"digest-of-now","spec":{"a":{"b":1}},
    "progress":{"time_h":77.25,"cells":60,"active":60,"passive":0,"senescent":0,"fraction":0.5}})");
}

TEST_F(Cli, AReportAsksForOneMoment) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    const std::string line = request.line();
    if (line.find("/image?") != std::string::npos) return to.send(test::answer(200, "image/png", "png"));
    if (line.find("/analysis?") != std::string::npos) return to.send(json_answer(200, analysis_json().dump()));
    if (line.find("/series") != std::string::npos) return to.send(json_answer(200, R"({"items":[]})"));
    return to.send(json_answer(200, report_job_json().dump()));
  });
  use(server);
  for (const std::string& wanted : {std::string("50"), std::string()}) {
    std::vector<std::string> arguments = {"report", kId};
    if (!wanted.empty()) arguments.insert(arguments.end(), {"--at-h", wanted});
    ASSERT_EQ(run(arguments), 0) << err();
    const std::string expected = "at_h=" + (wanted.empty() ? std::string("77.25") : wanted);  // of a job that goes on: as it was first seen
    const auto requests = server.requests();
    ASSERT_GE(requests.size(), 7u);
    for (std::size_t i = requests.size() - 5; i < requests.size(); ++i) EXPECT_THAT(requests[i].line(), HasSubstr(expected));
  }
}

/// Cells of each row, a colspan counted as so many.
std::vector<int> columns_of(const std::string& table) {
  std::vector<int> columns;
  for (std::size_t row = table.find("<tr>"); row != std::string::npos; row = table.find("<tr>", row + 1)) {
    const std::string text = table.substr(row, table.find("</tr>", row) - row);
    int count = 0;
    for (std::size_t at = 0; (at = text.find_first_of('<', at)) != std::string::npos; ++at) {
      if (text.compare(at, 3, "<td") != 0 && text.compare(at, 3, "<th") != 0) continue;
      const std::size_t span = text.find("colspan=", at);
      count += span < text.find('>', at) ? std::stoi(text.substr(span + 8)) : 1;
    }
    columns.push_back(count);
  }
  return columns;
}

TEST(ReportPage, SaysOfWhichMomentItIsAndLeavesNothingOut) {
  const std::string html = report_html({report_job_json(), Json::array(), analysis_json(), {{"phase", "png"}}});
  EXPECT_THAT(html, HasSubstr("The colony at 50.0 h"));
  EXPECT_THAT(html, HasSubstr("<th>digest</th><td><code>digest-of-50-h"));
  EXPECT_THAT(html, HasSubstr("<th>latest digest</th><td><code>digest-of-now"));
  EXPECT_THAT(html, HasSubstr("<th>cells</th><td>97</td></tr><tr><th>cells seen from above</th><td>17<"));
  EXPECT_THAT(html, HasSubstr("<th>latest cells</th><td>60"));
  EXPECT_THAT(html, Not(HasSubstr("<th>cells</th><td>60")));
  for (const char* member : {"0.0625 um a pixel", "1.969 um", "1.511", "1.522", "1.533", "0.0123", "4.83", "5.91", "0.74", "0.0001", "198", "too few sides", "no clear scaling",
                             "80 of 97 are hidden", "void share of that volume</th><td>0.000222<", "81235 um3", "14.88 h", "65.25 h",
                             "<td class=n>0.656</td>", "cells per um2", "<td class=n>3.413</td>", "<td>14.1 and more</td>", "<td class=n>3.127 um2</td>"}) {
    EXPECT_THAT(html, HasSubstr(member));
  }
  EXPECT_THAT(html, Not(HasSubstr("null")));
  EXPECT_THAT(html, Not(HasSubstr("81234.5678")));
  int tables = 0;
  for (std::size_t at = html.find("<table>"); at != std::string::npos; at = html.find("<table>", at + 1), ++tables) {
    const std::vector<int> columns = columns_of(html.substr(at, html.find("</table>", at) - at));
    ASSERT_FALSE(columns.empty());
    for (const int count : columns) EXPECT_EQ(count, columns.front()) << html.substr(at, 300);
  }
  EXPECT_GE(tables, 7);
}

}  // namespace
}  // namespace colony::client
