// codec_spec: a job spec between JSON and the engine's types.
// Promise: decode gives a complete spec or every error at once, each with its JSON Pointer; encode writes every
// parameter
//          that counts, and decode(encode(spec)) is the same spec. Nothing is clamped or ignored: unknown names are
//          errors.
// Errors:  kInvalid. Whether the founders find their places is check_founders' question: it can take long, and a stored
//          spec has passed it.
// Threads: pure.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/model/params.hpp"
#include "engine/sim/simulator.hpp"
#include "server/api/json.hpp"
#include "server/store/records.hpp"

namespace colony::server::api {

inline constexpr std::size_t kNameCharactersMax = 200;
inline constexpr std::size_t kLabelsMax = 32;
inline constexpr std::size_t kLabelKeyBytesMax = 63;
inline constexpr std::size_t kLabelValueBytesMax = 255;
inline constexpr double kUntilTimeMax_h = 100'000.0;
inline constexpr double kUntilTimeImplied_h = 10'000.0;  // where only until.cells is given
inline constexpr Seed kSeedDefault = 1;                  // fixed, so that a spec without a seed has one history too
inline constexpr std::string_view kPresetDefault = "paper";
inline constexpr std::uint64_t kCellIdMax = 4'294'967'295;

struct SpecLimits {
  std::uint64_t cells_max = kCellIdMax;  // of until.cells and of founders
};

struct JobSpec {
  std::string name;
  std::map<std::string, std::string> labels;
  std::string preset{kPresetDefault};
  RunSpec run;
};

/// A spec as it is submitted, held to the limits of this server.
Result<JobSpec> decode_spec(const Json& body, const SpecLimits& limits);

/// Whether the founders of a decoded spec can be placed; pointers as decode_spec's. Throws Stopped when asked to stop.
Status check_founders(const RunSpec& spec, StopFlag stop);

/// What decides the history, complete: seed, preset, until, model. Name and labels belong to the job, not to its spec.
Json encode_spec(const JobSpec& spec);

/// A stored spec, for the runner (jobs/ has no JSON). It was held to the limits of its day and is not held to today's;
/// its founders are not placed.
Result<RunSpec> decode_stored_spec(const std::string& spec_json);

/// The same with what a fork takes over.
Result<JobSpec> decode_stored_job_spec(const std::string& spec_json);

/// The members that a fork has in common with a spec (name, labels, seed, until, model), over what `spec` holds; `until` is required and
/// taken from the body alone. Founders are not counted. The body is an object.
void decode_spec_members(const Json& body, const SpecLimits& limits, JobSpec& spec, std::vector<FieldError>& errors);
/// An error for each member of the object that is none of `known`.
void check_spec_names(const Json& body, std::span<const std::string_view> known, std::vector<FieldError>& errors);

/// What the store keeps of a spec.
NewJob new_job(const JobSpec& spec);

/// A name of a job, analysis or comparison; as below.
std::string name_error(std::string_view name);
/// One label key or value; an empty string if it is right, else why not.
std::string label_key_error(std::string_view key);
std::string label_value_error(std::string_view value);

}  // namespace colony::server::api
