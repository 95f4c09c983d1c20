// What the command line makes of measurements: text for people, tables, pages and files, from answers that are fixed here.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/cli/report_facts.hpp"
#include "tests/unit/cli_fixture.hpp"

namespace colony::client {
namespace {

using nlohmann::json;
using test::FakeConnection;
using test::FakeRequest;
using test::FakeServer;
using test::json_answer;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kPng("\x89PNG\0x", 6);
const std::string kAnalysis = "0190aaaa-bbbb-7ccc-8ddd-00000000abcd";

json dimension(double value) { return {{"value", value}, {"se", 0.037}, {"r2", 0.993}, {"range_px", {3, 96}}}; }
json line(double value, bool is_crossover) {
  return {{"d0", dimension(value)},
          {"d0_smallest_cover", dimension(value + 0.01)},
          {"d1", dimension(value - 0.01)},
          {"finding", is_crossover ? "crossover" : "short_range"},
          {"crossover", {{"found", true}}},  // the drift alone: no label is made of it
          {"curve", {{{"side_px", 3}, {"count_mean", 900.5}}, {{"side_px", 96}, {"count_mean", 8.25}}}},
          {"reason", nullptr}};
}
json measured_lines() {
  return {{"fractal", {{"walls", line(1.437, true)}, {"outline", line(1.09, false)}}},
          {"controls", {{{"name", "hexagonal"}, {"walls", line(1.44, true)}, {"outline", line(1.01, false)}}}},
          {"verdict", {"The cell walls: a crossover, not <scaling>."}}};
}
json job_analysis() {
  json out = measured_lines();
  const json classes = {{{"sides", 6}, {"count", 50}, {"share", 0.46}, {"gibson_share", 0.464}}};
  json seen = {{"classes", classes}, {"other_count", 3}, {"sides_mean", 5.5}, {"difference_max", 0.1}, {"chi_square", 9.0}, {"degrees", 4}, {"p_value", 0.06}};
  json given = seen;
  given.update(json{{"hole_count", 7}, {"hole_px", 90}, {"hole_max_px", 30}});
  seen.update(json{{"interior_count", 50}, {"holes_given", given}, {"not_judged", nullptr}});
  out.update(json{{"time_h", 200.0}, {"last_seq", 9}, {"digest", "abc123"}, {"um_per_px", 0.5}, {"px_per_cell_diameter", 30.0}, {"cell_count", 180}, {"visible_cell_count", 180}, {"colony", {{"area_um2", 1.0}}}, {"cells", json::object()},
                  {"apart", json::object()}, {"packing", json::object()}, {"growth", json::object()},
                  {"sibling_straightness", json::object()}, {"rings", json::array()}, {"neighbours", seen}});
  return out;
}
json picture_analysis() {
  json result = measured_lines();
  const json row = {{"threshold", 60}, {"walls", {{"d0", dimension(1.31)}, {"finding", "crossover"}, {"crossover", false}, {"reason", nullptr}}},
                    {"outline", {{"d0", nullptr}, {"finding", "no_figures"}, {"crossover", nullptr}, {"reason", "has no foreground"}}}};
  result["threshold_sweep"] = {{"sides_px", {3, 96}}, {"rows", {row}}};
  result["segmentation"] = {{"object_count", 315}, {"pipeline", "nuclei"}, {"pipeline_reason", "chosen: an even ground"}, {"threshold", 64},
                            {"area_mean_px", 150.25}, {"foreground_share", 0.25}, {"foreground", "light"}, {"foreground_reason", "asked for"},
                            {"sweep", json::array()}, {"doubt", "Warning: there may be nothing in this picture."}, {"hole_max_px", 90}, {"area_mean_um2", 63.48}, {"density_per_mm2", nullptr}};
  result["object_kind"] = "nuclei";
  result["object_count"] = 315;
  result["verdict"].insert(result["verdict"].begin(), "Warning: there may be nothing in this picture.");
  result["image"] = {{"um_per_px", 0.65}, {"um_per_px_source", "ome"}, {"notes", {"one <note>"}}};
  result["steps"] = {{{"name", "grey"}}, {{"name", "overlay"}}};
  return {{"id", kAnalysis}, {"name", "HT29"}, {"state", "succeeded"}, {"created_at", "2026-01-02T03:04:05Z"}, {"media_type", "image/tiff"},
          {"image_bytes", 7}, {"result", result},
          {"links", {{"self", "/v1/analyses/" + kAnalysis}, {"steps", "/v1/analyses/" + kAnalysis + "/steps"},
                     {"objects", "/v1/analyses/" + kAnalysis + "/objects"}}}};
}

TEST_F(Cli, ReportIsOnePageWithEverythingInIt) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    const std::string asked = request.line();
    json job = json::parse(job_json("succeeded"));
    job.update(json{{"name", "<b>plate</b>"}, {"created_at", "c"}, {"finished_at", "f"}, {"engine_version", "1"}, {"last_seq", 9},
                    {"spec", {{"seed", 4}}}});
    job["progress"].update(json{{"active", 1}, {"passive", 2}, {"senescent", 0}});
    if (asked.find("/image?") != asked.npos) return to.send(test::answer(200, "image/png", kPng));
    if (asked.find("/analysis?at_h=150") != asked.npos) return to.send(json_answer(200, job_analysis().dump()));
    if (asked.find("/series") != asked.npos) {
      return to.send(json_answer(200, R"({"items":[{"time_h":0,"cell_count":1,"active_count":1,"radius_um":5}],"next":null})"));
    }
    to.send(json_answer(200, job.dump()));
  });
  use(server);
  EXPECT_EQ(run({"report", kId, "--at-h", "150", "-o", path("r.html")}), 0) << err();
  const std::string page = read_file("r.html");
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;plate&lt;/b&gt;"));
  EXPECT_THAT(page, HasSubstr("a crossover, not &lt;scaling&gt;."));
  EXPECT_THAT(page, HasSubstr("<td class=n>1.437</td><td class=n>0.037</td>"));
  EXPECT_THAT(page, HasSubstr("control hexagonal, colony outline"));
  EXPECT_THAT(page, HasSubstr("too small a range for a finding"));
  EXPECT_THAT(page, HasSubstr("src=\"data:image/png;base64,iVBORwB4\""));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("abc123"));  // the digest
  EXPECT_EQ(run({"report", kId, "--json"}), 2);
  EXPECT_EQ(run({"report", kId, "-o", path("absent/r.html")}), 2);
}

