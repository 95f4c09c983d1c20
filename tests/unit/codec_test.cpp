// The codec: strict JSON, specs, events, CSV, schema.
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api_support.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/codec_model.hpp"
#include "server/api/codec_spec.hpp"
#include "server/api/estimate.hpp"
#include "server/api/schema.hpp"
#include "server/api/suggest.hpp"

namespace colony::server::api {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;

Result<JobSpec> decode(const std::string& text) {
  const auto json = parse_json(text);
  if (!json) return json.error();
  return decode_spec(*json, SpecLimits{1'000'000});
}

std::vector<std::string> pointers(const Result<JobSpec>& result) {
  std::vector<std::string> out;
  if (!result) {
    for (const FieldError& field : result.error().fields) out.push_back(field.pointer);
  }
  return out;
}

std::string with_model(const std::string& model) { return R"({"until": {"cells": 10}, "model": )" + model + "}"; }

struct Malformed {
  std::string text;
  std::string says;
  std::string pointer = "-";
};

TEST(StrictJson, RefusesEveryOtherReadingWithTheByteOffset) {
  const std::vector<Malformed> cases = {
      {"", "offset 0"},
      {"{", "offset"},
      {R"({"a": })", "offset 6"},
      {R"({"a": 1} x)", "offset"},
      {R"({"a": NaN})", "offset 6"},
      {R"({"a": Infinity})", "offset 6"},
      {R"({"a": 1e999})", "overflow"},
      {R"({"a": -1e999})", "overflow"},
      {R"({"a": 01})", "offset"},
      {"[1, /* c */ 2]", "offset"},
      {"\xEF\xBB\xBF{}", "byte order mark"},
      {"{\"\xff\": 1}", "offset"},
      {"\"\xC0\x80\"", "offset"},
      {"\"\xED\xA0\x80\"", "offset"},
      {R"(["\ud800"])", "offset"},
      {R"({"a": 1, "a": 2})", "offset 12: the member name is used twice", "/a"},
      {R"({"b": [{"a": 1, "a": 2}]})", "twice", "/b/0/a"},
      {R"({"a": "x\u0000y"})", "U+0000", "/a"},
      {R"({"a\u0000": 1})", "U+0000"},
  };
  for (const Malformed& one : cases) {
    const auto result = parse_json(one.text);
    ASSERT_FALSE(result) << one.text;
    EXPECT_EQ(result.error().code, ErrorCode::kMalformed) << one.text;
    EXPECT_THAT(result.error().message, HasSubstr("malformed JSON at byte offset")) << one.text;
    EXPECT_THAT(result.error().message, HasSubstr(one.says)) << one.text;
    if (one.pointer != "-") {
      ASSERT_EQ(result.error().fields.size(), 1u) << one.text;
      EXPECT_EQ(result.error().fields[0].pointer, one.pointer);
    }
  }
}

TEST(StrictJson, BoundsDepthAndMembers) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse_json(nested(kJsonDepthMax)));
  EXPECT_FALSE(parse_json(nested(kJsonDepthMax + 1)));
  EXPECT_FALSE(parse_json(std::string(200'000, '[')));
  std::string many = "{";
  for (std::size_t i = 0; i <= kJsonMembersMax; ++i) many += (i ? ",\"" : "\"") + std::to_string(i) + "\":1";
  EXPECT_FALSE(parse_json(many + "}"));
}

TEST(StrictJson, KeepsValuesAndOrder) {
  const auto json = parse_json(R"( {"z": [1, -2, 3.5, true, null, "ü\n"], "a": {"b": {}}, "m": -0.0} )");
  ASSERT_TRUE(json);
  EXPECT_EQ(to_text(*json), R"({"z":[1,-2,3.5,true,null,"ü\n"],"a":{"b":{}},"m":0.0})");
}

TEST(StrictJson, IntegersAreIntegralNumbersWithin64Bits) {
  EXPECT_EQ(integer_of(*parse_json("12")), 12);
  EXPECT_EQ(integer_of(*parse_json("12.0")), 12);
  EXPECT_EQ(integer_of(*parse_json("1.2e1")), 12);
  EXPECT_EQ(integer_of(*parse_json("12.5")), std::nullopt);
  EXPECT_EQ(integer_of(*parse_json("99999999999999999999999")), std::nullopt);
  EXPECT_EQ(integer_of(*parse_json("18446744073709551615")), std::nullopt);
  EXPECT_EQ(integer_of(*parse_json("\"12\"")), std::nullopt);
}

TEST(Spec, DefaultsAreDocumentedOnes) {
  const auto spec = decode(R"({"until": {"cells": 10}})");
  ASSERT_TRUE(spec);
  EXPECT_EQ(spec->run.seed, 1u);
  EXPECT_EQ(spec->preset, "paper");
  EXPECT_EQ(spec->run.until.cells, 10u);
  EXPECT_EQ(spec->run.until.time_h, 10'000.0);
  EXPECT_EQ(spec->name, "");
}

TEST(Spec, OneFaultIsNamedByItsPointer) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"[]", ""},
      {"null", ""},
      {R"({"until": {"cells": 1}, "a/b~c": 1})", "/a~1b~0c"},
      {R"({"preset": "paper"})", "/until"},
      {R"({"until": {}})", "/until"},
      {R"({"until": 5})", "/until"},
      {R"({"until": {"cells": 0}})", "/until/cells"},
      {R"({"until": {"cells": -5}})", "/until/cells"},
      {R"({"until": {"cells": 1e15}})", "/until/cells"},
      {R"({"until": {"cells": 1.5}})", "/until/cells"},
      {R"({"until": {"cells": 1000001}})", "/until/cells"},
      {R"({"until": {"time_h": 0}})", "/until/time_h"},
      {R"({"until": {"time_h": -1}})", "/until/time_h"},
      {R"({"until": {"time_h": 1e300}})", "/until/time_h"},
      {R"({"until": {"time_h": null}})", "/until/time_h"},
      {R"({"until": {"cells": 1, "hours": 3}})", "/until/hours"},
      {R"({"until": {"cells": 1}, "seed": -1})", "/seed"},
      {R"({"until": {"cells": 1}, "seed": 1.5})", "/seed"},
      {R"({"until": {"cells": 1}, "seed": 9007199254740992})", "/seed"},
      {R"({"until": {"cells": 1}, "seed": 99999999999999999999})", "/seed"},
      {R"({"until": {"cells": 1}, "preset": "made-up"})", "/preset"},
      {R"({"until": {"cells": 1}, "preset": "tumour"})", "/preset"},
      {R"({"until": {"cells": 1}, "preset": "young-colony"})", "/preset"},
      {R"({"until": {"cells": 1}, "preset": null})", "/preset"},
      {R"({"until": {"cells": 1}, "name": 7})", "/name"},
      {R"({"until": {"cells": 1}, "name": "a\nb"})", "/name"},
      {R"({"until": {"cells": 1}, "labels": []})", "/labels"},
      {R"({"until": {"cells": 1}, "labels": {"a": 1}})", "/labels/a"},
      {R"({"until": {"cells": 1}, "labels": {"A b": "x"}})", "/labels/A b"},
      {R"({"until": {"cells": 1}, "labels": {"": "x"}})", "/labels/"},
      {with_model("[]"), "/model"},
      {with_model(R"({"cycle": 3})"), "/model/cycle"},
      {with_model(R"({"weather": {}})"), "/model/weather"},
      {with_model(R"({"cycle": {"median_h": 12}})"), "/model/cycle/median_h"},
      {with_model(R"({"cycle": {"mean_h": "12"}})"), "/model/cycle/mean_h"},
      {with_model(R"({"cycle": {"mean_h": null}})"), "/model/cycle/mean_h"},
      {with_model(R"({"cycle": {"mean_h": 1e12}})"), "/model/cycle/mean_h"},
      {with_model(R"({"cycle": {"mean_h": 3, "sd_h": 0.5, "half_range_h": 1}})"), "/model/cycle/mean_h"},
      {with_model(R"({"cycle": {"mean_h": 30, "sd_h": 8}})"), "/model/cycle/sd_h"},
      {with_model(R"({"division": {"inhibition": 1}})"), "/model/division/inhibition"},
      {with_model(R"({"division": {"generation_limit": 2.5}})"), "/model/division/generation_limit"},
      {with_model(R"({"search": {"population": 32.5}})"), "/model/search/population"},
      {with_model(R"({"search": {"points": 100}})"), "/model/search/points"},
      {with_model(R"({"cell": {"elongation": [1]}})"), "/model/cell/elongation"},
      {with_model(R"({"cell": {"elongation": [1, "x"]}})"), "/model/cell/elongation"},
      {with_model(R"({"cell": {"elongation": [1.7, 1]}})"), "/model/cell/elongation"},
      {with_model(R"({"cell": {"elongation": [1, 4]}})"), "/model/cell/elongation/1"},
      {with_model(R"({"contact": {"rule": "product"}})"), "/model/contact/rule"},
      {with_model(R"({"contact": {"fitness_min": 0.9, "fitness_good": 0.8}})"), "/model/contact/fitness_good"},
      {with_model(R"({"noise": {"amplitude": 0.46}})"), "/model/noise/amplitude"},
      {with_model(R"({"noise": {"amplitude": 0.42, "frequency": 6}})"), "/model/noise/amplitude"},
      {with_model(R"({"noise": {"frequency": 1.9}})"), "/model/noise/frequency"},
      {with_model(R"({"layers": "multi"})"), "/model/layers"},
      {with_model(R"({"motility": {"rate_per_h": 0.1}})"), "/model/motility/rate_per_h"},
      {with_model(R"({"dish": {"radius_um": -100}})"), "/model/dish/radius_um"},
      {with_model(R"({"founders": {"count": 0}})"), "/model/founders/count"},
      {with_model(R"({"founders": {"count": 100001}})"), "/model/founders/count"},
      {with_model(R"({"founders": {"positions_um": []}})"), "/model/founders/positions_um"},
      {with_model(R"({"founders": {"positions_um": [[0]]}})"), "/model/founders/positions_um/0"},
      {with_model(R"({"founders": {"positions_um": [[0, 0]], "count": 1}})"), "/model/founders"},
      {with_model(R"({"founders": {"positions_um": [[0, 0], [500, 0], [0.5, 0]]}})"), "/model/founders/positions_um/2"},
      {with_model(R"({"founders": {"positions_um": [[0, 0], [500, 0]]}, "dish": {"radius_um": 200}})"), "/model/founders/positions_um/1"},
  };
  for (const auto& [text, pointer] : cases) {
    const auto result = decode(text);
    ASSERT_FALSE(result) << text;
    EXPECT_EQ(result.error().code, ErrorCode::kInvalid) << text;
    EXPECT_THAT(pointers(result), ElementsAre(pointer)) << text;
  }
}

TEST(Spec, AllFaultsAreNamedAtOnce) {
  const auto result = decode(R"({"seed": -1, "colour": "red", "preset": 3, "labels": {"X": "y"}, "name": 3, "until": {"cells": 0},
      "model": {"noise": {"amplitude": 9}, "cycle": {"mean_h": "x", "sd_h": -4, "oops": 1}, "window_h": 99}})");
  ASSERT_FALSE(result);
  EXPECT_THAT(pointers(result),
              ::testing::UnorderedElementsAre("/seed", "/colour", "/preset", "/labels/X", "/name", "/until/cells", "/model/noise/amplitude",
                                              "/model/cycle/mean_h", "/model/cycle/sd_h", "/model/cycle/oops", "/model/window_h"));
}

