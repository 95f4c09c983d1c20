// codec_patch: a merge patch of a job (RFC 7386) as a change of its name and labels.
// Meaning: `name: null` takes the name away, `labels: null` all labels, `labels: {key: null}` this label; what is not named stays.
// Errors:  kInvalid with every wrong member at once; nothing but name and labels can be changed.
// Threads: pure.
#pragma once

#include "engine/base/result.hpp"
#include "server/api/json.hpp"
#include "server/store/records.hpp"

namespace colony::server::api {

Result<JobTextChange> decode_job_patch(const Json& patch);

/// JSON Schema of it.
Json job_patch_schema();

}  // namespace colony::server::api
