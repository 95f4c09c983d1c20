// analysis_work: what the handlers of analyses and of comparisons share, and what the background worker runs.
// Threads: as handlers.
#pragma once

#include "engine/picture/parallel.hpp"
#include "server/api/api.hpp"
#include "server/jobs/analysis_worker.hpp"

namespace colony::server::api {

/// The result of one queued analysis or comparison, or why there is none.
AnalysisWorker::Outcome work_on(Context& context, const AnalysisRow& row, StopFlag stop);

Effort effort_of(const Context& context, const Call& call);

/// Stores, nudges the worker if there is something left to do, and answers 201 or 202.
http::Response created(Context& context, const Call& call, const NewAnalysis& analysis);
/// The row, whose has_source is false if the job of a comparison is gone too.
AnalysisRow with_job(Context& context, AnalysisRow row);
http::Response listed(Context& context, const Call& call, AnalysisKind kind);
http::Response csv_response(std::string text);
http::Response removed(Context& context, const Call& call, AnalysisKind kind);

}  // namespace colony::server::api
