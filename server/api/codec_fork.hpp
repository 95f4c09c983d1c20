// codec_fork: forks and verifications between JSON and the engine's types.
// Promise: all wrong fields at once, each with its JSON Pointer. What may change is what the copied cells allow: nothing that decided
//          their bodies or that a number stored with them was measured by.
// Errors:  kInvalid; kLimit for a fork of forks beyond kForkDepthMax.
// Threads: pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/api/codec_spec.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

inline constexpr int kForkDepthMax = 32;                            // origins of origins
inline constexpr std::size_t kOriginBytesMax = 8 * 1024 * 1024;     // of them all, as JSON

struct ForkSpec {
  std::optional<double> at_h;  // exactly one
  std::optional<std::uint64_t> at_seq;
  JobSpec job;                 // complete; name and labels are the fork's own
};

/// The body of a fork of a job with this spec.
Result<ForkSpec> decode_fork(const Json& body, const JobSpec& origin, const SpecLimits& limits);
/// Whether a colony that stands at `point` can go on by the fork's spec.
Status check_fork(const ForkSpec& fork, const JobSpec& origin, const JobService::ForkPoint& point);
/// What the store keeps of it, origin included.
Result<NewJob> new_fork(const ForkSpec& fork, const JobService::ForkPoint& point);

/// A verification of what `target` has stored by now.
NewJob new_verification(const JobRow& target);
/// How jobs/ reads and writes all this.
VerifyCodec verify_codec();

}  // namespace colony::server::api
