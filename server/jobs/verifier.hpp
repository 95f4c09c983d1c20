// verifier: runs a job of kind "verify": the target's specs on their stretches again, every event held against the stored one.
// Promise: what is compared is the whole event (its content, its digest and that its digest follows from its content), seq by seq up to
//          to_seq; the first difference ends it. Nothing of the target changes. The job's one event is `finished`.
// Method:  a simulator for each stretch of a fork's past, started from the stored events that were just found right.
// Stops:   as a growing job (pause, cancel, drain, storage); it then begins again, since no part of its work is stored.
// Errors:  a target that goes meanwhile: failed, "target_deleted". Another results version, of this job or the target: "engine_changed".
// Threads: one job, one thread.
#pragma once

#include <memory>

#include "server/jobs/live.hpp"
#include "server/jobs/runner.hpp"

namespace colony::server {

/// `job` is in state running.
RunEnd verify_job(const RunnerEnvironment& environment, const JobRow& job, const std::shared_ptr<LiveJob>& live);

}  // namespace colony::server
