#include "engine/model/params.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "engine/base/maths.hpp"
#include "engine/shape/body.hpp"

namespace colony {
namespace {

std::string pointer_of(std::string_view path) {
  std::string pointer = "/" + std::string(path);
  std::replace(pointer.begin(), pointer.end(), '.', '/');
  return pointer;
}

std::string text_of(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string range_text(const ParamInfo& info) {
  return "must be within " + text_of(info.min) + " to " + text_of(info.max) +
         (info.unit.empty() ? "" : " " + std::string(info.unit));
}

bool inside(const ParamInfo& info, double value) { return value >= info.min && value <= info.max; }  // false for NaN

// The violation of one row, if any.
class RangeCheck {
 public:
  RangeCheck(const ParamInfo& info, Params& params, std::vector<FieldError>& errors)
      : info_(info), params_(params), errors_(errors) {}

  void operator()(Access<double> access) const { check(access(params_)); }
  void operator()(Access<std::int64_t> access) const {
    const std::int64_t value = access(params_);
    check(static_cast<double>(value));
    if (info_.power_of_two && inside(info_, static_cast<double>(value)) && (value & (value - 1)) != 0) {
      add("", "must be a power of two");
    }
  }
  void operator()(Access<bool>) const {}
  void operator()(Access<Interval> access) const {
    const Interval& interval = access(params_);
    if (!inside(info_, interval.low)) add("/0", range_text(info_));
    if (!inside(info_, interval.high)) add("/1", range_text(info_));
    if (interval.low > interval.high) add("", "the first end must not exceed the second");
  }
  void operator()(Access<std::optional<double>> access) const {
    if (access(params_)) check(*access(params_));
  }
  void operator()(Access<std::optional<std::int64_t>> access) const {
    if (access(params_)) check(static_cast<double>(*access(params_)));
  }
  void operator()(const EnumAccess& access) const {
    const int value = access.get(params_);
    if (value < 0 || value >= static_cast<int>(access.names.size())) add("", "is not one of the names allowed");
  }
  void operator()(Access<std::vector<Vec2>> access) const {
    const std::vector<Vec2>& points = access(params_);
    if (points.size() > static_cast<std::size_t>(kFoundersMax)) {
      add("", "must have at most " + std::to_string(kFoundersMax) + " positions");
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (int axis = 0; axis < 2; ++axis) {
        if (!inside(info_, points[i][axis])) add("/" + std::to_string(i) + "/" + std::to_string(axis), range_text(info_));
      }
    }
  }

 private:
  void check(double value) const {
    if (!inside(info_, value)) add("", range_text(info_));
  }
  void add(const std::string& tail, std::string message) const {
    errors_.push_back({pointer_of(info_.path) + tail, std::move(message)});
  }

  const ParamInfo& info_;
  Params& params_;
  std::vector<FieldError>& errors_;
};

/// The shorter horizontal semiaxis of the smallest cell that a division can make.
double smallest_semiaxis_um(const Params& p) {
  const double volume = p.cell.pair_volume_um3.low * p.cell.smaller_share.low;
  const double mean = maths::cbrt(3.0 * volume / (4.0 * maths::kPi * p.cell.flatness.high));
  return mean / std::sqrt(p.cell.elongation.high);
}

// Rules between parameters. A rule is asked only where every parameter in it is inside its own range: all violations come at
// once, and none is only the echo of another.
class CrossCheck {
 public:
  CrossCheck(const Params& params, std::vector<FieldError>& errors) : p_(params), errors_(errors), own_count_(errors.size()) {}

  void run() {
    const Params& p = p_;
    const bool normal = p.cycle.distribution == CycleDistribution::kNormal;  // each rule only where its number is used
    if (normal && sound({"/cycle/sd_h", "/cycle/mean_h"}) && p.cycle.sd_h > p.cycle.mean_h / 4) {
      errors_.push_back({"/cycle/sd_h", "must be at most a quarter of mean_h"});
    }
    if (!normal && sound({"/cycle/half_range_h", "/cycle/mean_h"}) && p.cycle.half_range_h > p.cycle.mean_h / 3) {
      errors_.push_back({"/cycle/half_range_h", "must be at most a third of mean_h"});
    }
    if (sound({"/noise/amplitude", "/noise/frequency"}) && p.noise.amplitude > 0.40 && p.noise.frequency > 5.0) {
      errors_.push_back({"/noise/amplitude", "must be at most 0.4 where frequency is above 5: the cell would fall to pieces"});
    }
    if (sound({"/contact/fitness_good", "/contact/fitness_min"}) && p.contact.fitness_good < p.contact.fitness_min) {
      errors_.push_back({"/contact/fitness_good", "must be at least fitness_min"});
    }
    const double shortest_h = cycle_range_h(p).low;
    if (sound({"/cycle", "/division/settle_h", "/window_h"}) && !(shortest_h > p.division.settle_h + p.window_h)) {
      errors_.push_back({"/cycle/mean_h", "the shortest cycle that can be drawn, " + text_of(shortest_h) +
                                              " h, must be longer than settle_h plus window_h, " +
                                              text_of(p.division.settle_h + p.window_h) + " h"});
    }
    if (sound({"/window_h", "/division/settle_h"}) && p.window_h > p.division.settle_h) {
      errors_.push_back({"/window_h", "must be at most division.settle_h"});
    }
    if (sound({"/window_h", "/wake/retry_h"}) && p.window_h > p.wake.retry_h) {
      errors_.push_back({"/window_h", "must be at most wake.retry_h"});
    }
    if (sound({"/cell"}) && p.cell.nucleus_radius_um.high > smallest_semiaxis_um(p)) {
      errors_.push_back({"/cell/nucleus_radius_um", "the largest nucleus must fit the smallest cell, whose shorter horizontal semiaxis is " +
                                                        text_of(smallest_semiaxis_um(p)) + " um"});
    }
    const bool moves = sound({"/motility/rate_per_h"}) && p.motility.rate_per_h > 0.0;
    if (moves && p.motility.rate_per_h < kMoveRateMin_per_h) {
      errors_.push_back({"/motility/rate_per_h", "must be 0 (no moves) or at least " + text_of(kMoveRateMin_per_h) + " 1/h"});
    }
    if (moves && sound({"/window_h"}) && p.window_h > move_delay_min_h(p.motility)) {
      errors_.push_back({"/window_h", "must be at most " + text_of(move_delay_min_h(p.motility)) +
                                          " h, the shortest time between two moves at this motility.rate_per_h"});
    }
    if (moves && sound({"/layers"}) && p.layers == Layers::kMulti) {
      errors_.push_back({"/motility/rate_per_h", "must be 0 where layers is multi: moves are simulated in one layer only"});
    }
  }

 private:
  // No range error at or below any of these pointers.
  bool sound(std::initializer_list<std::string_view> pointers) const {
    for (std::size_t i = 0; i < own_count_; ++i) {
      for (const std::string_view pointer : pointers) {
        if (std::string_view(errors_[i].pointer).substr(0, pointer.size()) == pointer) return false;
      }
    }
    return true;
  }

  const Params& p_;
  std::vector<FieldError>& errors_;
  const std::size_t own_count_;  // of the range errors, which come first
};

constexpr std::array<std::string_view, 4> kPresets = {"paper", "young-colony", "clonogenic", "tumour"};

}  // namespace

std::span<const std::string_view> preset_names() { return kPresets; }

std::string_view preset_text(std::string_view name) {
  if (name == "paper") return "one cell grows into a contact-inhibited monolayer, with the parameters of the paper";
  if (name == "young-colony") return "as paper, but the cells crawl: a young colony whose cells stand almost separately";
  if (name == "clonogenic") return "100 founders over a disc of a 96-well plate's well: separate colonies in one dish";
  if (name == "tumour") return "as paper, but cells pile up in several layers and divide without a generation limit";
  return {};
}

std::optional<Params> preset(std::string_view name) {
  Params params;
  if (name == "paper") return params;
  if (name == "young-colony") {
    params.motility.rate_per_h = 0.1;
    return params;
  }
  if (name == "clonogenic") {
    // A well of a 96-well plate has a diameter of about 6.4 mm.
    params.dish.radius_um = 3200.0;
    params.founders.count = 100;
    params.founders.radius_um = 2500.0;
    return params;
  }
  if (name == "tumour") {
    params.division.generation_limit = std::nullopt;
    params.layers = Layers::kMulti;
    return params;
  }
  return std::nullopt;
}

std::vector<FieldError> validate(const Params& params, const std::vector<FieldError>& known) {
  Params copy = params;  // accessors give mutable references
  std::vector<FieldError> errors = known;
  for (const ParamInfo& info : param_table()) std::visit(RangeCheck(info, copy, errors), info.access);
  CrossCheck(params, errors).run();
  errors.erase(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(known.size()));
  return errors;
}

Interval cycle_range_h(const Params& params) {
  const CycleParams& cycle = params.cycle;
  const double half = cycle.distribution == CycleDistribution::kNormal ? 3.0 * cycle.sd_h : cycle.half_range_h;
  return {cycle.mean_h - half, cycle.mean_h + half};
}

double move_delay_min_h(const MotilityParams& motility) { return std::min(1.0, 0.5 / motility.rate_per_h); }

namespace {
/// sqrt(AB) of the largest cell that a division or a founding can make.
double largest_mean_semiaxis_um(const Params& params) {
  const double volume = params.cell.pair_volume_um3.high * (1.0 - params.cell.smaller_share.low);
  return maths::cbrt(3.0 * volume / (4.0 * maths::kPi * params.cell.flatness.low));
}
/// Of the noise-free ellipsoid, in units of sqrt(AB): no axis is longer than the longest semiaxis.
double longest_ratio(const Params& params) {
  return std::max(std::sqrt(params.cell.elongation.high), params.cell.flatness.high);
}
constexpr double kRoundingMargin = 1.000001;  // bounds are compared with values computed along other paths
}  // namespace

double body_half_extent_max_um(const Params& params) {
  return kRoundingMargin * largest_mean_semiaxis_um(params) * longest_ratio(params) *
         std::sqrt(1.0 + noise_bound(params.noise));
}

double body_top_max_um(const Params& params) {
  // C grows with the flatness (as its power 2/3), A and B fall with it: each is bounded on its own. A tilt about two axes lifts an end of A
  // or B by at most its length times the sine of both tilts together; added, not in quadrature.
  const double volume = params.cell.pair_volume_um3.high * (1.0 - params.cell.smaller_share.low);
  const double flattest = largest_mean_semiaxis_um(params) * longest_ratio(params);
  const double tallest = params.cell.flatness.high * maths::cbrt(3.0 * volume / (4.0 * maths::kPi * params.cell.flatness.high));
  const double lift = maths::sincos(std::min(2.0 * params.search.tilt_max_deg * maths::kPi / 180.0, 0.5 * maths::kPi)).sin;
  const double half = std::sqrt(1.0 + noise_bound(params.noise)) * (tallest + lift * flattest);
  const double centre = (params.layers == Layers::kMono ? 0.55 : 2.55) * tallest;
  return kRoundingMargin * (centre + half);
}

double search_reach_um(const Params& params) {
  // A candidate's centre lies at most distance * half-width along n and sideways * sqrt(AB) across it from the nucleus centre;
  // a half-width is at most the longest semiaxis. Added (not in quadrature): a bound, not an estimate.
  const double mean_semiaxis = largest_mean_semiaxis_um(params);
  return kRoundingMargin * mean_semiaxis * (params.search.distance.high * longest_ratio(params) + params.search.sideways) +
         body_half_extent_max_um(params);
}

}  // namespace colony