TEST_F(Cli, AnalyzeTellsTheChoicesTheSweepAndWhatFollows) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    const std::string asked = request.line();
    if (asked.find("/steps/") != asked.npos) return to.send(test::answer(200, "image/png", kPng));
    if (asked.find("/objects") != asked.npos) return to.send(test::answer(200, "text/csv", "object_id,area_px\r\n1,9\r\n"));
    to.send(json_answer(201, picture_analysis().dump()));
  });
  use(server);
  write_file("p.tif", std::string("II*\0abc", 7));
  EXPECT_EQ(run({"analyze", path("p.tif"), "--objects", path("o.csv"), "--html", path("a.html"), "--foreground", "light"}), 0) << err();
  EXPECT_EQ(server.requests().at(0).line(), "POST /v1/analyses?foreground=light HTTP/1.1");
  EXPECT_EQ(server.requests().at(0).header("Content-Type"), "image/tiff");
  EXPECT_THAT(out(), HasSubstr("315 nuclei (nuclei, threshold 64)"));
  EXPECT_THAT(out(), HasSubstr("pipeline nuclei, chosen: an even ground\nforeground light, asked for\n"));
  EXPECT_THAT(out(), HasSubstr("scale 0.6500 um a pixel, by the file's OME metadata\nnote: one <note>\n"));
  EXPECT_THAT(out(), HasSubstr("outlines of the nuclei: D0 1.44 (se 0.037, boxes of 3 to 96 px, a crossover, not scaling)\n"));
  EXPECT_THAT(out(), HasSubstr("outer outline: D0 1.09 (se 0.037, boxes of 3 to 96 px, too small a range for a finding)\n"));
  EXPECT_THAT(out(), HasSubstr("  threshold 60: outlines of the nuclei D0 1.31 (se 0.037, boxes of 3 to 96 px, a crossover, not scaling), outer outline D0 none: has no "
                               "foreground\n"));
  EXPECT_THAT(out(), HasSubstr("against the threshold, in one grid from the frame's corner"));
  const std::size_t told = out().find("Warning: there may be nothing");
  EXPECT_LT(told, out().find("outer outline: D0")) << "before the figures";
  EXPECT_EQ(out().find("Warning: ", told + 1), std::string::npos) << "and once";
  EXPECT_THAT(out(), HasSubstr("- The cell walls: a crossover"));
  EXPECT_EQ(read_file("o.csv"), "object_id,area_px\r\n1,9\r\n");
  const std::size_t before = server.requests().size();
  EXPECT_EQ(run({"analyze", path("p.tif"), "--no-split", "--area-min-px", "9", "--hole-max-px", "2000", "--background-reach-px", "60", "--window-radius-px", "5"}),
            0) << err();
  EXPECT_EQ(server.requests().at(before).line(),
            "POST /v1/analyses?area_min_px=9&hole_max_px=2000&background_reach_px=60&window_radius_px=5&split=false HTTP/1.1");
  const std::string page = read_file("a.html");
  EXPECT_THAT(page, HasSubstr("Against the threshold"));
  EXPECT_THAT(page, HasSubstr("<td class=n>60</td><td class=n>1.310</td>"));
  EXPECT_THAT(page, HasSubstr("has no foreground"));
  EXPECT_THAT(page, HasSubstr("one &lt;note&gt;"));
  // Nobody saw walls of cells or a colony: legend, tables and sweep call the lines what the sentences call them.
  EXPECT_THAT(page, HasSubstr(">outlines of the nuclei</text>"));
  EXPECT_THAT(page, HasSubstr("<th>outlines of the nuclei: D0</th>"));
  EXPECT_THAT(page, HasSubstr("<th>control hexagonal, outlines of the nuclei</th>"));
  const std::string own = page.substr(page.find("</ul>"));  // the fake server's sentence speaks of walls
  EXPECT_THAT(own, Not(HasSubstr("cell walls")));
  EXPECT_THAT(own, Not(HasSubstr("colony outline")));
  // Sizes in um, what is in both units once, and no row of nulls.
  EXPECT_THAT(page, HasSubstr("largest hole given away</th><td>38.03 um2"));
  EXPECT_THAT(page, HasSubstr("mean area</th><td>63.48 um2"));
  EXPECT_THAT(page, Not(HasSubstr("150.25")));
  EXPECT_THAT(page, HasSubstr("um a pixel</th><td>0.65<"));
  EXPECT_THAT(page, Not(HasSubstr("null")));
  EXPECT_THAT(page, HasSubstr("in one grid from the frame's corner"));
}

