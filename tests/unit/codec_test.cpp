// Job specs: every fault by its pointer, all at once, and the way back.
#include <algorithm>
#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/codec_model.hpp"
#include "server/api/codec_spec.hpp"
#include "server/api/estimate.hpp"
#include "server/api/suggest.hpp"

namespace colony::server::api {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Result<JobSpec> decode(const std::string& text) {
  const auto json = parse_json(text);
  if (!json) return json.error();
  auto spec = decode_spec(*json, SpecLimits{1'000'000});
  if (!spec) return spec;
  if (const Status placed = check_founders(spec->run, nullptr); !placed) return placed.error();
  return spec;
}

std::vector<std::string> pointers(const Result<JobSpec>& result) {
  std::vector<std::string> out;
  if (!result) {
    for (const FieldError& field : result.error().fields) out.push_back(field.pointer);
  }
  return out;
}

std::string with_model(const std::string& model) { return R"({"until": {"cells": 10}, "model": )" + model + "}"; }

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
      {R"({"until": {"cells": 4}, "model": {"founders": {"count": 5, "radius_um": 500}}})", "/until/cells"},
      {R"({"until": {"time_h": -1}})", "/until/time_h"},
      {R"({"until": {"time_h": 1e300}})", "/until/time_h"},
      {R"({"until": {"time_h": null}})", "/until/time_h"},
      {R"({"until": {"cells": 1, "hours": 3}})", "/until/hours"},
      {R"({"until": {"cells": 1}, "seed": -1})", "/seed"},
      {R"({"until": {"cells": 1}, "seed": 1.5})", "/seed"},
      {R"({"until": {"cells": 1}, "seed": 9007199254740992})", "/seed"},
      {R"({"until": {"cells": 1}, "seed": 99999999999999999999})", "/seed"},
      {R"({"until": {"cells": 1}, "preset": "made-up"})", "/preset"},
      {R"({"until": {"cells": 1}, "preset": "tumor"})", "/preset"},
      {R"({"until": {"cells": 1}, "preset": "young-colonies"})", "/preset"},
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
      {with_model(R"({"layers": "two"})"), "/model/layers"},
      {with_model(R"({"layers": "multi", "motility": {"rate_per_h": 0.1}})"), "/model/motility/rate_per_h"},
      {with_model(R"({"motility": {"rate_per_h": 2.1}})"), "/model/motility/rate_per_h"},
      {with_model(R"({"motility": {"rate_per_h": 1e-9}})"), "/model/motility/rate_per_h"},
      {with_model(R"({"motility": {"rate_per_h": 1}})"), "/model/window_h"},
      {with_model(R"({"dish": {"radius_um": -100}})"), "/model/dish/radius_um"},
      {with_model(R"({"founders": {"count": 0}})"), "/model/founders/count"},
      {with_model(R"({"founders": {"count": 100001}})"), "/model/founders/count"},
      {with_model(R"({"founders": {"positions_um": []}})"), "/model/founders/positions_um"},
      {with_model(R"({"founders": {"positions_um": [[0]]}})"), "/model/founders/positions_um/0"},
      {with_model(R"({"founders": {"positions_um": [[0, 0]], "count": 1}})"), "/model/founders"},
      {with_model(R"({"founders": {"positions_um": [[0, 0], [500, 0], [0.5, 0]]}})"), "/model/founders/positions_um/2"},
      {with_model(R"({"founders": {"positions_um": [[0, 0], [500, 0]]}, "dish": {"radius_um": 200}})"),
       "/model/founders/positions_um/1"},
  };
  for (const auto& [text, pointer] : cases) {
    const auto result = decode(text);
    ASSERT_FALSE(result) << text;
    EXPECT_EQ(result.error().code, ErrorCode::kInvalid) << text;
    EXPECT_THAT(pointers(result), ElementsAre(pointer)) << text;
  }
}

TEST(Spec, AllFaultsAreNamedAtOnce) {
  const auto result =
      decode(R"({"seed": -1, "colour": "red", "preset": 3, "labels": {"X": "y"}, "name": 3, "until": {"cells": 0},
      "model": {"noise": {"amplitude": 9}, "cycle": {"mean_h": "x", "sd_h": -4, "oops": 1}, "window_h": 99}})");
  ASSERT_FALSE(result);
  EXPECT_THAT(pointers(result),
              ::testing::UnorderedElementsAre("/seed", "/colour", "/preset", "/labels/X", "/name", "/until/cells",
                                              "/model/noise/amplitude", "/model/cycle/mean_h", "/model/cycle/sd_h",
                                              "/model/cycle/oops", "/model/window_h"));
}

