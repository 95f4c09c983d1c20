// The table of operations.
#include <utility>

#include "engine/picture/mesh.hpp"
#include "server/api/api.hpp"
#include "server/api/endpoints_service.hpp"
#include "server/api/measure.hpp"

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
       get_jobs, false, {}, Validator::kBody},
      {"GET",
       "/v1/jobs/counts",
       "countJobs",
       "Count of jobs by state",
       {kJson},
       {},
       {{200, "the counts"}},
       "JobCounts",
       {},
       get_job_counts, false, {}, Validator::kBody},
      {"GET", "/v1/jobs/{job_id}", "showJob",
       "One job. With If-None-Match and `Prefer: wait=N` it is answered when its revision differs from those, at the latest after N s",
       {kJson}, {}, {{200, "the job"}}, "Job", {kNotFound}, get_job, false, {}, Validator::kJob},
      {"POST",
       "/v1/jobs/{job_id}/cancel",
       "cancelJob",
       "End a job that has not ended; durable before the answer",
       {kJson},
       {},
       {{200, "it was cancelled already"}, {202, "it is cancelled, or will be at its next event"}},
       "Job",
       {kMalformed, kNotFound, kJobTerminal, kUnsupportedMediaType, kPreconditionFailed},
       cancel_job},
      {"POST",
       "/v1/jobs/{job_id}/pause",
       "pauseJob",
       "Hold a job; durable before the answer",
       {kJson},
       {},
       {{200, "it was paused already"}, {202, "it is paused, or will be at its next event"}},
       "Job",
       {kMalformed, kNotFound, kJobTerminal, kUnsupportedMediaType, kPreconditionFailed},
       pause_job},
      {"POST",
       "/v1/jobs/{job_id}/resume",
       "resumeJob",
       "Queue a paused job again; durable before the answer",
       {kJson},
       {},
       {{200, "it was queued or running already"}, {202, "it is queued"}},
       "Job",
       {kMalformed, kNotFound, kJobTerminal, kUnsupportedMediaType, kPreconditionFailed},
       resume_job},
      {"DELETE",
       "/v1/jobs/{job_id}",
       "deleteJob",
       "Remove an ended job with its history",
       {},
       {},
       {{204, "it is gone"}},
       "",
       {kNotFound, kJobNotTerminal, kPreconditionFailed},
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
       get_events, false, {}, Validator::kHistory},
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
       true, {}, Validator::kHistory},
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
       true, {}, Validator::kHistory},
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
       true, {}, Validator::kHistory},
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
         "of shaded, refused for others; default activity"},
        {"lines", QueryType::kName, 0, 0, {"both", "colony", "cells"}, "which borders contours draws, refused for other styles; default both"},
        {"scale_bar", QueryType::kBoolean, 0, 0, {}, "default true; refused for labels, whose every pixel is an id"}},
       {{200, "the picture"}},
       "",
       {kNotFound, kTimeNotReached, kLimit},
       get_image,
       true, {}, Validator::kHistory},
      {"GET",
       "/v1/jobs/{job_id}/mesh",
       "getMesh",
       "The surfaces of all cells and nuclei as binary glTF; neighbours share their contact faces exactly; 1 unit = 1 um",
       {"model/gltf-binary"},
       {kAtH,
        {"triangles_max", QueryType::kInteger, kTrianglesMin, kServedMeshTrianglesMax, {}, "most triangles; default 400 for each cell, within 200000 to 4000000"},
        {"nuclei", QueryType::kBoolean, 0, 0, {}, "default true"}},
       {{200, "the mesh"}},
       "",
       {kNotFound, kTimeNotReached, kLimit},
       get_mesh,
       true, {}, Validator::kHistory},
      {"GET",
       "/v1/jobs/{job_id}/analysis",
       "measureJob",
       "Measurements of the colony at a time, with controls beside each answer and words that say what follows; CSV: the shape of each cell",
       {kJson, kCsv},
       {kAtH,
        {"um_per_px", QueryType::kNumber, 0.01, 1000, {}, "scale of the measured picture; not together with width_px"},
        {"width_px", QueryType::kInteger, 64, kMeasuredSideMax_px, {}, "its width; default 2048"}},
       {{200, "the measurements"}},
       "JobAnalysis",
       {kNotFound, kTimeNotReached, kLimit},
       get_analysis_of_job,
       true, {}, Validator::kHistory},
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
  };
}

}  // namespace

std::span<const Endpoint> endpoints() {
  static const std::vector<Endpoint> table = [] {
    std::vector<Endpoint> all = make_endpoints();
    for (Endpoint& row : analysis_endpoints()) all.push_back(std::move(row));
    for (Endpoint& row : fork_endpoints()) all.push_back(std::move(row));
    for (Endpoint& further : further_endpoints()) all.push_back(std::move(further));
    for (Endpoint& endpoint : service_endpoints()) all.push_back(std::move(endpoint));
    return all;
  }();
  return table;
}

}  // namespace colony::server::api
