// The handlers of what a job has produced: events, cells, series, image, log.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/columns.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::ElementsAre;
using ::testing::StartsWith;

TEST(Events, PagesNdjsonAndCsvAreTheSameFacts) {
  ApiFixture fixture;
  const std::size_t count = fixture.jobs.history.size();
  auto whole = fixture.get(kJob + "/events");
  const Json all = json_of(whole);
  EXPECT_EQ(all["items"].size(), count);
  EXPECT_TRUE(all["next"].is_null());

  Json paged = Json::array();
  std::string target = kJob + "/events?limit=4";
  for (std::size_t pages = 0; !target.empty(); ++pages) {
    ASSERT_LE(pages, count);
    auto response = fixture.get(target);
    const Json page = json_of(response);
    EXPECT_LE(page["items"].size(), 4u);
    for (const Json& item : page["items"]) paged.push_back(item);
    target = page["next"].is_null() ? "" : kJob + "/events?limit=4&after=" + page["next"].get<std::string>();
  }
  EXPECT_EQ(paged, all["items"]);

  auto ndjson = fixture.get(kJob + "/events", {{"Accept", "application/x-ndjson"}});
  const auto lines = split_lines(body_of(ndjson), "\n");
  ASSERT_EQ(lines.size(), count);
  for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(Json::parse(lines[i]), all["items"][i]);

  auto csv = fixture.get(kJob + "/events?limit=3", {{"Accept", "text/csv"}});
  const auto rows = split_lines(body_of(csv), "\r\n");
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_THAT(rows[0], StartsWith("seq,time_h,kind,cell_id,digest,x_um,"));
  EXPECT_THAT(rows[1], StartsWith("1,0,founded,1," + fixture.jobs.history[0].digest.hex() + ","));
  for (const std::string& row : rows) {
    EXPECT_EQ(api::split(row, ',').size(), api::event_columns().size()) << row;
  }
}

TEST(Events, AreFiltered) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/events?kind=divided,finished&after=1");
  const Json page = json_of(response);
  EXPECT_EQ(page["items"].size(), 6u);  // five divisions make six cells
  for (const Json& item : page["items"]) EXPECT_TRUE(item["kind"] == "divided" || item["kind"] == "finished");
  auto none = fixture.get(kJob + "/events?after=100000");
  EXPECT_EQ(body_of(none), R"({"items":[],"next":null})");
}

TEST(Events, AFailureInTheMiddleIsNotAShortList) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/events", {{"Accept", "application/x-ndjson"}});
  fixture.jobs.row.id = "deleted meanwhile";
  std::string out;
  EXPECT_THROW(while (response.stream->pull(out) != http::BodySource::Pull::kEnd){}, std::runtime_error);
}

TEST(Cells, AreTheColonyAtATime) {
  ApiFixture fixture;
  auto now = fixture.get(kJob + "/cells");
  const Json all = json_of(now);
  EXPECT_EQ(all["items"].size(), 6u);
  EXPECT_EQ(all["digest"], fixture.jobs.row.digest.hex());
  EXPECT_TRUE(all["next"].is_null());
  auto then = fixture.get(kJob + "/cells?at_h=0");
  EXPECT_EQ(json_of(then)["items"].size(), 1u);
  auto csv = fixture.get(kJob + "/cells", {{"Accept", "text/csv"}});
  const auto rows = split_lines(body_of(csv), "\r\n");
  ASSERT_EQ(rows.size(), 7u);
  const auto names = api::split(rows[0], ',');
  for (std::size_t row = 1; row < rows.size(); ++row) {
    const auto fields = api::split(rows[row], ',');
    ASSERT_EQ(fields.size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Json& value = all["items"][row - 1][names[i]];
      if (value.is_null()) {
        EXPECT_EQ(fields[i], "");
      } else if (value.is_number()) {
        EXPECT_EQ(std::stod(fields[i]), value.get<double>()) << names[i];
      } else {
        EXPECT_EQ(fields[i], value.get<std::string>());
      }
    }
  }
  auto early = fixture.get(kJob + "/cells?at_h=1e8");
  EXPECT_EQ(early.status, 409);
  EXPECT_EQ(json_of(early)["type"], "urn:colony:problem:time-not-reached");
}

TEST(Results, SeriesImageAndLog) {
  ApiFixture fixture;
  auto series = fixture.get(kJob + "/series?points=3");
  EXPECT_EQ(json_of(series)["items"].size(), 3u);
  auto csv = fixture.get(kJob + "/series", {{"Accept", "text/csv"}});
  EXPECT_EQ(split_lines(body_of(csv), "\r\n").size(), 201u);
  auto image = fixture.get(kJob + "/image?width_px=64&style=shaded&colour_by=age&scale_bar=false");
  EXPECT_EQ(image.status, 200);
  EXPECT_EQ(header(image, "Content-Type"), "image/png");
  EXPECT_THAT(image.body, StartsWith("\x89PNG\r\n\x1a\n"));
  auto both = fixture.get(kJob + "/image?um_per_px=1&width_px=100");
  EXPECT_EQ(both.status, 422);
  EXPECT_THAT(faults(both), ElementsAre("um_per_px", "width_px"));
  auto log = fixture.get(kJob + "/log");
  EXPECT_EQ(header(log, "Content-Type"), "application/x-ndjson");
  EXPECT_EQ(body_of(log),
            "{\"index\":1,\"at\":\"2026-01-02T03:04:05.678Z\",\"level\":\"info\",\"message\":\"submitted\",\"actor\":null}\n");
}

}  // namespace
}  // namespace colony::server::testing
