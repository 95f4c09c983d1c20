// The handlers of pictures: what is measured of a colony, pictures that are sent, comparisons of the two.
#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/analyse.hpp"
#include "server/api/compare.hpp"
#include "tests/support/image_files.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// Light discs on a dark ground, in a square of tiles: `side` of them a row, each `radius` large, 4 radii apart.
std::string discs_png(int side, int radius) {
  const int size = 4 * radius * side;
  std::vector<std::uint8_t> rows(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), 20);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const int dx = x % (4 * radius) - 2 * radius, dy = y % (4 * radius) - 2 * radius;
      if (dx * dx + dy * dy <= radius * radius) rows[static_cast<std::size_t>(y * size + x)] = 200;
    }
  }
  return colony::testing::png_file(size, size, {}, rows);
}

std::string plain_png(int width, int height, std::uint8_t level) {
  return colony::testing::png_file(width, height, {},
                                   std::vector<std::uint8_t>(static_cast<std::size_t>(width * height), level));
}

http::Response send_picture(ApiFixture& fixture, const std::string& bytes, const std::string& query = "",
                            const std::string& type = "image/png") {
  return fixture.ask("POST", "/v1/analyses" + query, {{"Content-Type", type}}, bytes);
}

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
  // A scale that is twice as fine has four times the pixels in the same cells.
  auto finer = fixture.get(kJob + "/analysis?width_px=1024");
  EXPECT_NEAR(json_of(finer)["cell_area_mean_px"].get<double>() / json["cell_area_mean_px"].get<double>(), 4.0, 0.04);
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
  auto absent = fixture.get(self + "/steps/dream");
  EXPECT_EQ(absent.status, 404);
  EXPECT_THAT(json_of(absent)["detail"].get<std::string>(), HasSubstr("there are grey, "));
  auto steps = fixture.get(made["links"]["steps"].get<std::string>());
  ASSERT_EQ(steps.status, 200) << steps.body;
  const Json items = json_of(steps)["items"];
  ASSERT_EQ(items.size(), made["result"]["steps"].size());
  EXPECT_EQ(items[0]["name"], "grey");
  EXPECT_FALSE(items[0]["text"].get<std::string>().empty());
  EXPECT_EQ(fixture.get(items[0]["href"].get<std::string>()).status, 200);
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

TEST(Comparisons, MatchThePixelsOfACell) {
  ApiFixture fixture;
  auto sent = send_picture(fixture, discs_png(6, 9), "?pipeline=nuclei");
  const Json analysis = json_of(sent);
  const Json body = {{"job_id", kJobId}, {"analysis_id", analysis["id"]}};
  auto response = fixture.post("/v1/comparisons", api::to_text(body));
  ASSERT_EQ(response.status, 201) << response.body;
  const Json made = json_of(response);
  const double simulated = made["result"]["simulated"]["cell_area_mean_px"];
  const double real = made["result"]["real"]["cell_area_mean_px"];
  EXPECT_NEAR(simulated / real, 1.0, 0.02);
  EXPECT_EQ(made["result"]["simulated"]["controls"].size(), 3u);
  EXPECT_EQ(made["result"]["real"]["controls"].size(), 2u);
  EXPECT_FALSE(made["result"]["verdict"].empty());
  auto figure = fixture.get(made["links"]["figure"].get<std::string>());
  EXPECT_EQ(figure.status, 200);
  EXPECT_THAT(figure.body, StartsWith("\x89PNG"));

  // What the figure is made of goes: the result stays, the link does not.
  EXPECT_EQ(fixture.ask("DELETE", analysis["links"]["self"].get<std::string>()).status, 204);
  for (const char* path : {"", "?limit=5"}) {
    auto left = fixture.get(*path == 0 ? made["links"]["self"].get<std::string>() : std::string("/v1/comparisons") + path);
    const Json shown = *path == 0 ? json_of(left) : json_of(left)["items"][0];
    EXPECT_TRUE(shown["links"]["figure"].is_null()) << path;
  }
  sent = send_picture(fixture, discs_png(6, 9), "?pipeline=nuclei");
  const Json again = json_of(sent);

  auto wrong = fixture.post("/v1/comparisons", R"({"job_id":"x","at_h":-1,"colour":1})");
  EXPECT_EQ(wrong.status, 422);
  EXPECT_THAT(faults(wrong), ElementsAre("/at_h", "/colour", "/analysis_id"));
  auto nobody = fixture.post("/v1/comparisons", R"({"job_id":"x","analysis_id":"y"})");
  EXPECT_THAT(faults(nobody), ElementsAre("/analysis_id"));
  auto no_job = fixture.post("/v1/comparisons",
                             api::to_text({{"job_id", "x"}, {"analysis_id", again["id"]}}));
  EXPECT_THAT(faults(no_job), ElementsAre("/job_id"));
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