TEST(Spec, AFieldOfTheWrongTypeDoesNotAccuseItsNeighbours) {
  // sd_h 4 is right for a mean of 16; the default mean of 12 that stands in for "16" must not be held against it.
  EXPECT_THAT(pointers(decode(with_model(R"({"cycle": {"mean_h": "16", "sd_h": 4}})"))),
              ElementsAre("/model/cycle/mean_h"));
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
  const auto named = [](const std::string& name) {
    return decode(R"({"until": {"cells": 1}, "name": ")" + name + "\"}");
  };
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
      R"({"seed": 9007199254740991, "preset": "clonogenic", "until": {"time_h": 0.1},
          "model": {"founders": {"count": 3}}})",
      with_model(
          R"({"founders": {"positions_um": [[0.1, -3e2], [123.456789012345678, 7]]},
              "division": {"generation_limit": null},
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

TEST(Spec, AStoredSpecIsTakenAsItStandsWithoutPlacingFounders) {
  // 5,000 founders have no room within 30 um, and are more than until.cells: neither is asked again.
  JobSpec spec = *decode(R"({"until": {"cells": 10}})");
  spec.run.params.founders.count = 5000;
  spec.run.params.founders.radius_um = 30.0;
  const auto stored = decode_stored_spec(to_text(encode_spec(spec)));
  ASSERT_TRUE(stored);
  EXPECT_EQ(founder_count(stored->params.founders), 5000u);
  const Status placed = check_founders(*stored, nullptr);
  ASSERT_FALSE(placed);
  EXPECT_EQ(placed.error().fields.at(0).pointer, "/model/founders");
}

TEST(Spec, CheckingFoundersCanBeStopped) {
  const auto spec = decode(R"({"until": {"cells": 10}})");
  const std::atomic<bool> stop{true};
  EXPECT_THROW((void)check_founders(spec->run, &stop), Stopped);
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
  EXPECT_GT(of(R"({"until": {"cells": 100}, "preset": "young-colony"})").stored_bytes,
            of(R"({"until": {"cells": 100}})").stored_bytes)
      << "moves are stored";
  const Estimate tumour = of(R"({"until": {"time_h": 726}, "preset": "tumour"})");
  EXPECT_NEAR(static_cast<double>(tumour.cells), 5000.0, 1500.0) << "as grown: 5,000 cells at 726 h";
  EXPECT_NE(tumour.basis.find("tumour"), std::string_view::npos);
}

// As measured (colony-service-bench estimate; CPU seconds over threads, so that a busy machine does not count).
TEST(EstimateOfAJob, IsWithinAFactorOfTwoOfWhatWasMeasured) {
  struct Measured {
    const char* spec;
    int threads;
    double wall_s, memory_MB, stored_MB;
  };
  constexpr Measured kMeasured[] = {
      {R"({"preset": "paper", "until": {"cells": 1000}})", 1, 0.526, 23.7, 1.24},
      {R"({"preset": "paper", "until": {"cells": 1000}})", 2, 0.281, 25.6, 1.24},
      {R"({"preset": "paper", "until": {"cells": 10000}, "model": {"division": {"generation_limit": null}}})", 1, 5.633, 48.1, 11.82},
      {R"({"preset": "paper", "until": {"cells": 10000}, "model": {"division": {"generation_limit": null}}})", 2, 2.907, 56.5, 11.82},
      {R"({"preset": "paper", "until": {"time_h": 240}})", 1, 0.123, 21.4, 0.38},
      {R"({"preset": "paper", "until": {"time_h": 5000}})", 1, 0.499, 23.4, 1.16},
      {R"({"preset": "paper", "until": {"cells": 500}, "model": {"search": {"population": 64, "generations": 24, "points": 1024}}})", 1,
       0.820, 22.1, 0.65},
      {R"({"preset": "young-colony", "until": {"cells": 2000}, "model": {"division": {"generation_limit": null}}})", 1, 3.239, 39.3, 13.39},
      {R"({"preset": "tumour", "until": {"cells": 3000}})", 1, 2.609, 31.1, 4.12},
      {R"({"preset": "tumour", "until": {"cells": 3000}})", 2, 1.369, 36.2, 4.12},
      {R"({"preset": "clonogenic", "until": {"time_h": 150}})", 1, 5.181, 50.5, 11.92},
      {R"({"preset": "clonogenic", "until": {"cells": 4000}, "model": {"founders": {"count": 340, "radius_um": 3000}}})", 1, 0.746, 33.2,
       3.58},
      {R"({"preset": "paper", "until": {"cells": 20000}, "model": {"founders": {"count": 100, "radius_um": 805}, "dish": {"radius_um": 855}}})", 1,
       12.22, 65.7, 23.12},
      {R"({"preset": "clonogenic", "until": {"cells": 30000}, "model": {"founders": {"count": 1000, "radius_um": 3000}}})", 1, 13.66, 88.2, 30.71},
  };
  for (const Measured& measured : kMeasured) {
    const Estimate found = estimate(decode(measured.spec)->run, measured.threads);
    const double ratios[] = {found.wall_s / measured.wall_s, 1e-6 * static_cast<double>(found.memory_bytes) / measured.memory_MB,
                             1e-6 * static_cast<double>(found.stored_bytes) / measured.stored_MB};
    for (const double ratio : ratios) {
      EXPECT_GT(ratio, 0.5) << measured.spec << ' ' << measured.threads;
      EXPECT_LT(ratio, 2.0) << measured.spec << ' ' << measured.threads;
    }
  }
}

}  // namespace
}  // namespace colony::server::api
