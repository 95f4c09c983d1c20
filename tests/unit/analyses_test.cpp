// The handlers of pictures: what is measured of a colony, pictures that are sent.
#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/analyse.hpp"
#include "server/api/shape_table.hpp"
#include "tests/unit/picture_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(JobPictures, HaveTheirTypes) {
  ApiFixture fixture;
  auto tiff = fixture.get(kJob + "/image?width_px=64", {{"Accept", "image/tiff"}});
  EXPECT_EQ(tiff.status, 200);
  EXPECT_EQ(header(tiff, "Content-Type"), "image/tiff");
  EXPECT_EQ(tiff.body.substr(0, 4), std::string("II*\0", 4));
  auto both = fixture.get(kJob + "/image?style=phase&lines=cells", {{"Accept", "image/tiff"}});
  EXPECT_EQ(both.status, 422);
  EXPECT_THAT(faults(both), ElementsAre("style", "lines"));
  for (const char* style : {"brightfield", "phase", "labels"}) {
    auto png = fixture.get(kJob + "/image?width_px=64&style=" + style);
    EXPECT_THAT(png.body, StartsWith("\x89PNG\r\n\x1a\n")) << style;
  }
  auto mesh = fixture.get(kJob + "/mesh?triangles_max=6000");
  EXPECT_EQ(header(mesh, "Content-Type"), "model/gltf-binary");
  EXPECT_THAT(mesh.body, StartsWith("glTF"));
  auto few = fixture.get(kJob + "/mesh?triangles_max=1000");
  EXPECT_EQ(few.status, 422);  // six cells of 200 at least
  EXPECT_THAT(faults(few), ElementsAre("triangles_max"));
}

TEST(JobPictures, TakeWhatHasAMeaningForTheStyle) {
  ApiFixture fixture;
  for (const char* query : {"style=shaded&colour_by=age&scale_bar=false", "style=contours&lines=colony&scale_bar=true", "style=phase&scale_bar=false"}) {
    EXPECT_EQ(fixture.get(kJob + "/image?width_px=64&" + query).status, 200) << query;
  }
}

TEST(JobPictures, AMeshWithoutAWishHasTrianglesForEveryCell) {
  EXPECT_EQ(api::mesh_triangles_default(0), 200'000);
  EXPECT_EQ(api::mesh_triangles_default(500), 200'000);
  EXPECT_EQ(api::mesh_triangles_default(7303), 2'921'200);
  EXPECT_GE(api::mesh_triangles_default(20'000), 200 * 20'000);  // at least what each cell needs
  EXPECT_EQ(api::mesh_triangles_default(1'000'000), 4'000'000);
}

TEST(JobAnalysis, HasItsControlsBesideIt) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/analysis?width_px=512");
  ASSERT_EQ(response.status, 200) << response.body;
  const Json json = json_of(response);
  EXPECT_EQ(json["cell_count"], 6);
  EXPECT_EQ(json["digest"], fixture.jobs.row.digest.hex());
  ASSERT_EQ(json["controls"].size(), 3u);
  EXPECT_EQ(json["controls"][0]["name"], "without_noise");
  const Json& d0 = json["fractal"]["walls"]["d0"];
  EXPECT_GT(d0["value"].get<double>(), 0.8);
  EXPECT_LT(d0["value"].get<double>(), 2.0);
  EXPECT_EQ(d0["range_px"].size(), 2u);
  EXPECT_FALSE(json["verdict"].empty());
  for (const Json& sentence : json["verdict"]) EXPECT_THAT(sentence.get<std::string>(), Not(AnyOf(HasSubstr("image: "), HasSubstr("areas: "))));
  EXPECT_EQ(json["neighbours"]["holes_given"]["classes"].size(), json["neighbours"]["classes"].size());
  EXPECT_TRUE(json["packing"]["reason"].is_null());
  EXPECT_EQ(json["visible_cell_count"], 6);
  // Six cells have figures, and no finding: neither the lines, nor their controls, nor the sides.
  EXPECT_EQ(json["findings"]["walls"]["finding"], "too_few");
  EXPECT_EQ(json["fractal"]["outline"]["finding"], "too_few");
  EXPECT_EQ(json["controls"][1]["walls"]["finding"], "too_few");
  EXPECT_THAT(json["neighbours"]["not_judged"].get<std::string>(), HasSubstr("fewer than 10 cells"));
  EXPECT_THAT(json["verdict"][0].get<std::string>(), HasSubstr("too few for a finding: 6 objects were counted"));
  EXPECT_THAT(json["verdict"].dump(), Not(AnyOf(HasSubstr("consistent with scaling"), HasSubstr("they tile it"))));
  // A scale that is twice as fine has four times the pixels in the same cells.
  auto finer = fixture.get(kJob + "/analysis?width_px=1024");
  EXPECT_NEAR(json_of(finer)["cell_area_mean_px"].get<double>() / json["cell_area_mean_px"].get<double>(), 4.0, 0.04);
}

TEST(JobAnalysis, AsCsvIsALineACell) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/analysis?width_px=512", {{"Accept", "text/csv"}});
  ASSERT_EQ(response.status, 200) << response.body;
  EXPECT_THAT(header(response, "Content-Type"), StartsWith("text/csv"));
  const auto lines = split_lines(response.body, "\r\n");
  ASSERT_EQ(lines.size(), 7u);  // six cells
  EXPECT_EQ(lines[0],
            "cell_id,area_px,area_um2,perimeter_px,perimeter_um,circularity,solidity,eccentricity,neighbour_count,is_interior,at_frame,"
            "centre_x_px,centre_y_px,centre_x_um,centre_y_um");
  // The table and the summary are of one image; the place is that of the dish.
  auto summary = fixture.get(kJob + "/analysis?width_px=512");
  const Json json = json_of(summary);
  double area_px = 0.0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto fields = split_lines(lines[i], ",");
    ASSERT_EQ(fields.size(), 15u) << lines[i];
    EXPECT_EQ(fields[0], std::to_string(i));
    area_px += std::stod(fields[1]);
    const double um_per_px = json["um_per_px"];
    EXPECT_NEAR(std::stod(fields[2]), std::stod(fields[1]) * um_per_px * um_per_px, 1e-9);
    const Vec3 centre = fixture.jobs.colony_at(kJobId, {})->colony->cell(CellId{static_cast<std::uint32_t>(i)}).centre_um;
    EXPECT_NEAR(std::stod(fields[13]), centre.x(), 3.0) << lines[i];
    EXPECT_NEAR(std::stod(fields[14]), centre.y(), 3.0) << lines[i];
  }
  EXPECT_NEAR(area_px / 6.0, json["cell_area_mean_px"].get<double>(), 1e-9);
}

