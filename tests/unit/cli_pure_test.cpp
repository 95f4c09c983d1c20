// The parts of the command line that need no server: parsing and formatting.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/csv.hpp"
#include "client/cli/failure.hpp"
#include "client/cli/founders.hpp"
#include "client/cli/lines.hpp"
#include "client/cli/progress.hpp"
#include "client/cli/spec.hpp"
#include "client/cli/sse.hpp"
#include "client/cli/text.hpp"

namespace colony::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The message of the Failure that `run` throws; fails the test if it throws none or with another code.
template <class Run>
std::string message_of(Run run, ExitCode code = ExitCode::kUsage) {
  try {
    run();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), code);
    return failure.what();
  }
  ADD_FAILURE() << "no failure";
  return {};
}

TEST(Csv, ReadsQuotesLineEndsAndByteOrderMark) {
  const CsvTable table = parse_csv(
      "\xEF\xBB\xBF"
      "\"time [h]\",\"a \"\"b\"\"\",c\r\n1,\"x,y\r\nz\",\r\n\r\n2,\"\",w",
      "t.csv", ',');
  EXPECT_THAT(table.header, ElementsAre("time [h]", "a \"b\"", "c"));
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_THAT(table.rows[0].fields, ElementsAre("1", "x,y\r\nz", ""));
  EXPECT_THAT(table.rows[1].fields, ElementsAre("2", "", "w"));
  EXPECT_EQ(table.rows[0].line, 2u);
  EXPECT_EQ(table.rows[1].line, 5u);  // after the two lines of the first row and the blank one
}

TEST(Csv, NamesTheLineOfWhatIsWrong) {
  const auto error = [](const char* text) { return message_of([&] { parse_csv(text, "t.csv", ','); }); };
  EXPECT_THAT(error("a,b\n1,2\n3\n"), HasSubstr("t.csv:3: 1 fields where the header has 2"));
  EXPECT_THAT(error("a,b\n1,\"2\n3,4\n"), HasSubstr("t.csv:2: a quoted field is never closed"));
  EXPECT_THAT(error("a,b\n1,\"2\"x\n"), HasSubstr("t.csv:2: text after a closing quote"));
  EXPECT_THAT(error("a,b\n1,2\"\n"), HasSubstr("t.csv:2: a quote inside a field"));
  EXPECT_THAT(error("a,a\n"), HasSubstr("two columns are called 'a'"));
  EXPECT_THAT(error(""), HasSubstr("the table is empty"));
}

TEST(Csv, GuessesTheDelimiterOutsideQuotes) {
  EXPECT_EQ(guess_delimiter("a,b\n"), ',');
  EXPECT_EQ(guess_delimiter("\"a,b,c\";d;e\n"), ';');
  EXPECT_EQ(guess_delimiter("a\tb\n1,2,3,4"), '\t');
  EXPECT_EQ(guess_delimiter("a"), ',');
}

TEST(Spec, SetTakesJsonElseAString) {
  const Assignment number = parse_set("model.cycle.mean_h=10");
  EXPECT_THAT(number.path, ElementsAre("model", "cycle", "mean_h"));
  EXPECT_EQ(number.value, Json(10));
  EXPECT_EQ(parse_set("model.cell.pair_volume_um3=[800,3600]").value, Json({800, 3600}));
  EXPECT_EQ(parse_set("model.division.generation_limit=null").value, Json(nullptr));
  EXPECT_EQ(parse_set("model.contact.rule=max").value, Json("max"));
  EXPECT_EQ(parse_set("name=a=b").value, Json("a=b"));
  EXPECT_EQ(parse_set("name=\"10\"").value, Json("10"));
  EXPECT_EQ(parse_set("model.cycle.mean_h=NaN").value, Json("NaN"));  // the server says that this is no number
  EXPECT_THAT(message_of([] { parse_set("model.x=[1,2"); }), HasSubstr("not valid JSON"));
  EXPECT_THAT(message_of([] { parse_set("model..x=1"); }), HasSubstr("an empty name"));
  EXPECT_THAT(message_of([] { parse_set("model.x"); }), HasSubstr("write it as"));
  EXPECT_THAT(message_of([] { parse_set("model.x="); }), HasSubstr("no value"));
}

