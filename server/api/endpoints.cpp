// The table of operations, and what is checked before any handler runs.
#include "engine/base/stop.hpp"
#include "engine/picture/mesh.hpp"
#include "server/api/analysis_work.hpp"
#include "server/api/api.hpp"
#include "server/api/measure.hpp"
#include "server/api/openapi.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {
namespace {

constexpr double kSeqMax = 9e15;
constexpr std::string_view kJson = "application/json";
constexpr std::string_view kNdjson = "application/x-ndjson";
constexpr std::string_view kCsv = "text/csv";

const QueryParam kAtH = {
    "at_h", QueryType::kNumber, 0, 1e9, {}, "model time, h: the state after all events up to it; default now"};

const QueryParam kLimitParam = {
    "limit", QueryType::kInteger, 1, kJobsPerPageMax, {}, "items in a page; default 50"};
const QueryParam kCursorParam = {"cursor", QueryType::kText, 0, 0, {}, "`next` of the page before"};

std::vector<std::string_view> stream_kinds() {
  std::vector<std::string_view> names;
  for (int kind = 0; kind < kEventKindCount; ++kind) names.push_back(name_of(static_cast<EventKind>(kind)));
  names.push_back("progress");
  return names;
}

std::vector<std::string_view> state_names() {
  std::vector<std::string_view> names;
  for (int state = 0; state <= static_cast<int>(JobState::kCancelled); ++state) {
    names.push_back(name_of(static_cast<JobState>(state)));
  }
  return names;
}

std::vector<Endpoint> make_endpoints() {
  using enum ProblemKind;
  return {
      {"POST",
       "/v1/jobs",
       "submitJob",
       "Submit a job. The header Idempotency-Key (1 to 200 printable ASCII characters) makes repeating it safe.",
       {kJson},
       {{"dry_run",
         QueryType::kBoolean,
         0,
         0,
         {},
         "only check: answer the complete spec and an estimate; nothing is stored"}},
       {{200, "the same job as before (same key and body), or the answer of a dry run"}, {201, "the new job"}},
       "Submission",
       {kMalformed, kUnsupportedMediaType, kKeyReused, kBusy, kOccupied},
       post_job},
      {"GET",
       "/v1/jobs",
       "listJobs",
       "Jobs, newest first",
       {kJson},
       {{"state", QueryType::kName, 0, 0, state_names(), "only jobs in this state"},
        {"kind", QueryType::kText, 0, 0, {}, "only jobs of this kind"},
        {"name", QueryType::kText, 0, 0, {}, "only jobs of exactly this name"},
        {"label", QueryType::kText, 0, 0, {}, "only jobs with this label, key:value; several must all fit", true},
        {"limit", QueryType::kInteger, 1, kJobsPerPageMax, {}, "jobs in a page; default 50"},
        {"cursor", QueryType::kText, 0, 0, {}, "`next` of the page before"}},
       {{200, "a page"}},
       "JobList",
       {},
       get_jobs},
      {"GET",
       "/v1/jobs/counts",
       "countJobs",
       "Count of jobs by state",
       {kJson},
       {},
       {{200, "the counts"}},
       "JobCounts",
       {},
       get_job_counts},
      {"GET", "/v1/jobs/{job_id}", "showJob", "One job", {kJson}, {}, {{200, "the job"}}, "Job", {kNotFound}, get_job},
      {"POST",
       "/v1/jobs/{job_id}/cancel",
       "cancelJob",
       "End a job that has not ended; durable before the answer",
       {kJson},
       {},
       {{200, "it was cancelled already"}, {202, "it is cancelled, or will be at its next event"}},
       "Job",
       {kMalformed, kNotFound, kJobTerminal, kUnsupportedMediaType},
       cancel_job},
      {"POST",
       "/v1/jobs/{job_id}/pause",
       "pauseJob",
       "Hold a job; durable before the answer",
       {kJson},
       {},
       {{200, "it was paused already"}, {202, "it is paused, or will be at its next event"}},
       "Job",
       {kMalformed, kNotFound, kJobTerminal, kUnsupportedMediaType},
       pause_job},
      {"POST",
       "/v1/jobs/{job_id}/resume",
       "resumeJob",
       "Queue a paused job again; durable before the answer",
       {kJson},
       {},
       {{200, "it was queued or running already"}, {202, "it is queued"}},
       "Job",
       {kMalformed, kNotFound, kJobTerminal, kUnsupportedMediaType},
       resume_job},
      {"DELETE",
       "/v1/jobs/{job_id}",
       "deleteJob",
       "Remove an ended job with its history",
       {},
       {},
       {{204, "it is gone"}},
       "",
       {kNotFound, kJobNotTerminal},
       delete_job},
      {"GET",
       "/v1/jobs/{job_id}/events",
       "listEvents",
       "The history, in pages (JSON), whole (NDJSON, CSV) or live (text/event-stream, with the header Last-Event-ID)",
       {kJson, kNdjson, kCsv, "text/event-stream"},
       {{"after", QueryType::kInteger, 0, kSeqMax, {}, "only events with a greater seq; `next` of the page before"},
        {"kind", QueryType::kNames, 0, 0, stream_kinds(),
         "only these kinds, separated by commas; progress is for streams"},
        {"cell_id", QueryType::kInteger, 1, static_cast<double>(kCellIdMax), {}, "only events of this cell"},
        {"limit",
         QueryType::kInteger,
         1,
         kEventsPerPageMax,
         {},
         "most events; default 1000 for JSON, else all; not for streams"}},
       {{200, "events"}, {204, "a stream taken up again with nothing left"}},
       "Event",
       {kNotFound},
       get_events},
      {"GET",
       "/v1/jobs/{job_id}/cells",
       "listCells",
       "The colony at a time, one row a cell",
       {kJson, kCsv, kNdjson},
       {kAtH},
       {{200, "the cells"}},
       "Cell",
       {kNotFound, kTimeNotReached},
       get_cells,
       true},
      {"GET",
       "/v1/jobs/{job_id}/series",
       "listSeries",
       "The growth curve in equal steps from 0 to the end",
       {kJson, kCsv},
       {{"points", QueryType::kInteger, 1, kSeriesPointsMax, {}, "rows; default 200"}},
       {{200, "the rows"}},
       "Series",
       {kNotFound},
       get_series,
       true},
      {"GET",
       "/v1/jobs/{job_id}/lineage",
       "showLineage",
       "Who came from whom: a table, or Newick trees (one a founder; leaves named by cell id, branch lengths in h)",
       {kJson, "text/x-newick", "text/plain"},
       {kAtH},
       {{200, "the lineage"}},
       "Lineage",
       {kNotFound, kTimeNotReached},
       get_lineage,
       true},
      {"GET",
       "/v1/jobs/{job_id}/image",
       "drawImage",
       "A picture of the colony from above; as image/tiff an OME-TIFF with the channels brightfield, phase, nuclei, labels",
       {"image/png", "image/tiff"},
       {kAtH,
        {"style", QueryType::kName, 0, 0, {"shaded", "contours", "brightfield", "phase", "labels"}, "default shaded"},
        {"um_per_px", QueryType::kNumber, 0.01, 1000, {}, "scale; not together with width_px"},
        {"width_px", QueryType::kInteger, 16, kServedPictureSideMax_px, {}, "width; default 1024"},
        {"colour_by", QueryType::kName, 0, 0, {"activity", "generation", "age", "volume"},
         "of shaded; default activity"},
        {"lines", QueryType::kName, 0, 0, {"both", "colony", "cells"}, "which borders contours draws; default both"},
        {"scale_bar", QueryType::kBoolean, 0, 0, {}, "default true"}},
       {{200, "the picture"}},
       "",
       {kNotFound, kTimeNotReached, kLimit},
       get_image,
       true},
      {"GET",
       "/v1/jobs/{job_id}/mesh",
       "getMesh",
       "The surfaces of all cells and nuclei as binary glTF; neighbours share their contact faces exactly; 1 unit = 1 um",
       {"model/gltf-binary"},
       {kAtH,
        {"triangles_max", QueryType::kInteger, kTrianglesMin, kServedMeshTrianglesMax, {}, "most triangles; default 200000"},
        {"nuclei", QueryType::kBoolean, 0, 0, {}, "default true"}},
       {{200, "the mesh"}},
       "",
       {kNotFound, kTimeNotReached, kLimit},
       get_mesh,
       true},
      {"GET",
       "/v1/jobs/{job_id}/analysis",
       "measureJob",
       "Measurements of the colony at a time, with controls beside each answer and words that say what follows",
       {kJson},
       {kAtH,
        {"um_per_px", QueryType::kNumber, 0.01, 1000, {}, "scale of the measured picture; not together with width_px"},
        {"width_px", QueryType::kInteger, 64, kMeasuredSideMax_px, {}, "its width; default 2048"}},
       {{200, "the measurements"}},
       "JobAnalysis",
       {kNotFound, kTimeNotReached, kLimit},
       get_analysis_of_job,
       true},
      {"GET",
       "/v1/jobs/{job_id}/log",
       "readLog",
       "The log of the job, a line each",
       {kNdjson},
       {},
       {{200, "the log"}},
       "LogLine",
       {kNotFound},
       get_log},
      {"POST",
       "/v1/analyses",
       "analyseImage",
       "Analyse a picture: the body is a PNG, TIFF or JPEG. Up to 4,000,000 pixels the answer has the result, beyond it is made later",
       {kJson},
       {{"name", QueryType::kText, 0, 0, {}, "a name for people"},
        {"um_per_px", QueryType::kNumber, kImageScaleMin_um_per_px, kImageScaleMax_um_per_px, {},
         "size of a pixel; without it lengths are in pixels"},
        {"foreground", QueryType::kName, 0, 0, {"auto", "light", "dark"}, "what the objects are; default auto"},
        {"channel", QueryType::kInteger, 0, 15, {}, "from 0; an image of several channels needs one"},
        {"threshold", QueryType::kInteger, 0, 254, {}, "of the step `signal`; default by Otsu"},
        {"pipeline", QueryType::kName, 0, 0, {"auto", "nuclei", "phase", "contours"}, "default auto"},
        {"clahe", QueryType::kBoolean, 0, 0, {}, "even the local contrast first; default false"}},
       {{201, "the analysis with its result"}, {202, "the analysis, to be worked on"}},
       "Analysis",
       {kMalformed, kUnsupportedMediaType, kLimit, kBusy},
       post_analysis,
       true,
       {"image/png", "image/tiff", "image/jpeg"}},
      {"GET",
       "/v1/analyses",
       "listAnalyses",
       "Analyses, newest first, without their results",
       {kJson},
       {kLimitParam, kCursorParam},
       {{200, "a page"}},
       "AnalysisList",
       {},
       get_analyses},
      {"GET",
       "/v1/analyses/{analysis_id}",
       "showAnalysis",
       "One analysis with its result",
       {kJson},
       {},
       {{200, "the analysis"}},
       "Analysis",
       {kNotFound},
       get_analysis},
      {"DELETE",
       "/v1/analyses/{analysis_id}",
       "deleteAnalysis",
       "Remove an analysis with its picture",
       {},
       {},
       {{204, "it is gone"}},
       "",
       {kNotFound},
       delete_analysis},
      {"GET",
       "/v1/analyses/{analysis_id}/steps/{step}",
       "drawStep",
       "One step of the analysis as a picture, made again",
       {"image/png"},
       {},
       {{200, "the picture"}},
       "",
       {kMalformed, kNotFound, kLimit},
       get_analysis_step,
       true},
      {"POST",
       "/v1/comparisons",
       "compare",
       "Compare a job at a time with an analysed picture, pixels per cell matched",
       {kJson},
       {},
       {{201, "the comparison with its result"}, {202, "the comparison, to be worked on"}},
       "Comparison",
       {kMalformed, kUnsupportedMediaType, kTimeNotReached, kLimit, kBusy},
       post_comparison,
       true},
      {"GET",
       "/v1/comparisons",
       "listComparisons",
       "Comparisons, newest first, without their results",
       {kJson},
       {kLimitParam, kCursorParam},
       {{200, "a page"}},
       "ComparisonList",
       {},
       get_comparisons},
      {"GET",
       "/v1/comparisons/{comparison_id}",
       "showComparison",
       "One comparison with its result",
       {kJson},
       {},
       {{200, "the comparison"}},
       "Comparison",
       {kNotFound},
       get_comparison},
      {"DELETE",
       "/v1/comparisons/{comparison_id}",
       "deleteComparison",
       "Remove a comparison",
       {},
       {},
       {{204, "it is gone"}},
       "",
       {kNotFound},
       delete_comparison},
      {"GET",
       "/v1/comparisons/{comparison_id}/figure",
       "drawComparison",
       "Contours and log-log plots of both, side by side, made again",
       {"image/png"},
       {},
       {{200, "the figure"}},
       "",
       {kMalformed, kNotFound, kTimeNotReached, kLimit},
       get_comparison_figure,
       true},
      {"GET",
       "/v1/schema/job",
       "getJobSchema",
       "JSON Schema (2020-12) of a job spec",
       {kJson, "application/schema+json"},
       {},
       {{200, "the schema"}},
       "",
       {},
       get_job_schema},
      {"GET",
       "/openapi.json",
       "getOpenapi",
       "This description",
       {kJson},
       {},
       {{200, "the description"}},
       "",
       {},
       get_openapi},
      {"GET",
       "/v1/service-info",
       "getServiceInfo",
       "Version, limits, presets and parameters",
       {kJson},
       {},
       {{200, "facts"}},
       "ServiceInfo",
       {},
       get_service_info},
      {"GET", "/healthz", "getHealth", "Alive", {kJson}, {}, {{200, "alive"}}, "Health", {}, get_healthz},
      {"GET",
       "/readyz",
       "getReadiness",
       "Ready: database writable, disk free, not draining",
       {kJson},
       {},
       {{200, "ready"}},
       "Health",
       {},
       get_readyz},
  };
}

}  // namespace

