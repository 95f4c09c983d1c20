// Further rows of the table: edit a job, the stream of a page.
#include "server/api/api.hpp"

namespace colony::server::api {

std::vector<Endpoint> further_endpoints() {
  using enum ProblemKind;
  return {
      {"PATCH",
       "/v1/jobs/{job_id}",
       "editJob",
       "Change name and labels of a job, in any state. With If-Match only if it still has one of these revisions",
       {"application/json"},
       {},
       {{200, "the job as it is now; its revision has grown if anything changed"}},
       "Job",
       {kMalformed, kNotFound, kUnsupportedMediaType, kPreconditionFailed},
       patch_job,
       false,
       {"application/merge-patch+json"}},
      {"GET",
       "/v1/stream",
       "streamJobs",
       "One event stream for a page: the state (`all`: every job that has not ended; ids: each one), `event: ready`, then every change as "
       "`event: job` (a Job), `event: deleted` {id} and `event: progress`, of a job at most 5 times a second, of all together 50 times. "
       "After a reconnect the whole state comes again; what was held as not ended and is not in it is over",
       {"text/event-stream"},
       {{"jobs", QueryType::kText, 0, 0, {}, "all, or at most 100 ids separated by commas; default all"}},
       {{200, "the stream"}},
       "",
       {},
       get_stream},
  };
}

}  // namespace colony::server::api
