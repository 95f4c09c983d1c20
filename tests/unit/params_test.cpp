// Validation: every row of the table refuses what lies outside it, the rules between parameters hold, all errors come
// at once.
#include "engine/model/params.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace colony {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string pointer_of(const ParamInfo& info) {
  std::string pointer = "/" + std::string(info.path);
  std::replace(pointer.begin(), pointer.end(), '.', '/');
  return pointer;
}

bool has(const std::vector<FieldError>& errors, const std::string& pointer, const std::string& part = "") {
  return std::any_of(errors.begin(), errors.end(), [&](const FieldError& error) {
    return error.pointer == pointer && error.message.find(part) != std::string::npos;
  });
}

double beyond(double bound, double sign) { return bound + sign * std::max(1e-9, 1e-9 * std::abs(bound)); }

// Sets one row to `value` in every way its type allows; whole numbers are given the nearest integer.
struct Setter {
  Params& params;
  double value;
  std::string pointer;  // where an error must point; set by the visit
  bool applicable = true;
  void operator()(Access<double> access) { access(params) = value; }
  void operator()(Access<std::int64_t> access) {
    whole([&](std::int64_t v) { access(params) = v; });
  }
  void operator()(Access<bool>) { applicable = false; }
  void operator()(Access<Interval> access) {
    access(params) = {value, value};
    pointer += "/0";
  }
  void operator()(Access<std::optional<double>> access) { access(params) = value; }
  void operator()(Access<std::optional<std::int64_t>> access) {
    whole([&](std::int64_t v) { access(params) = v; });
  }
  void operator()(const EnumAccess&) { applicable = false; }
  void operator()(Access<std::vector<Vec2>> access) {
    access(params) = {Vec2(0.0, 0.0), Vec2(0.0, value)};
    pointer += "/1/1";
  }
  template <class F>
  void whole(F&& set) {
    applicable = std::isfinite(value);
    if (applicable) set(static_cast<std::int64_t>(value));
  }
};

bool is_whole(const ParamInfo& info) {
  return std::holds_alternative<Access<std::int64_t>>(info.access) ||
         std::holds_alternative<Access<std::optional<std::int64_t>>>(info.access);
}

TEST(Validate, DefaultsAndPresetsAreValid) {
  EXPECT_TRUE(validate(Params{}).empty());
  ASSERT_FALSE(preset_names().empty());
  for (const std::string_view name : preset_names()) {
    ASSERT_TRUE(preset(name)) << name;
    EXPECT_TRUE(validate(*preset(name)).empty()) << name;
    EXPECT_FALSE(preset_text(name).empty()) << name;
  }
  EXPECT_FALSE(preset("no such preset"));
}

TEST(Validate, EveryRowRefusesBelowAboveNanAndInfinityAndPointsAtItself) {
  int asked = 0;
  for (const ParamInfo& info : param_table()) {
    const double step = is_whole(info) ? 1.0 : 0.0;
    for (const double bad : {step > 0 ? info.min - 1 : beyond(info.min, -1),
                             step > 0 ? info.max + 1 : beyond(info.max, 1), kNan, kInfinity, -kInfinity}) {
      Params params;
      Setter setter{params, bad, pointer_of(info)};
      std::visit(setter, info.access);
      if (!setter.applicable) continue;
      EXPECT_TRUE(has(validate(params), setter.pointer, "must be within")) << info.path << " accepted " << bad;
      ++asked;
    }
    for (const double good : {info.min, info.max}) {
      Params params;
      Setter setter{params, good, pointer_of(info)};
      std::visit(setter, info.access);
      if (!setter.applicable) continue;
      EXPECT_FALSE(has(validate(params), setter.pointer, "must be within")) << info.path << " refused " << good;
    }
  }
  EXPECT_GT(asked, 150);
}

TEST(Validate, NullsAreAllowedWhereTheModelSaysSo) {
  Params params;
  params.division.generation_limit.reset();
  params.search.mutation_rate.reset();
  params.dish.radius_um.reset();
  EXPECT_TRUE(validate(params).empty());
}