TEST_F(Cli, CompareShowsBothSidesAndKeepsTheFigure) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    if (request.line().find("/figure") != std::string::npos) return to.send(test::answer(200, "image/png", kPng));
    json side = measured_lines();
    side.update(json{{"object_kind", "regions"}, {"object_count", 180}, {"object_area_mean_px", 1963.4}});
    const json result = {{"simulated", side}, {"real", side}, {"verdict", {"no difference that box counting could show"}}};
    to.send(json_answer(201, json{{"id", "c-1"}, {"state", "succeeded"}, {"result", result}, {"links", {{"figure", "/v1/comparisons/c-1/figure"}}}}.dump()));
  });
  use(server);
  EXPECT_EQ(run({"compare", kId, kAnalysis, "--at-h", "150.5", "--figure", path("f.png")}), 0) << err();
  EXPECT_EQ(json::parse(server.requests().at(0).body), (json{{"job_id", kId}, {"analysis_id", kAnalysis}, {"at_h", 150.5}}));
  EXPECT_EQ(read_file("f.png"), kPng);
  EXPECT_THAT(out(), HasSubstr("comparison c-1\nsimulated, 180 regions of 1963 px\n"));
  EXPECT_THAT(out(), HasSubstr("real, 180 regions"));
  EXPECT_THAT(out(), HasSubstr("- no difference"));
  EXPECT_EQ(run({"compare", kId, kAnalysis, "--at-h", "soon"}), 2);
  EXPECT_EQ(run({"compare", kId, kAnalysis, "--match", "object_area", "--cell-count", "317"}), 0) << err();
  EXPECT_EQ(json::parse(server.requests().back().body),
            (json{{"job_id", kId}, {"analysis_id", kAnalysis}, {"match", "object_area"}, {"cell_count", 317}}));
  EXPECT_EQ(run({"compare", kId, kAnalysis, "--cell-count", "3.5"}), 2);
  EXPECT_EQ(run({"compare", kId, kAnalysis, "--cell-area-px", "120.5"}), 0) << err();
  EXPECT_EQ(json::parse(server.requests().back().body)["cell_area_px"], 120.5);
}

