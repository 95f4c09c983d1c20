#include "server/api/codec_fork.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/api/codec_model.hpp"

namespace colony::server::api {
namespace {

using Errors = std::vector<FieldError>;
constexpr const char* kSummary = "the fork is wrong; nothing was stored";
constexpr std::uint64_t kSeqMax = 9'000'000'000'000'000;
constexpr std::array<std::string_view, 7> kForkNames = {"at_h", "at_seq", "model", "seed", "until", "name", "labels"};

struct Fixed {
  std::string_view prefix;  // of the paths that cannot change
  std::string_view why;
};
constexpr std::array<Fixed, 5> kFixed = {{
    {"founders.", "cannot change: the founders are placed already"},
    {"layers", "cannot change: the cells there stand by the rules of the origin's"},
    {"noise.", "cannot change: it shapes the bodies that are there"},
    {"cell.nucleus_radius_um", "cannot change: nuclei have the radius of their founder's"},
    {"wake.free_radius_um", "cannot change: the free shares of resting cells were measured with it"},
}};

std::string pointer_of(std::string_view path) {
  std::string pointer = "/model/" + std::string(path);
  std::replace(pointer.begin(), pointer.end(), '.', '/');
  return pointer;
}

std::string text_of(double value) { return to_text(Json(value)); }

/// A field whose value is wrong in itself keeps the origin's, and is not accused again.
void check_fixed(const Params& origin, const Params& params, Errors& errors) {
  for (const ParamInfo& info : param_table()) {
    for (const Fixed& fixed : kFixed) {
      if (!info.path.starts_with(fixed.prefix)) continue;
      if (encode_param(info, origin) != encode_param(info, params)) errors.push_back({pointer_of(info.path), std::string(fixed.why)});
    }
  }
  if ((origin.motility.rate_per_h > 0.0) != (params.motility.rate_per_h > 0.0)) {
    errors.push_back({"/model/motility/rate_per_h", origin.motility.rate_per_h > 0.0
                                                        ? "cannot become 0: the cells there have their next moves"
                                                        : "must stay 0: the cells there have no next moves"});
  }
}

/// Grid, voxels and search rest on the largest body there can be; the copied events hold bodies up to the origin's bound.
void check_sizes(const Params& origin, const Params& params, Errors& errors) {
  const auto bounds = [](const Params& p) { return std::array<double, 2>{body_half_extent_max_um(p), body_top_max_um(p)}; };
  const auto falls = [&](const Params& p) {
    const auto before = bounds(origin), after = bounds(p);
    return after[0] < before[0] || after[1] < before[1];
  };
  if (!falls(params)) return;
  constexpr std::array<std::string_view, 5> kPaths = {"cell.pair_volume_um3", "cell.smaller_share", "cell.elongation", "cell.flatness",
                                                      "search.tilt_max_deg"};
  const auto alone = [&](std::string_view path) {  // the origin's parameters with only this one changed
    Params p = origin;
    if (path == kPaths[0]) p.cell.pair_volume_um3 = params.cell.pair_volume_um3;
    if (path == kPaths[1]) p.cell.smaller_share = params.cell.smaller_share;
    if (path == kPaths[2]) p.cell.elongation = params.cell.elongation;
    if (path == kPaths[3]) p.cell.flatness = params.cell.flatness;
    if (path == kPaths[4]) p.search.tilt_max_deg = params.search.tilt_max_deg;
    return p;
  };
  for (const std::string_view path : kPaths) {
    if (!falls(alone(path))) continue;
    errors.push_back({pointer_of(path), "must not make the largest cell that can be drawn smaller or lower than the origin's: such cells are there"});
  }
}

/// Radius of the disc about the origin of the dish that holds every body's box.
double needed_radius_um(const Colony& colony) {
  double most = 0.0;
  for (const Cell& cell : colony.cells()) {
    const Box& box = colony.body(cell.id).box();
    const double x = std::max(std::fabs(box.low.x()), std::fabs(box.high.x()));
    const double y = std::max(std::fabs(box.low.y()), std::fabs(box.high.y()));
    most = std::max(most, std::sqrt(x * x + y * y));
  }
  return most;
}

void check_dish(const ForkSpec& fork, const JobSpec& origin, const JobService::ForkPoint& point, Errors& errors) {
  const std::optional<double> radius = fork.job.run.params.dish.radius_um, before = origin.run.params.dish.radius_um;
  if (!radius) return;
  // Cells that grew within this wall, or a narrower one, need no test. (Those copied from an origin's origin may have known another.)
  const Json past = point.origin.origin_json.empty() ? Json(nullptr) : Json::parse(point.origin.origin_json);
  const bool grew_here = past.is_null() || point.at_seq > past["at_seq"].get<std::uint64_t>();
  if (grew_here && before && *before <= *radius) return;
  const double needed = needed_radius_um(*point.at.colony);
  if (needed <= *radius) return;
  errors.push_back({"/model/dish/radius_um", "must hold every cell that is there: at least " + text_of(needed) + " um"});
}

void decode_at(const Json& body, ForkSpec& fork, Errors& errors) {
  if (body.contains("at_h") == body.contains("at_seq")) {
    errors.push_back({"", "exactly one of at_h and at_seq says where the fork begins"});
  }
  if (const auto at = body.find("at_h"); at != body.end()) {
    const double at_h = at->is_number() ? at->get<double>() : -1.0;
    if (at_h >= 0.0 && at_h <= kUntilTimeMax_h)
      fork.at_h = at_h;
    else
      errors.push_back({"/at_h", "must be a number within 0 to 100000 h"});
  }
  if (const auto at = body.find("at_seq"); at != body.end()) {
    const auto seq = integer_of(*at);
    if (seq && *seq >= 1 && static_cast<std::uint64_t>(*seq) <= kSeqMax)
      fork.at_seq = static_cast<std::uint64_t>(*seq);
    else
      errors.push_back({"/at_seq", "must be an integer, 1 or more: from the beginning a job is submitted, not forked"});
  }
}

Json origin_of(const JobService::ForkPoint& point) {
  const JobRow& job = point.origin;
  return {{"job_id", job.id},
          {"at_seq", point.at_seq},
          {"spec", Json::parse(job.spec_json)},
          {"origin", job.origin_json.empty() ? Json(nullptr) : Json::parse(job.origin_json)}};
}

int depth_of(const Json& origin) {
  int depth = 0;
  for (const Json* at = &origin; at->is_object(); at = &(*at)["origin"]) ++depth;
  return depth;
}

Result<std::vector<Stretch>> stretches_of(const JobRow& job) {
  std::vector<Stretch> stretches;
  auto own = decode_stored_spec(job.spec_json);
  if (!own) return own.error();
  stretches.push_back({kSeqMax, std::move(*own)});
  const Json origin = job.origin_json.empty() ? Json(nullptr) : Json::parse(job.origin_json);
  for (const Json* at = &origin; at->is_object(); at = &(*at)["origin"]) {
    auto spec = decode_stored_spec(to_text((*at)["spec"]));
    if (!spec) return spec.error();
    stretches.push_back({(*at)["at_seq"].get<std::uint64_t>(), std::move(*spec)});
  }
  std::reverse(stretches.begin(), stretches.end());
  return stretches;
}

Result<VerifyTask> decode_task(const std::string& spec_json) {
  const auto json = parse_json(spec_json);
  if (!json) return json.error();
  return VerifyTask{(*json)["job_id"].get<std::string>(), (*json)["to_seq"].get<std::uint64_t>()};
}

std::string encode_outcome(const VerifyOutcome& outcome) {
  const auto hex = [](const std::optional<Digest>& digest) { return digest ? Json(digest->hex()) : Json(nullptr); };
  return to_text({{"identical", outcome.identical},
                  {"events", outcome.events},
                  {"first_differing_seq", outcome.first_differing_seq ? Json(*outcome.first_differing_seq) : Json(nullptr)},
                  {"expected_digest", hex(outcome.expected_digest)},
                  {"actual_digest", hex(outcome.actual_digest)},
                  {"message", outcome.message.empty() ? Json(nullptr) : Json(outcome.message)}});
}

}  // namespace

Result<ForkSpec> decode_fork(const Json& body, const JobSpec& origin, const SpecLimits& limits) {
  if (!body.is_object()) return Error{ErrorCode::kInvalid, kSummary, {{"", "must be an object"}}};
  ForkSpec fork;
  fork.job.preset = origin.preset;
  fork.job.run.seed = origin.run.seed;
  fork.job.run.params = origin.run.params;
  Errors errors;
  check_spec_names(body, kForkNames, errors);
  decode_at(body, fork, errors);
  const std::size_t before = errors.size();
  decode_spec_members(body, limits, fork.job, errors);
  if (errors.size() == before) check_sizes(origin.run.params, fork.job.run.params, errors);
  check_fixed(origin.run.params, fork.job.run.params, errors);
  if (!errors.empty()) return Error{ErrorCode::kInvalid, kSummary, std::move(errors)};
  return fork;
}

Status check_fork(const ForkSpec& fork, const JobSpec& origin, const JobService::ForkPoint& point) {
  Errors errors;
  const char* const at = fork.at_h ? "/at_h" : "/at_seq";
  const std::uint64_t founders = founder_count(origin.run.params.founders);
  if (point.at_seq < founders) {
    errors.push_back({at, "must lie after the last founder, event " + std::to_string(founders)});
  }
  const Until& until = fork.job.run.until;
  const std::uint64_t cells = point.at.colony->cells().size();
  if (until.cells && *until.cells <= cells) {
    errors.push_back({"/until/cells", "must be more than the " + std::to_string(cells) + " cells that are there"});
  }
  const double time_h = std::max(fork.at_h.value_or(0.0), point.at.colony->time_h());
  const bool is_beyond_end = fork.at_h && point.at.colony->time_h() < *fork.at_h && is_terminal(point.origin.state) &&
                             point.at_seq + 1 == point.origin.last_seq;  // then the last state, at its own time
  if (until.time_h && *until.time_h <= (is_beyond_end ? point.at.colony->time_h() : time_h)) {
    errors.push_back({"/until/time_h", "must lie beyond the fork, " + text_of(time_h) + " h"});
  }
  check_dish(fork, origin, point, errors);
  if (!errors.empty()) return Error{ErrorCode::kInvalid, kSummary, std::move(errors)};
  return Ok{};
}

Result<NewJob> new_fork(const ForkSpec& fork, const JobService::ForkPoint& point) {
  const Json origin = origin_of(point);
  if (depth_of(origin) > kForkDepthMax) {
    return Error{ErrorCode::kLimit, "a fork of forks can be " + std::to_string(kForkDepthMax) + " deep"};
  }
  NewJob job = new_job(fork.job);
  job.origin_json = to_text(origin);
  if (job.origin_json.size() > kOriginBytesMax) {
    return Error{ErrorCode::kLimit, "the specs of all origins together are more than " + std::to_string(kOriginBytesMax) + " bytes"};
  }
  return job;
}

NewJob new_verification(const JobRow& target) {
  NewJob job;
  job.kind = kVerifyKind;
  job.name = target.name;
  job.spec_json = to_text({{"job_id", target.id}, {"to_seq", target.last_seq}});
  return job;
}

VerifyCodec verify_codec() { return {decode_task, stretches_of, encode_outcome}; }

}  // namespace colony::server::api