std::span<const Endpoint> endpoints() {
  static const std::vector<Endpoint> table = make_endpoints();
  return table;
}

http::Response run_endpoint(const Endpoint& endpoint, Context& context, const http::Request& request) {
  auto query = Query::parse(request, endpoint.query);
  if (!query) return problem_response(query.error(), request.request_id);
  std::string_view media;
  if (!endpoint.media.empty()) {
    const auto chosen = choose_media(request.headers, endpoint.media);
    if (!chosen) {
      return problem_response(
          ProblemKind::kNotAcceptable,
          {ErrorCode::kInvalid, "offered are " + joined(endpoint.media), {{"Accept", "fits nothing offered"}}},
          request.request_id);
    }
    media = endpoint.media[*chosen];
  }
  // Asked of every POST, with a body or without: a page of another site cannot send this type unasked (CORS).
  const bool takes_json = endpoint.body_media.empty();
  if (endpoint.method == "POST" &&
      !(takes_json ? has_json_body(request.headers) : has_body_of(request.headers, endpoint.body_media))) {
    const std::string wanted = takes_json ? "application/json" : "one of " + joined(endpoint.body_media);
    return problem_response(ProblemKind::kUnsupportedMediaType,
                            {ErrorCode::kInvalid,
                             "this POST must have the Content-Type " + wanted,
                             {{"Content-Type", "must be " + wanted}}},
                            request.request_id);
  }
  try {
    return endpoint.handler(context, Call{request, std::move(*query), media});
  } catch (const Stopped&) {
    return problem_response(
        {ErrorCode::kUnavailable, "the server is ending; the work was given up, nothing was stored"},
        request.request_id);
  }
}

