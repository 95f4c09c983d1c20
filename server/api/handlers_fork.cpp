// Handlers of what is made of another job: forks and verifications.
#include "engine/base/version.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/codec_fork.hpp"
#include "server/api/submission.hpp"

namespace colony::server::api {
namespace {

http::Response invalid(const Call& call, std::string message) {
  return failure({ErrorCode::kInvalid, std::move(message), {}}, call);
}

/// A history of another results version can be read, but neither continued nor made again.
std::optional<http::Response> refuse_other_version(const JobRow& job, const Call& call) {
  if (results_version_of(job.engine_version) == kResultsVersion) return std::nullopt;
  return problem_response(ProblemKind::kEngineChanged,
                          {ErrorCode::kConflict, "the job was grown by version " + job.engine_version +
                                                     ", which gives other results than " + engine_version_text()},
                          call.request.request_id);
}

}  // namespace

http::Response fork_job(Context& context, const Call& call) {
  const auto key = idempotency_key(call.request);
  if (!key) return failure(key.error(), call);
  const auto body = parse_json(call.request.body);
  if (!body) return failure(body.error(), call);
  NewJob keyed;
  keyed.submitted_by = call.request.principal.name;
  keyed.idempotency_key = *key;
  keyed.body_hash = hash_of_body("fork " + call.id() + "\n", call.request.body);
  // First: what is asked again must not depend on what became of the origin.
  const auto before = context.jobs.submitted_before(keyed);
  if (!before) return failure(before.error(), call);
  if (*before) return submitted_response(context, **before, false);
  if (auto refused = refused_by_preconditions(context, call)) return std::move(*refused);
  const auto target = context.jobs.show(call.id());
  if (!target) return failure(target.error(), call);
  if (target->job.kind != kColonyKind) return invalid(call, "only a colony can be forked; this job is of kind " + target->job.kind);
  if (auto refused = refuse_other_version(target->job, call)) return std::move(*refused);
  const auto origin = decode_stored_job_spec(target->job.spec_json);
  if (!origin) return failure({ErrorCode::kInternal, "the stored spec of job " + target->job.id + " cannot be used: " + origin.error().message, {}}, call);
  const auto fork = decode_fork(*body, *origin, SpecLimits{context.config.jobs.cells_max});
  if (!fork) return failure(fork.error(), call);
  const auto point = context.jobs.fork_point(call.id(), fork->at_h, fork->at_seq);
  if (!point) return failure(point.error(), call);
  if (const Status fits = check_fork(*fork, *origin, *point); !fits) return failure(fits.error(), call);
  auto job = new_fork(*fork, *point);
  if (!job) return failure(job.error(), call);
  job->submitted_by = keyed.submitted_by;
  job->idempotency_key = keyed.idempotency_key;
  job->body_hash = keyed.body_hash;
  const auto made = context.jobs.fork(*job, *point);
  if (!made) return failure(made.error(), call);
  return submitted_response(context, made->view, made->created);
}

http::Response verify_job(Context& context, const Call& call) {
  const auto key = idempotency_key(call.request);
  if (!key) return failure(key.error(), call);
  if (const Status arguments = check_no_arguments(call.request.body); !arguments) return failure(arguments.error(), call);
  NewJob keyed;
  keyed.submitted_by = call.request.principal.name;
  keyed.idempotency_key = *key;
  keyed.body_hash = hash_of_body("verify " + call.id() + "\n", "");
  const auto before = context.jobs.submitted_before(keyed);
  if (!before) return failure(before.error(), call);
  if (*before) return submitted_response(context, **before, false);
  if (auto refused = refused_by_preconditions(context, call)) return std::move(*refused);
  const auto target = context.jobs.show(call.id());
  if (!target) return failure(target.error(), call);
  if (target->job.kind != kColonyKind) return invalid(call, "only a colony can be verified; this job is of kind " + target->job.kind);
  if (auto refused = refuse_other_version(target->job, call)) return std::move(*refused);
  NewJob job = new_verification(target->job);
  job.submitted_by = keyed.submitted_by;
  job.idempotency_key = keyed.idempotency_key;
  job.body_hash = keyed.body_hash;
  const auto submitted = context.jobs.submit(job);
  if (!submitted) return failure(submitted.error(), call);
  return submitted_response(context, submitted->view, submitted->created);
}

std::vector<Endpoint> fork_endpoints() {
  using enum ProblemKind;
  return {
      {"POST",
       "/v1/jobs/{job_id}/fork",
       "forkJob",
       "A new job that begins with a copy of the history up to a time or an event, and goes on by a spec of its own. Idempotency-Key as for submitJob",
       {"application/json"},
       {},
       {{200, "the same job as before (same key and body)"}, {201, "the new job"}},
       "Job",
       {kMalformed, kNotFound, kTimeNotReached, kEngineChanged, kLimit, kUnsupportedMediaType, kKeyReused, kBusy},
       fork_job,
       true},
      {"POST",
       "/v1/jobs/{job_id}/verify",
       "verifyJob",
       "A job of kind verify: grows what is stored by now again, and compares every event. Idempotency-Key as for submitJob",
       {"application/json"},
       {},
       {{200, "the same job as before (same key)"}, {201, "the new job"}},
       "Job",
       {kMalformed, kNotFound, kEngineChanged, kUnsupportedMediaType, kKeyReused, kBusy},
       verify_job},
  };
}

}  // namespace colony::server::api