TEST(ShapeTable, ACellThatIsNotSeenHasALineWithoutFigures) {
  const FakeJobs jobs;
  Colony colony(jobs.spec.params);
  for (const Event& event : jobs.history) colony.apply(event);
  LabelImage labels(9, 9, 0.5);
  for (std::int64_t row = 2; row < 6; ++row) {
    for (std::int64_t column = 2; column < 6; ++column) labels.at(row, column) = 2;
  }
  const auto rows = api::shape_rows(labels, colony, 10.0, 20.0);
  ASSERT_TRUE(rows);
  const auto lines = split_lines(api::shape_csv(api::cell_shape_columns(), *rows), "\r\n");
  ASSERT_EQ(lines.size(), 7u);
  EXPECT_EQ(lines[1], "1,0,,,,,,,,,,,,,");
  EXPECT_THAT(lines[2], StartsWith("2,16,4,"));
  EXPECT_THAT(lines[2], ::testing::EndsWith(",4,4,12,18"));  // centre 4 px right and down of (10, 20) um
}

TEST(Analyses, CountDrawnDiscsAndKeepThem) {
  ApiFixture fixture;
  const std::string picture = discs_png(6, 9);
  auto response = send_picture(fixture, picture, "?name=discs&um_per_px=0.5&pipeline=nuclei");
  ASSERT_EQ(response.status, 201) << response.body;
  const Json made = json_of(response);
  const std::string self = made["links"]["self"];
  EXPECT_EQ(header(response, "Location"), self);
  EXPECT_EQ(made["result"]["segmentation"]["object_count"], 36);
  // A disc of radius 9 has 253 pixels; smoothing may move its edge out by less than a pixel, to 314 at radius 10.
  EXPECT_GE(made["result"]["segmentation"]["area_mean_px"].get<double>(), 253);
  EXPECT_LT(made["result"]["segmentation"]["area_mean_px"].get<double>(), 314);
  EXPECT_EQ(made["image_bytes"], picture.size());
  auto shown = fixture.get(self);
  EXPECT_EQ(json_of(shown), made);
  auto listed = fixture.get("/v1/analyses");
  const Json list = json_of(listed);
  ASSERT_EQ(list["items"].size(), 1u);
  EXPECT_FALSE(list["items"][0].contains("result"));
  for (const Json& step : made["result"]["steps"]) {
    const std::string name = step["name"];
    auto png = fixture.get(self + "/steps/" + name);
    EXPECT_EQ(png.status, 200) << name;
    EXPECT_THAT(png.body, StartsWith("\x89PNG")) << name;
  }
  const Json& result = made["result"];
  EXPECT_EQ(result["segmentation"]["pipeline_reason"], "asked for");
  EXPECT_TRUE(result["segmentation"]["pipeline_given"].get<bool>());
  EXPECT_EQ(result["image"]["um_per_px"], 0.5);
  EXPECT_EQ(result["image"]["um_per_px_source"], "given");
  // The dimension at each level of the sweep, and in words what it says.
  const Json& rows = result["threshold_sweep"]["rows"];
  ASSERT_EQ(rows.size(), result["segmentation"]["sweep"].size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i]["threshold"], result["segmentation"]["sweep"][i]["threshold"]);
    EXPECT_NEAR(rows[i]["walls"]["d0"]["value"].get<double>(), result["fractal"]["walls"]["d0"]["value"].get<double>(), 0.1);
  }
  const std::string words = result["verdict"].dump();
  EXPECT_THAT(words, HasSubstr("the outlines of the nuclei could be counted at " + std::to_string(rows.size()) + " of"));
  EXPECT_THAT(words, HasSubstr("What follows for the outlines of the nuclei"));
  // Each object a line, in both forms.
  auto table = fixture.get(made["links"]["objects"].get<std::string>(), {{"Accept", "text/csv"}});
  const auto lines = split_lines(table.body, "\r\n");
  ASSERT_EQ(lines.size(), 37u);
  EXPECT_THAT(lines[0], StartsWith("object_id,area_px,area_um2,"));
  auto items = fixture.get(made["links"]["objects"].get<std::string>());
  const Json objects = json_of(items);
  ASSERT_EQ(objects["items"].size(), 36u);
  EXPECT_EQ(objects["items"][7]["object_id"], 8);
  EXPECT_EQ(objects["items"][7]["area_um2"].get<double>(), 0.25 * objects["items"][7]["area_px"].get<double>());
  EXPECT_EQ(fixture.get(self + "x/objects").status, 404);
  auto absent = fixture.get(self + "/steps/dream");
  EXPECT_EQ(absent.status, 404);
  EXPECT_THAT(json_of(absent)["detail"].get<std::string>(), HasSubstr("there are grey, "));
  auto steps = fixture.get(made["links"]["steps"].get<std::string>());
  ASSERT_EQ(steps.status, 200) << steps.body;
  const Json told = json_of(steps)["items"];
  ASSERT_EQ(told.size(), made["result"]["steps"].size());
  EXPECT_EQ(told[0]["name"], "grey");
  EXPECT_FALSE(told[0]["text"].get<std::string>().empty());
  EXPECT_EQ(fixture.get(told[0]["href"].get<std::string>()).status, 200);
  EXPECT_EQ(fixture.ask("DELETE", self).status, 204);
  EXPECT_EQ(fixture.get(self).status, 404);
}