TEST(Spec, FlagsWinOverTheFileAndKeepItsOrder) {
  Json spec = parse_spec(R"({"seed": 7, "model": {"cycle": {"mean_h": 12, "sd_h": 2}}, "name": "n"})", "s.json");
  apply({parse_set("model.cycle.mean_h=10"), parse_set("model.noise.phase=1"), parse_label("plate.no=7")}, spec);
  EXPECT_EQ(
      spec.dump(),
      R"({"seed":7,"model":{"cycle":{"mean_h":10,"sd_h":2},"noise":{"phase":1}},"name":"n","labels":{"plate.no":"7"}})");
  EXPECT_THAT(message_of([&] { apply({parse_set("seed=1"), parse_set("seed=2")}, spec); }), HasSubstr("set twice"));
  EXPECT_THAT(message_of([&] { apply({parse_set("seed.x=1")}, spec); }), HasSubstr("'seed' is not an object"));
}

TEST(Spec, RefusesWhatAMergeWouldLose) {
  EXPECT_THAT(message_of([] { parse_spec(R"({"a": {"b": 1, "b": 2}})", "s.json"); }), HasSubstr("\"b\" stands twice"));
  EXPECT_THAT(message_of([] { parse_spec("{\"a\": 1,}", "s.json"); }), HasSubstr("s.json: not valid JSON at byte"));
  EXPECT_THAT(message_of([] { parse_spec("[1]", "s.json"); }), HasSubstr("a job spec is a JSON object"));
  EXPECT_THAT(message_of([] { parse_spec("{\"a\":" + std::string(100, '[') + std::string(100, ']') + "}", "s.json"); }),
              HasSubstr("nested deeper than 32"));
  EXPECT_EQ(parse_spec(R"({"a": {"b": 1}, "b": {"b": 2}})", "s.json").size(), 2u);
}

std::vector<std::string> events_of(const std::string& stream, std::size_t piece_bytes) {
  SseParser parser;
  std::vector<std::string> out;
  for (std::size_t at = 0; at < stream.size(); at += piece_bytes) {
    parser.feed(std::string_view(stream).substr(at, piece_bytes),
                [&](const SseEvent& event) { out.push_back(event.name + "|" + event.data + "|" + parser.last_id()); });
  }
  return out;
}

TEST(Sse, ReadsEventsHoweverTheyAreCut) {
  const std::string stream =
      "\xEF\xBB\xBFretry: 2000\n\n: comment\r\nevent: divided\r\nid: 7\r\ndata: {\"a\":\rdata:  1}\r\n\r\n"
      "data\n\nevent: lost\n\nid: 9\n\ndata: x\n\ndata: cut";
  for (const std::size_t piece : {1u, 2u, 3u, 7u, 1000u}) {
    EXPECT_THAT(events_of(stream, piece), ElementsAre("divided|{\"a\":\n 1}|7", "message||7", "message|x|9")) << piece;
  }
}

TEST(Sse, KeepsWhatAReconnectNeeds) {
  SseParser parser;
  const auto ignore = [](const SseEvent&) {};
  parser.feed("retry: 10\nretry: -5\nid: 3\ndata: a\n\nid: 4\ndata: half", ignore);
  EXPECT_EQ(parser.retry(), std::chrono::milliseconds(10));
  EXPECT_EQ(parser.last_id(), "3");  // event 4 was cut, so it must come again
  parser.reconnect();
  std::string data;
  parser.feed("data: b\n\n", [&](const SseEvent& event) { data = event.data; });
  EXPECT_EQ(data, "b");
  EXPECT_EQ(parser.last_id(), "3");
}

TEST(Lines, CutsAnywhere) {
  std::vector<std::string> seen;
  LineSplitter lines([&](std::string_view line) { seen.emplace_back(line); });
  for (const char c : std::string("ab\n\nc\nd")) lines.feed({&c, 1});
  EXPECT_THAT(seen, ElementsAre("ab", "c"));
  lines.finish();
  EXPECT_THAT(seen, ElementsAre("ab", "c", "d"));
}