TEST(Spec, AFieldOfTheWrongTypeDoesNotAccuseItsNeighbours) {
  // sd_h 4 is right for a mean of 16; the default mean of 12 that stands in for "16" must not be held against it.
  EXPECT_THAT(pointers(decode(with_model(R"({"cycle": {"mean_h": "16", "sd_h": 4}})"))), ElementsAre("/model/cycle/mean_h"));
}

TEST(Spec, NearMissesAreSuggested) {
  const auto message = [](const std::string& text) { return decode(text).error().fields.at(0).message; };
  EXPECT_THAT(message(with_model(R"({"cycle": {"mean": 12}})")), HasSubstr("did you mean mean_h?"));
  EXPECT_THAT(message(with_model(R"({"cycel": {}})")), HasSubstr("did you mean cycle?"));
  EXPECT_THAT(message(with_model(R"({"mean_h": 12})")), HasSubstr("did you mean model.cycle.mean_h?"));
  EXPECT_THAT(message(R"({"until": {"cells": 1}, "mean_h": 12})"), HasSubstr("did you mean model.cycle.mean_h?"));
  EXPECT_THAT(message(R"({"until": {"cells": 1}, "lables": {}})"), HasSubstr("did you mean labels?"));
  EXPECT_THAT(message(R"({"until": {"cells": 1}, "preset": "papr"})"), HasSubstr("did you mean paper?"));
  EXPECT_EQ(message(R"({"until": {"cells": 1}, "xyzzy": 1})"), "unknown field");
}