TEST(Validate, PointCountsMustBePowersOfTwo) {
  for (const std::int64_t bad : {65, 100, 255, 257, 65'535}) {
    Params params;
    params.search.points = bad;
    params.search.points_final = bad;
    const auto errors = validate(params);
    EXPECT_TRUE(has(errors, "/search/points", "power of two")) << bad;
    EXPECT_TRUE(has(errors, "/search/points_final", "power of two")) << bad;
  }
}

TEST(Validate, EveryIntervalMustBeOrderedAndWithinItsRangeAtBothEnds) {
  for (const ParamInfo& info : param_table()) {
    if (!std::holds_alternative<Access<Interval>>(info.access)) continue;
    const auto access = std::get<Access<Interval>>(info.access);
    Params params;
    access(params) = {info.max, info.min};
    EXPECT_TRUE(has(validate(params), pointer_of(info), "must not exceed")) << info.path;
    access(params) = {info.min, beyond(info.max, 1)};
    EXPECT_TRUE(has(validate(params), pointer_of(info) + "/1", "must be within")) << info.path;
  }
}

TEST(Validate, EnumsOutsideTheirNamesAreRefused) {
  for (const ParamInfo& info : param_table()) {
    if (!std::holds_alternative<EnumAccess>(info.access)) continue;
    const EnumAccess& access = std::get<EnumAccess>(info.access);
    for (std::size_t i = 0; i < access.names.size(); ++i) {
      Params params;
      access.set(params, static_cast<int>(i));
      EXPECT_EQ(access.get(params), static_cast<int>(i));
      EXPECT_FALSE(has(validate(params), pointer_of(info), "names allowed"));
    }
    Params params;
    access.set(params, static_cast<int>(access.names.size()));
    EXPECT_TRUE(has(validate(params), pointer_of(info), "names allowed")) << info.path;
  }
}

struct CrossRule {
  const char* name;
  const char* pointer;
  void (*breaks)(Params&);
  void (*keeps)(Params&);
};

TEST(Validate, RulesBetweenParametersHoldAtTheirEdge) {
  const CrossRule rules[] = {
      {"sd a quarter of the mean", "/cycle/sd_h",
       [](Params& p) {
         p.cycle.sd_h = 3.001;
         p.division.settle_h = 1.0;
       },
       [](Params& p) { p.cycle.sd_h = 2.9; }},
      {"half range a third of the mean", "/cycle/half_range_h",
       [](Params& p) {
         p.cycle.distribution = CycleDistribution::kUniform;
         p.cycle.half_range_h = 4.001;
       },
       [](Params& p) {
         p.cycle.distribution = CycleDistribution::kUniform;
         p.cycle.half_range_h = 4.0;
       }},
      {"the half range of a uniform cycle says nothing about a normal one", "/cycle/half_range_h",
       [](Params& p) {
         p.cycle.distribution = CycleDistribution::kUniform;
         p.cycle.half_range_h = 50.0;
         p.cycle.mean_h = 100.0;
       },
       [](Params& p) { p.cycle.half_range_h = 50.0; }},
      // 320 um3 at flatness 0.6 and elongation 1.7: cbrt(3 320 / (4 pi 0.6)) / sqrt(1.7) = 3.8586 um.
      {"the nucleus fits the smallest cell", "/cell/nucleus_radius_um",
       [](Params& p) { p.cell.nucleus_radius_um = {2.5, 3.859}; },
       [](Params& p) { p.cell.nucleus_radius_um = {2.5, 3.858}; }},
      {"noise above 0.40 only at q <= 5", "/noise/amplitude",
       [](Params& p) {
         p.noise = {0.41, 5.01, 1.4};
       },
       [](Params& p) {
         p.noise = {0.45, 5.0, 1.4};
       }},
      {"noise of 0.40 at any q", "/noise/amplitude",
       [](Params& p) {
         p.noise = {0.45, 8.0, 1.4};
       },
       [](Params& p) {
         p.noise = {0.40, 8.0, 1.4};
       }},
      {"fitness_good at least fitness_min", "/contact/fitness_good", [](Params& p) { p.contact.fitness_good = 0.74; },
       [](Params& p) { p.contact.fitness_good = 0.75; }},
      {"cycle longer than settling and window", "/cycle/mean_h", [](Params& p) { p.division.settle_h = 5.0; },
       [](Params& p) { p.division.settle_h = 4.99; }},
      {"the same for a uniform cycle", "/cycle/mean_h",
       [](Params& p) {
         p.cycle = {CycleDistribution::kUniform, 4.0, 0.0, 1.0, 0.0};
       },
       [](Params& p) {
         p.cycle = {CycleDistribution::kUniform, 4.0, 0.0, 0.99, 0.0};
       }},
      {"window at most settling", "/window_h", [](Params& p) { p.division.settle_h = 0.9; },
       [](Params& p) { p.division.settle_h = 1.0; }},
      {"window at most retry", "/window_h", [](Params& p) { p.wake.retry_h = 0.9; },
       [](Params& p) { p.wake.retry_h = 1.0; }},
      {"no moves, or moves that come within a job", "/motility/rate_per_h",
       [](Params& p) { p.motility.rate_per_h = 9e-7; }, [](Params& p) { p.motility.rate_per_h = 1e-6; }},
      {"window at most the shortest time between moves", "/window_h", [](Params& p) { p.motility.rate_per_h = 0.51; },
       [](Params& p) { p.motility.rate_per_h = 0.50; }},
      {"the same at the highest rate", "/window_h",
       [](Params& p) {
         p.motility.rate_per_h = 2.0;
         p.window_h = 0.26;
       },
       [](Params& p) {
         p.motility.rate_per_h = 2.0;
         p.window_h = 0.25;
       }},
      {"the same at a low rate", "/window_h",
       [](Params& p) {
         p.motility.rate_per_h = 0.1;
         p.window_h = 1.01;
       },
       [](Params& p) { p.motility.rate_per_h = 0.1; }},
      {"no moves where there are layers", "/motility/rate_per_h",
       [](Params& p) {
         p.layers = Layers::kMulti;
         p.motility.rate_per_h = 0.1;
       },
       [](Params& p) { p.layers = Layers::kMulti; }},
  };
  for (const CrossRule& rule : rules) {
    Params params;
    rule.breaks(params);
    EXPECT_TRUE(has(validate(params), rule.pointer)) << rule.name;
    EXPECT_EQ(validate(params).size(), 1U) << rule.name;
    Params kept;
    rule.keeps(kept);
    EXPECT_TRUE(validate(kept).empty()) << rule.name;
  }
}

TEST(Validate, ReportsAllViolationsAtOnceRangesAndRulesTogether) {
  Params params;
  params.cell.elongation = {0.5, 9.0};
  params.search.points = 100;
  params.wake.tries_max = 0;
  params.noise.frequency = kNan;      // out of range: no echo from the rule on amplitude and frequency
  params.contact.fitness_good = 0.1;  // a rule between parameters
  params.founders.positions_um = {Vec2(kNan, 2e6)};
  const auto errors = validate(params);
  for (const char* pointer :
       {"/cell/elongation/0", "/cell/elongation/1", "/search/points", "/wake/tries_max", "/noise/frequency",
        "/contact/fitness_good", "/founders/positions_um/0/0", "/founders/positions_um/0/1"}) {
    EXPECT_TRUE(has(errors, pointer)) << pointer;
  }
  EXPECT_EQ(errors.size(), 8U);
}

TEST(Validate, TooManyFoundersAreRefused) {
  Params params;
  params.founders.positions_um.assign(static_cast<std::size_t>(kFoundersMax) + 1, Vec2(0, 0));
  EXPECT_TRUE(has(validate(params), "/founders/positions_um", "at most"));
}

TEST(ParamTable, PathsAreUniqueAndTextsGiven) {
  std::vector<std::string_view> paths;
  for (const ParamInfo& info : param_table()) {
    paths.push_back(info.path);
    EXPECT_FALSE(info.text.empty()) << info.path;
  }
  std::sort(paths.begin(), paths.end());
  EXPECT_EQ(std::adjacent_find(paths.begin(), paths.end()), paths.end());
}

}  // namespace
}  // namespace colony