TEST(Text, NumbersAndControlCharacters) {
  EXPECT_EQ(to_integer("010"), 10);
  EXPECT_EQ(to_integer("1.5"), std::nullopt);
  EXPECT_EQ(to_integer(""), std::nullopt);
  EXPECT_EQ(to_number("-2.5e1"), -25.0);
  EXPECT_EQ(to_number("nan"), std::nullopt);
  EXPECT_EQ(to_number("1e999"), std::nullopt);
  EXPECT_EQ(to_number("1 "), std::nullopt);
  EXPECT_EQ(printable("a\x1b[31m\n\xC2\x9Bz\xC3\xA9"), "a?[31m??z\xC3\xA9");
  EXPECT_EQ(fixed(-0.04, 1), "0.0");
  EXPECT_EQ(duration_text(4.4), "4 s");
  EXPECT_EQ(duration_text(12000), "3 h 20 min");
}

TEST(Text, PrettyKeepsArraysOfNumbersOnOneLine) {
  EXPECT_EQ(pretty(Json::parse(R"({"a":[1,2],"b":[[1.5,2]],"c":{},"d":[]})")),
            "{\n  \"a\": [1, 2],\n  \"b\": [\n    [1.5, 2]\n  ],\n  \"c\": {},\n  \"d\": []\n}\n");
}

TEST(Text, TableAlignsNumbersRight) {
  EXPECT_EQ(table_text({"NAME", "N"}, {{"a", "5"}, {"bcdef", "12"}}), "NAME    N\na       5\nbcdef  12\n");
}

TEST(Text, SparklineRisesWithItsValues) {
  EXPECT_EQ(sparkline({0, 1, 2, 3, 4, 5, 6, 7}, 60, false), "_.:-=+*#");
  EXPECT_EQ(sparkline({0, 1, 2, 3, 4, 5, 6, 7}, 2, false), "-#");
  EXPECT_EQ(sparkline({0, 7}, 60, true), "▁█");
  EXPECT_EQ(sparkline({0, 0}, 60, false), "__");
  EXPECT_EQ(sparkline({}, 60, false), "");
}

TEST(Progress, TheBarFitsEveryWidth) {
  const Progress progress = progress_from(Json::parse(
      R"({"time_h": 118.25, "cells": 86, "fraction": 0.475, "cells_per_s": 210.3, "eta_s": 4, "active": 3})"));
  EXPECT_EQ(progress_bar(progress, 80),
            "[##############.................]  47 %  86 cells  ETA 4 s  118.2 h  210 cells/s");
  for (int width = 0; width < 200; ++width)
    EXPECT_LE(progress_bar(progress, width).size(), static_cast<std::size_t>(width));
  EXPECT_EQ(progress_bar(progress, 14), "47 %  86 cells");
  EXPECT_EQ(progress_words(progress), "running: 47 %, 86 cells, 118.2 h, 210 cells/s, about 4 s left");
}

CsvTable tracks(const std::string& rows, const std::string& header = "\"track\",\"time\",\"Y\",\"X\"") {
  return parse_csv(header + "\n" + rows, "t.csv", ',');
}

TEST(Founders, TakesTheEarliestTimeAndTurnsYUp) {
  FounderOptions options;
  options.um_per_px = 2.0;
  const Founders founders = select_founders(tracks("1,3,0,0\n1,0,10,20\n2,0,30,60\n2,3,NA,NA\n"), options);
  ASSERT_EQ(founders.kept.size(), 2u);
  EXPECT_EQ(founders.time, 0.0);
  EXPECT_EQ(founders.other_row_count, 2u);
  EXPECT_EQ(founders.kept[0].x_um, -40.0);
  EXPECT_EQ(founders.kept[0].y_um, 20.0);  // the upper row of the image
  EXPECT_EQ(founders.kept[1].x_um, 40.0);
  EXPECT_EQ(founders.kept[1].y_um, -20.0);
  EXPECT_EQ(founders.kept[0].line, 3u);
  options.y_up = true;
  options.field_px = {100.0, 100.0};
  EXPECT_EQ(select_founders(tracks("1,0,10,20\n"), options).kept[0].y_um, -80.0);
}

