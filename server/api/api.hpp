// api: the HTTP interface as handlers over JobService; plain Request to Response, no socket.
// Promise: every route is in one table that also makes openapi.json; every error is a problem document; nothing is
// stored
//          unless the answer says so.
// Threads: every handler from any thread, once the routes are added.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/codec_spec.hpp"
#include "server/api/problems.hpp"
#include "server/api/query.hpp"
#include "server/http/router.hpp"
#include "server/jobs/analysis_worker.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

struct ApiConfig {
  std::string version;    // of the program
  std::string base_path;  // what paths in answers begin with; empty or "/colony"
  JobsConfig jobs;
  std::size_t body_bytes_max = 1024 * 1024;
  std::size_t header_bytes_max = 8 * 1024;
  std::size_t connections_max = 2000;
  std::uint64_t disk_free_bytes_min = 100'000'000;  // below: not ready
  std::size_t image_bytes_max = 32 * 1024 * 1024;   // of one picture; the http side holds it
  std::uint64_t stored_image_bytes_max = 4'000'000'000;  // of all pictures
  std::size_t analyses_waiting_max = 100;           // queued or running
};

inline constexpr std::size_t kJobsPerPageMax = 500;
inline constexpr std::size_t kJobsPerPageDefault = 50;
inline constexpr std::size_t kEventsPerPageMax = 100'000;
inline constexpr std::size_t kEventsPerPageDefault = 1000;
inline constexpr std::size_t kSeriesPointsMax = 10'000;
inline constexpr std::size_t kSeriesPointsDefault = 200;
inline constexpr std::size_t kIdempotencyKeyBytesMax = 200;
/// A picture is held in memory as its file: at most some 200 MB.
/// Up to here a picture is analysed before the answer, beyond by the worker.
inline constexpr std::int64_t kAnalysedAtOncePixelsMax = 4'000'000;
inline constexpr std::int64_t kServedPictureSideMax_px = 8192;
/// triangles_max unless it is given: so many a cell, at least as many, at most kServedMeshTrianglesMax.
inline constexpr std::int64_t kMeshTrianglesPerCellDefault = 400;
inline constexpr std::int64_t kMeshTrianglesDefaultMin = 200'000;
inline constexpr std::int64_t kServedMeshTrianglesMax = 4'000'000;  // 50 bytes each, and the file once more
std::int64_t mesh_triangles_default(std::size_t cell_count);
inline constexpr std::uint32_t kPackingPoints = 1024;               // a cell's volume to 1.1 %
/// Placing more founders than this can take long: one submission at a time may.
inline constexpr std::uint64_t kFoundersPlacedFreely = 1000;

/// What handlers work with.
struct Context {
  JobService& jobs;
  const ApiConfig config;
  std::atomic<bool> draining{false};  // asks long computations to give up, too
  std::string schema_text;            // made once
  std::string openapi_text;
  std::atomic<bool> places_many{false};  // a submission of many founders is being checked
  std::unique_ptr<AnalysisWorker> worker = {};  // from start() on
};

/// A request that has passed the table's checks.
struct Call {
  const http::Request& request;
  Query query;
  std::string_view media;  // the media type to answer with
  /// The job id of the path.
  const std::string& id() const { return request.path_params.at(0); }
};

/// One row per operation; handlers, query checks, content negotiation and openapi.json all follow it.
struct Endpoint {
  std::string_view method;
  std::string_view path;  // "/v1/jobs/{job_id}/events"
  std::string_view operation_id;
  std::string_view summary;
  std::vector<std::string_view> media;  // offered, the default first; empty: no body
  std::vector<QueryParam> query;
  std::vector<std::pair<int, std::string_view>> answers;  // status and description, success only
  std::string_view schema;                                // component of the JSON answer; of one line for NDJSON
  std::vector<ProblemKind> problems;                      // beyond those that every operation can answer
  http::Response (*handler)(Context&, const Call&);
  /// Folds a history or draws: seconds for a large colony. Holds at most half of the worker threads.
  bool is_heavy = false;
  /// What a POST takes; empty: application/json. None of them can be sent by a page of another site without asking first: only text/plain and
  /// the two form types can (CORS safelist), so exactly these are demanded.
  std::vector<std::string_view> body_media = {};
};

std::span<const Endpoint> endpoints();

class Api {
 public:
  Api(JobService& jobs, ApiConfig config);
  ~Api();
  /// Takes up analyses that are queued. Before it, and without it, they wait.
  Status start();
  /// The router keeps references to this object.
  void add_routes(http::Router& router);
  /// From now on /readyz answers 503, and what takes long gives up and is answered with 503.
  void drain();

 private:
  std::unique_ptr<Context> context_;
};

/// Runs one endpoint: query, Accept and Content-Type first, then its handler. A handler that the end of the server
/// stopped is answered with 503.
http::Response run_endpoint(const Endpoint& endpoint, Context& context, const http::Request& request);

http::Response json_response(int status, const Json& body);
http::Response failure(const Error& error, const Call& call);

// One function per endpoint.
http::Response post_job(Context& context, const Call& call);
http::Response get_jobs(Context& context, const Call& call);
http::Response get_job_counts(Context& context, const Call& call);
http::Response get_job(Context& context, const Call& call);
http::Response cancel_job(Context& context, const Call& call);
http::Response pause_job(Context& context, const Call& call);
http::Response resume_job(Context& context, const Call& call);
http::Response delete_job(Context& context, const Call& call);
http::Response get_events(Context& context, const Call& call);
http::Response get_cells(Context& context, const Call& call);
http::Response get_series(Context& context, const Call& call);
http::Response get_lineage(Context& context, const Call& call);
http::Response get_mesh(Context& context, const Call& call);
http::Response get_analysis_of_job(Context& context, const Call& call);
http::Response get_image(Context& context, const Call& call);
http::Response get_log(Context& context, const Call& call);
http::Response post_analysis(Context& context, const Call& call);
http::Response get_analyses(Context& context, const Call& call);
http::Response get_analysis(Context& context, const Call& call);
http::Response delete_analysis(Context& context, const Call& call);
http::Response get_analysis_steps(Context& context, const Call& call);
http::Response get_analysis_step(Context& context, const Call& call);
http::Response post_comparison(Context& context, const Call& call);
http::Response get_comparisons(Context& context, const Call& call);
http::Response get_comparison(Context& context, const Call& call);
http::Response delete_comparison(Context& context, const Call& call);
http::Response get_comparison_figure(Context& context, const Call& call);
http::Response get_job_schema(Context& context, const Call& call);
http::Response get_openapi(Context& context, const Call& call);
http::Response get_service_info(Context& context, const Call& call);
http::Response get_healthz(Context& context, const Call& call);
http::Response get_readyz(Context& context, const Call& call);

}  // namespace colony::server::api