TEST(Spec, LabelAndNameLimits) {
  const auto labelled = [](const std::string& key, const std::string& value) {
    return decode(R"({"until": {"cells": 1}, "labels": {")" + key + R"(": ")" + value + "\"}}");
  };
  EXPECT_TRUE(labelled(std::string(63, 'k'), std::string(255, 'v')));
  EXPECT_FALSE(labelled(std::string(64, 'k'), "v"));
  EXPECT_FALSE(labelled("k", std::string(256, 'v')));
  const auto named = [](const std::string& name) { return decode(R"({"until": {"cells": 1}, "name": ")" + name + "\"}"); };
  std::string umlauts;
  for (int i = 0; i < 200; ++i) umlauts += "ü";
  EXPECT_TRUE(named(umlauts)) << "characters are counted, not bytes";
  EXPECT_FALSE(named(umlauts + "x"));
  std::string labels;
  for (int i = 0; i <= 32; ++i) labels += (i ? ",\"" : "\"") + std::string("k") + std::to_string(i) + "\":\"\"";
  EXPECT_THAT(pointers(decode(R"({"until": {"cells": 1}, "labels": {)" + labels + "}}")), ElementsAre("/labels"));
}

TEST(Spec, RoundTripsWithEveryParameter) {
  const std::vector<std::string> texts = {
      R"({"until": {"cells": 10}})",
      R"({"seed": 9007199254740991, "preset": "clonogenic", "until": {"time_h": 0.1}, "model": {"founders": {"count": 3}}})",
      with_model(R"({"founders": {"positions_um": [[0.1, -3e2], [123.456789012345678, 7]]}, "division": {"generation_limit": null},
                     "search": {"mutation_rate": 0.123456789012345678}, "cycle": {"mean_h": 12.000000000000002}})"),
  };
  for (const std::string& text : texts) {
    const auto first = decode(text);
    ASSERT_TRUE(first) << text << pointers(first).at(0);
    const std::string normalised = to_text(encode_spec(*first));
    const auto second = decode(normalised);
    ASSERT_TRUE(second) << normalised;
    EXPECT_EQ(to_text(encode_spec(*second)), normalised);
    const auto stored = decode_stored_spec(normalised);
    ASSERT_TRUE(stored);
    for (const ParamInfo& info : param_table()) {
      EXPECT_EQ(encode_param(info, stored->params), encode_param(info, first->run.params)) << info.path;
      const bool by_position = !first->run.params.founders.positions_um.empty();
      if (info.path.starts_with("founders.") && (info.path == "founders.positions_um") != by_position) continue;
      std::string pointer = "/model/" + std::string(info.path);
      std::replace(pointer.begin() + 7, pointer.end(), '.', '/');
      EXPECT_TRUE(Json::parse(normalised).contains(Json::json_pointer(pointer))) << pointer;
    }
    EXPECT_EQ(stored->seed, first->run.seed);
    EXPECT_EQ(stored->until.time_h, first->run.until.time_h);
    EXPECT_EQ(stored->until.cells, first->run.until.cells);
  }
}