TEST(Founders, FindsColumnsByTheirUsualNames) {
  const Founders founders = select_founders(
      parse_csv("Position X [px],Position Y [px],Time (h),TrackID\n1,2,0,a\n", "t.csv", ','), FounderOptions());
  EXPECT_EQ(founders.x_column, "Position X [px]");
  EXPECT_EQ(founders.time_column, "Time (h)");
  EXPECT_EQ(founders.track_column, "TrackID");
  EXPECT_THAT(message_of([] { select_founders(tracks("1,0,1,2\n", "a,time,x [px],x [um]"), FounderOptions()); }),
              HasSubstr("could both be meant; choose with --x-column"));
  EXPECT_THAT(message_of([] { select_founders(tracks("1,0,1,2\n", "a,time,p,q"), FounderOptions()); }),
              HasSubstr("name it with --x-column; the columns are 'a', 'time', 'p', 'q'"));
  FounderOptions wrong;
  wrong.y_column = "why";
  EXPECT_THAT(message_of([&] { select_founders(tracks("1,0,1,2\n"), wrong); }),
              HasSubstr("--y-column: no column 'why'"));
}

TEST(Founders, NamesTheLineOfABadRow) {
  const auto error = [](const std::string& rows, FounderOptions options = {}) {
    return message_of([&] { select_founders(tracks(rows), options); });
  };
  EXPECT_THAT(error("1,0,1,2\n2,0,NaN,2\n"), HasSubstr("t.csv:3: column 'Y': 'NaN' is not a finite number"));
  EXPECT_THAT(error("1,0,1,2\n2,zero,3,2\n"), HasSubstr("t.csv:3: column 'time': 'zero'"));
  EXPECT_THAT(error("1,0,1,2\n1,0,3,4\n"),
              HasSubstr("t.csv:3: column 'track': '1' stands for the same time in line 2"));
  EXPECT_THAT(error("1,0,1,2\n2,0,1,2\n"), HasSubstr("t.csv:3: the same position as in line 2"));
  EXPECT_THAT(error(""), HasSubstr("no rows"));
  FounderOptions later;
  later.time = 6.0;
  EXPECT_THAT(error("1,0,1,2\n1,3,1,2\n", later), HasSubstr("no row has time = 6.0; times run from 0.0 to 3.0"));
  FounderOptions dish;
  dish.dish_radius_um = 10.0;
  EXPECT_THAT(error("1,0,0,0\n2,0,0,30\n", dish), HasSubstr("outside --dish-radius-um"));
}

TEST(Founders, DropsTheLaterOfTwoAndSaysSo) {
  FounderOptions options;
  options.min_distance_um = 5.0;
  // 2 is near 1; 3 is near 2 only, which is gone; 4 is exactly at the distance from 1.
  const Founders founders = select_founders(tracks("1,0,0,0\n2,0,0,4\n3,0,0,8\n4,0,5,0\n"), options);
  ASSERT_EQ(founders.kept.size(), 3u);
  ASSERT_EQ(founders.dropped.size(), 1u);
  EXPECT_EQ(founders.dropped[0].founder.line, 3u);
  EXPECT_EQ(founders.dropped[0].near.line, 2u);
  EXPECT_THAT(founders_report(founders, options), HasSubstr("DROPPED line 3: 4.0 um from line 2"));
}

TEST(Founders, ClosestPairIsThatOfBruteForce) {
  std::vector<Founder> founders;
  std::uint64_t state = 1;
  for (int i = 0; i < 300; ++i) {
    Founder founder;
    state = state * 6364136223846793005u + 1442695040888963407u;
    founder.x_um = static_cast<double>(state >> 54);  // coarse, so that many share an x
    state = state * 6364136223846793005u + 1442695040888963407u;
    founder.y_um = static_cast<double>(state >> 40);
    founders.push_back(founder);
    if (i < 1) continue;
    double best_um = 1e300;
    for (std::size_t a = 0; a < founders.size(); ++a) {
      for (std::size_t b = a + 1; b < founders.size(); ++b) {
        best_um =
            std::min(best_um, std::hypot(founders[a].x_um - founders[b].x_um, founders[a].y_um - founders[b].y_um));
      }
    }
    ASSERT_EQ(closest_pair(founders)->distance_um, best_um) << founders.size();
  }
  EXPECT_FALSE(closest_pair({founders[0]}).has_value());
}

}  // namespace
}  // namespace colony::client