TEST(Analyses, TakePicturesOnlyAndSayWhy) {
  ApiFixture fixture;
  const std::string picture = discs_png(3, 6);
  // What a page of another site could send unasked, and a parameter that hides it.
  for (const char* type : {"text/plain", "multipart/form-data", "application/x-www-form-urlencoded", "application/json",
                           "image/gif", "image/png; charset=x", ""}) {
    auto refused = send_picture(fixture, picture, "", type);
    EXPECT_EQ(refused.status, 415) << type;
    EXPECT_THAT(faults(refused), ElementsAre("Content-Type")) << type;
  }
  auto other = send_picture(fixture, picture, "", "image/tiff");
  EXPECT_EQ(other.status, 422);
  EXPECT_THAT(faults(other), ElementsAre("Content-Type"));
  struct Case {
    const char* what;
    std::string bytes;
    int status;
  };
  const std::vector<Case> cases = {{"empty", "", 400},
                                   {"text", "this is a text called .png", 400},
                                   {"cut", picture.substr(0, picture.size() / 2), 400},
                                   {"one pixel", plain_png(1, 1, 7), 422},
                                   {"a thread", plain_png(1, 50'000, 7), 422},
                                   {"white", plain_png(64, 64, 255), 422},
                                   {"black", plain_png(64, 64, 0), 422}};
  for (const Case& one : cases) {
    auto refused = send_picture(fixture, one.bytes);
    EXPECT_EQ(refused.status, one.status) << one.what << refused.body;
    const std::string detail = json_of(refused)["detail"];
    EXPECT_GT(detail.size(), 10u) << one.what;
    EXPECT_THAT(detail, Not(AnyOf(StartsWith("image:"), StartsWith("threshold:")))) << one.what;
    EXPECT_THAT(faults(refused), ElementsAre("")) << one.what;  // all of the body
  }
  auto channel = send_picture(fixture, picture, "?channel=3");
  EXPECT_THAT(faults(channel), ElementsAre("channel"));
  auto none = fixture.get("/v1/analyses");
  EXPECT_TRUE(json_of(none)["items"].empty());
}

TEST(Analyses, BeyondTheLimitAreWorkedOnLater) {
  ApiFixture fixture;
  const std::string picture = discs_png(51, 10);  // 2,040 x 2,040
  auto response = send_picture(fixture, picture, "?pipeline=nuclei");
  ASSERT_EQ(response.status, 202) << response.body;
  const std::string self = json_of(response)["links"]["self"];
  EXPECT_EQ(json_of(response)["state"], "queued");
  auto none = fixture.get(self + "/steps");
  EXPECT_TRUE(json_of(none)["items"].empty());
  EXPECT_EQ(fixture.get(self + "/steps/grey").status, 404);  // nothing is computed for a row that waits
  ASSERT_TRUE(fixture.api().start());
  Json row;
  for (;;) {  // the test's own deadline is that of ctest
    auto shown = fixture.get(self);
    row = json_of(shown);
    if (row["state"] == "succeeded" || row["state"] == "failed") break;
    std::this_thread::yield();
  }
  EXPECT_EQ(row["state"], "succeeded") << row["detail"];
  EXPECT_EQ(row["result"]["segmentation"]["object_count"], 51 * 51);
}

TEST(Analyses, TakeTheChoicesOfTheSegmentation) {
  ApiFixture fixture;
  // Two discs that touch, and a speck.
  std::vector<std::uint8_t> rows(120 * 80, 20);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 120; ++x) {
      const auto in = [&](int cx, int cy, int r) { return (x - cx) * (x - cx) + (y - cy) * (y - cy) <= r * r; };
      if (in(40, 40, 14) || in(64, 40, 14) || in(100, 20, 3)) rows[static_cast<std::size_t>(120 * y + x)] = 200;
    }
  }
  const std::string picture = colony::testing::png_file(120, 80, {}, rows);
  const auto count = [&](const std::string& query) {
    auto sent = send_picture(fixture, picture, "?pipeline=nuclei" + query);
    EXPECT_EQ(sent.status, 201) << sent.body;
    return json_of(sent)["result"]["segmentation"]["object_count"].get<int>();
  };
  EXPECT_EQ(count("&area_min_px=9"), 3);
  EXPECT_EQ(count("&area_min_px=9&split=false"), 2);
  EXPECT_EQ(count("&area_min_px=100"), 2);
  auto sent = send_picture(fixture, picture, "?pipeline=nuclei&window_radius_px=5&hole_max_px=500&background_reach_px=60");
  const Json made = json_of(sent), options = made["options"];
  EXPECT_EQ(made["result"]["segmentation"]["background_reach_px"], 60);
  EXPECT_EQ(options["window_radius_px"], 5);
  EXPECT_EQ(options["hole_max_px"], 500);
  EXPECT_EQ(options["background_reach_px"], 60);
  EXPECT_TRUE(options["split"].get<bool>());
  for (const char* query : {"?window_radius_px=0", "?window_radius_px=51", "?area_min_px=0", "?hole_max_px=-1", "?background_reach_px=2", "?split=1"}) {
    EXPECT_EQ(send_picture(fixture, picture, query).status, 422) << query;
  }
  // What an older program stored knows none of them.
  const api::ImageOptions old = api::decode_image_options(
      R"({"um_per_px":null,"channel":null,"pipeline":"auto","foreground":"auto","threshold":null,"clahe":false})");
  EXPECT_TRUE(old.split);
  EXPECT_EQ(old.window_radius_px, 3);
  EXPECT_FALSE(old.area_min_px);
}

TEST(Ink, EnclosesItsCells) {
  const char* const drawing[] = {"......", ".####.", ".#.##.", ".##.#.", ".####.", "......"};
  BinaryImage ink(6, 6);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) ink.at(row, column) = drawing[row][column] == '#' ? 255 : 0;
  }
  BinaryImage outside(6, 6);
  for (int i = 0; i < 6; ++i) outside.at(0, i) = outside.at(5, i) = outside.at(i, 0) = outside.at(i, 5) = 255;
  const LabelImage cells = api::enclosed_areas(ink, outside);
  EXPECT_EQ(cells.at(std::int64_t{2}, std::int64_t{2}), 1u);
  EXPECT_EQ(cells.at(std::int64_t{3}, std::int64_t{3}), 2u);  // corners do not join
  EXPECT_EQ(std::count(cells.values.begin(), cells.values.end(), 0u), 34);
}

}  // namespace
}  // namespace colony::server::testing