TEST(Spec, AStoredSpecIsNotHeldToLimitsOfToday) {
  JobSpec spec = *decode(R"({"until": {"cells": 1000000}})");
  spec.run.until.cells = 3'000'000;
  EXPECT_TRUE(decode_stored_spec(to_text(encode_spec(spec))));
}

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
        const bool about_range = error.message.starts_with("must be within") || error.message.starts_with("must be one of") ||
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

TEST(EventJson, InhibitedCarriesItsSearch) {
  Event event;
  event.seq = 9;
  event.time_h = 1.5;
  event.cell_id = CellId{4};
  event.body = Inhibited{0.7, 0.1, 2, 416, true, std::nullopt};
  EXPECT_EQ(to_text(encode_event(event)),
            R"({"seq":9,"time_h":1.5,"kind":"inhibited","cell_id":4,"digest":"00000000000000000000000000000000","fitness":0.7,)"
            R"("free_share":0.1,"try_count":2,"evaluation_count":416,"corrected":true,"due_h":null})");
}

TEST(Csv, FollowsRfc4180AndRoundTrips) {
  std::string out;
  for (const Field& field : {Field(), Field(std::int64_t{-7}), Field(0.1), Field(1e300), Field(true), Field(std::string("a,\"b\"\r\n"))}) {
    append_csv_field(out, field);
    out += '|';
  }
  EXPECT_EQ(out, "|-7|0.1|1e+300|true|\"a,\"\"b\"\"\r\n\"|");
  std::string header;
  append_csv_header(header, series_columns());
  EXPECT_EQ(header, "time_h,cell_count,active_count,passive_count,senescent_count,volume_mean_um3,volume_sd_um3,radius_um,area_um2,"
                    "density_per_mm2\r\n");
}

TEST(Suggestion, OnlyNearNames) {
  const std::vector<std::string_view> names = {"mean_h", "sd_h"};
  EXPECT_EQ(suggestion("mean_hh", names), ", did you mean mean_h?");
  EXPECT_EQ(suggestion("zzz", names), "");
  EXPECT_EQ(suggestion(std::string(10'000, 'm'), names), "");
}

TEST(EstimateOfAJob, StaysWithinItsBoundsAndNamesItsBasis) {
  const auto of = [](const std::string& text) { return estimate(decode(text)->run); };
  EXPECT_EQ(of(R"({"until": {"cells": 180}})").cells, 180u);
  EXPECT_LE(of(R"({"until": {"time_h": 5000}})").cells, 1600u) << "the generation limit ends a lone colony";
  EXPECT_LT(of(R"({"until": {"time_h": 50}})").cells, 40u);
  EXPECT_LT(of(R"({"until": {"cells": 100}})").wall_s, of(R"({"until": {"cells": 1000}})").wall_s);
  EXPECT_FALSE(of(R"({"until": {"cells": 100}})").basis.empty());
}

}  // namespace
}  // namespace colony::server::api