Api::Api(JobService& jobs, ApiConfig config) {
  const SpecLimits limits{config.jobs.cells_max};
  context_ = std::unique_ptr<Context>(new Context{jobs, std::move(config), false, {}, {}});
  context_->schema_text = to_text(job_spec_schema(limits));
  context_->openapi_text =
      to_text(openapi_document(endpoints(), limits, context_->config.version, context_->config.base_path));
}

Api::~Api() { drain(); }

Status Api::start() {
  context_->worker = std::make_unique<AnalysisWorker>(
      context_->jobs.store().analyses(),
      [context = context_.get()](const AnalysisRow& row, StopFlag stop) { return work_on(*context, row, stop); });
  return context_->worker->start();
}

void Api::drain() {
  context_->draining = true;
  if (context_->worker) context_->worker->stop();
}

void Api::add_routes(http::Router& router) {
  for (const Endpoint& endpoint : endpoints()) {
    std::string pattern(endpoint.path);
    for (std::size_t open = pattern.find('{'); open != std::string::npos; open = pattern.find('{', open + 1)) {
      pattern.replace(open, pattern.find('}', open) - open + 1, "{}");
    }
    router.add(std::string(endpoint.method), pattern,
               [&endpoint, context = context_.get()](const http::Request& request) {
                 return run_endpoint(endpoint, *context, request);
               },
               endpoint.is_heavy ? http::Router::Weight::kHeavy : http::Router::Weight::kLight);
  }
}

http::Response failure(const Error& error, const Call& call) {
  return problem_response(error, call.request.request_id);
}

http::Response json_response(int status, const Json& body) {
  http::Response response;
  response.status = status;
  response.headers.set("Content-Type", "application/json");
  response.body = to_text(body);
  return response;
}

}  // namespace colony::server::api
