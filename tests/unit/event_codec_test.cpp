// Events as JSON, rows as CSV, and the schema against the codec.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/check.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/codec_model.hpp"
#include "server/api/event_text.hpp"
#include "server/api/schema.hpp"
#include "tests/support/sample_events.hpp"
#include "tests/support/scale.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::api {
namespace {

using ::testing::HasSubstr;

// Every number of a row, as the codec and as the schema see it.
TEST(Schema, AgreesWithTheCodecOnDefaultsAndLimits) {
  const Json schema = job_spec_schema(SpecLimits{1'000'000});
  const Params paper = *preset("paper");
  int checked = 0;
  for (const ParamInfo& info : param_table()) {
    std::string path = "/properties/model/properties/" + std::string(info.path);
    if (const std::size_t dot = path.find('.'); dot != std::string::npos) path.replace(dot, 1, "/properties/");
    const Json node = schema.at(Json::json_pointer(path));
    EXPECT_THAT(node["description"].get<std::string>(), HasSubstr(std::string(info.text)));
    if (info.path != "founders.positions_um") {
      EXPECT_EQ(node["default"], encode_param(info, paper)) << path;
    }

    std::string field = "/" + std::string(info.path);
    std::replace(field.begin(), field.end(), '.', '/');
    // True if the codec finds this value itself out of its range (rules between fields are not in the schema).
    const auto out_of_range = [&](const Json& value) {
      Json model;
      model[Json::json_pointer(field)] = value;
      Params params = paper;
      std::vector<FieldError> errors;
      decode_model(model, "", params, errors);
      for (const FieldError& error : errors) {
        const bool about_range = error.message.starts_with("must be within") ||
                                 error.message.starts_with("must be one of") ||
                                 error.message.starts_with("must be a power of two");
        if (error.pointer.starts_with(field) && about_range) return true;
      }
      return false;
    };
    if (node.contains("enum")) {
      for (const Json& value : node["enum"]) EXPECT_FALSE(out_of_range(value)) << path << value;
      EXPECT_TRUE(out_of_range(node["enum"][0].is_string() ? Json("no such name") : Json(63))) << path;
      ++checked;
    } else if (node.contains("minimum")) {
      const Json low = node["minimum"], high = node["maximum"];
      EXPECT_FALSE(out_of_range(low)) << path;
      EXPECT_FALSE(out_of_range(high)) << path;
      EXPECT_TRUE(out_of_range(std::floor(high.get<double>()) + 1.0)) << path;
      EXPECT_TRUE(out_of_range(std::ceil(low.get<double>()) - 1.0)) << path;
      ++checked;
    } else if (node.contains("items") && info.path != "founders.positions_um") {
      const Json low = node["items"]["minimum"], high = node["items"]["maximum"];
      EXPECT_FALSE(out_of_range(Json::array({low, high}))) << path;
      EXPECT_TRUE(out_of_range(Json::array({low.get<double>() - 0.01, high}))) << path;
      EXPECT_TRUE(out_of_range(Json::array({low, high.get<double>() + 0.01}))) << path;
      ++checked;
    } else {
      EXPECT_TRUE(node["type"] == "boolean" || info.path == "founders.positions_um") << path;
    }
  }
  EXPECT_GE(checked, 40);
}

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

TEST(EventJson, EveryNumberRoundTrips) {
  const server::testing::FakeJobs jobs;
  ASSERT_GT(jobs.history.size(), 10u);
  std::vector<bool> seen(kEventKindCount);
  for (const Event& event : jobs.history) {
    const Json json = *parse_json(to_text(encode_event(event)));
    seen[static_cast<std::size_t>(event.kind())] = true;
    EXPECT_EQ(json["seq"], event.seq);
    EXPECT_TRUE(same_bits(json["time_h"], event.time_h));
    EXPECT_EQ(json["digest"], event.digest.hex());
    EXPECT_EQ(json["cell_id"].is_null(), !event.cell_id);
    if (const auto* divided = std::get_if<Divided>(&event.body)) {
      for (std::size_t i = 0; i < 2; ++i) {
        const Cell& cell = divided->cells[i];
        const Json& out = json["cells"][i];
        EXPECT_EQ(out["cell_id"], cell.id.value);
        EXPECT_TRUE(same_bits(out["x_um"], cell.centre_um.x()));
        EXPECT_TRUE(same_bits(out["w3_rad"], cell.rotation_rad.z()));
        EXPECT_TRUE(same_bits(out["noise_v"], cell.noise_offset.y()));
        EXPECT_TRUE(same_bits(out["c_um"], cell.semiaxes_um.z()));
        EXPECT_TRUE(out["nearest_membrane_x_um"].is_null());
        EXPECT_TRUE(same_bits(out["settle_due_h"], *cell.settle_due_h));
        EXPECT_EQ(out.size(), cell_columns().size());
      }
      for (int i = 0; i < 3; ++i) {
        EXPECT_TRUE(same_bits(json["plane"]["point_um"][i], divided->plane_point_um[i]));
        EXPECT_TRUE(same_bits(json["direction"][i], divided->direction[i]));
      }
      EXPECT_TRUE(same_bits(json["fitness"], divided->fitness));
      EXPECT_EQ(json["evaluation_count"], divided->evaluation_count);
      EXPECT_EQ(json["corrected"], divided->corrected);
    }
    if (const auto* settled = std::get_if<Settled>(&event.body)) {
      EXPECT_TRUE(same_bits(json["nearest_membrane_um"][2], settled->nearest_membrane_um.z()));
      EXPECT_TRUE(same_bits(json["deformed_volume_um3"], settled->deformed_volume_um3));
    }
    if (event.kind() == EventKind::kFinished) {
      EXPECT_EQ(json["reason"], "cells");
      EXPECT_EQ(json["cell_count"], 6);
    }
  }
  EXPECT_TRUE(seen[0] && seen[1] && seen[3] && seen[6]);
}

/// Names, order and every number of the text are those of the codec.
void expect_same(const std::string& text, const Json& json) {
  const auto read = parse_json(text);
  ASSERT_TRUE(read) << read.error().message << " in " << text;
  EXPECT_EQ(to_text(*read), to_text(*parse_json(to_text(json))));
}

TEST(EventText, IsTheCodecsJson) {
  const server::testing::FakeJobs jobs;
  std::vector<Event> events = tests::events_of_every_kind();
  events.insert(events.end(), jobs.history.begin(), jobs.history.end());
  for (const Event& event : events) {
    std::string text;
    append_event_text(text, event);
    expect_same(text, encode_event(event));
    EXPECT_EQ(text.find('\n'), std::string::npos) << "one line in a stream";
    if (const auto* founded = std::get_if<Founded>(&event.body)) {
      std::string cell;
      append_cell_text(cell, founded->cell);
      expect_same(cell, encode_cell(founded->cell));
    }
  }
}

TEST(EventText, IsTheCodecsJsonForAnyNumbers) {
  // Every bit pattern is as likely: all exponents, whole numbers too.
  std::uint64_t state = 88172645463325252ULL;
  const auto next = [&] {
    for (;;) {
      state ^= state << 13;
      state ^= state >> 7;
      state ^= state << 17;
      const double value = state % 5 == 0 ? static_cast<double>(state >> 40) : std::bit_cast<double>(state);
      if (std::isfinite(value)) return value + 0.0;
    }
  };
  for (int i = 0; i < colony::testing::scaled(2000, 50'000); ++i) {
    Event event = tests::sample_event(state >> 11, Settled{});
    Settled settled;
    settled.nucleus_um = {next(), next(), next()};
    settled.nearest_membrane_um = {next(), next(), next()};
    settled.deformed_volume_um3 = next();
    settled.due_h = next();
    event.time_h = next();
    event.body = settled;
    std::string text;
    append_event_text(text, event);
    expect_same(text, encode_event(event));
    const Json read = *parse_json(text);
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(same_bits(read["nucleus_um"][k], settled.nucleus_um[k])) << text;
    ASSERT_TRUE(read["time_h"].is_number_float()) << "a double looks like one: " << text;
  }
}

TEST(EventText, RefusesWhatJsonCannotSay) {
  Event event = tests::sample_event(1, Senesced{});
  event.time_h = std::nan("");
  std::string text;
  EXPECT_THROW(append_event_text(text, event), CheckFailure);
}

TEST(EventJson, InhibitedCarriesItsSearch) {
  Event event;
  event.seq = 9;
  event.time_h = 1.5;
  event.cell_id = CellId{4};
  event.body = Inhibited{0.7, 0.1, 2, 416, true, std::nullopt};
  EXPECT_EQ(to_text(encode_event(event)),
            R"({"seq":9,"time_h":1.5,"kind":"inhibited","cell_id":4,"digest":"00000000000000000000000000000000",)"
            R"("fitness":0.7,"free_share":0.1,"try_count":2,"evaluation_count":416,"corrected":true,"due_h":null})");
}

TEST(Csv, FollowsRfc4180AndRoundTrips) {
  std::string out;
  for (const Field& field :
       {Field(), Field(std::int64_t{-7}), Field(0.1), Field(1e300), Field(true), Field(std::string("a,\"b\"\r\n"))}) {
    append_csv_field(out, field);
    out += '|';
  }
  EXPECT_EQ(out, "|-7|0.1|1e+300|true|\"a,\"\"b\"\"\r\n\"|");
  std::string header;
  append_csv_header(header, series_columns());
  EXPECT_EQ(
      header,
      "time_h,cell_count,active_count,passive_count,senescent_count,volume_mean_um3,volume_sd_um3,radius_um,area_um2,"
      "density_per_mm2\r\n");
}

}  // namespace
}  // namespace colony::server::api