TEST_F(Cli, MeasureSaysHowManyCellsAreHiddenAndCountsOne) {
  json answer = job_analysis();
  FakeServer server([&answer](const FakeRequest&, const FakeConnection& to) { to.send(json_answer(200, answer.dump())); });
  use(server);
  answer["visible_cell_count"] = 150;
  EXPECT_EQ(run({"measure", kId}), 0) << err();
  EXPECT_THAT(out(), StartsWith("180 cells at 200.00 h, 150 of them seen from above\ncell walls: D0 1.44 ("));
  answer["cell_count"] = answer["visible_cell_count"] = 1;
  EXPECT_EQ(run({"measure", kId}), 0) << err();
  EXPECT_THAT(out(), HasSubstr("1 cell at 200.00 h\n"));
}

TEST(ReportFacts, NumbersHaveFourDigitsThatCount) {
  EXPECT_EQ(rounded(204.90388457792895), "204.9");
  EXPECT_EQ(rounded(0.00022239622863492336), "0.000222");
  EXPECT_EQ(rounded(12345.6), "12346");
  EXPECT_EQ(rounded(1.5), "1.5");
  EXPECT_EQ(rounded(3.0), "3");
  EXPECT_EQ(rounded(-12.3456), "-12.35");
  EXPECT_EQ(rounded(0.0), "0");
  EXPECT_EQ(with_unit("radius_mean_px", 100.0, 0.5), "50 um");
  EXPECT_EQ(with_unit("covered_px", 100, 0.5), "25 um2");
  EXPECT_EQ(with_unit("covered_px", 100, {}), "100 px");
  EXPECT_EQ(with_unit("doubling_time_h", 14.87654, {}), "14.88 h");
  EXPECT_EQ(title_of("radius_mean_px"), "mean radius");
  EXPECT_EQ(title_of("hull_area_px"), "hull area");
}

TEST_F(Cli, MeshAndCellsAreFiles) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    if (request.line().find("/mesh") != std::string::npos) return to.send(test::answer(200, "model/gltf-binary", "glTF"));
    to.send(test::answer(200, "text/csv", "cell_id\r\n"));
  });
  use(server);
  EXPECT_EQ(run({"mesh", kId, "--triangles-max", "5000", "--no-nuclei", "-o", path("m.glb")}), 0) << err();
  EXPECT_EQ(read_file("m.glb"), "glTF");
  EXPECT_EQ(server.requests().back().line(), "GET /v1/jobs/" + kId + "/mesh?triangles_max=5000&nuclei=false HTTP/1.1");
  EXPECT_EQ(server.requests().back().header("Accept"), "model/gltf-binary");
  EXPECT_EQ(run({"mesh", kId, "--json"}), 2);
  out_is_terminal_ = true;
  EXPECT_EQ(run({"mesh", kId}), 2);  // binary is not for a terminal
  EXPECT_EQ(run({"measure", kId, "--cells", "-o", path("c.csv")}), 0) << err();
  EXPECT_EQ(server.requests().back().line(), "GET /v1/jobs/" + kId + "/analysis HTTP/1.1");
  EXPECT_EQ(server.requests().back().header("Accept"), "text/csv");
  EXPECT_EQ(read_file("c.csv"), "cell_id\r\n");
  EXPECT_EQ(run({"measure", kId, "-o", path("x")}), 2);
  EXPECT_EQ(run({"measure", kId, "--cells", "--json"}), 2);
}

}  // namespace
}  // namespace colony::client
