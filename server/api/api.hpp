// api: the HTTP interface as handlers over JobService; plain Request to Response, no socket.
// Promise: every route is in one table that also makes openapi.json; every error is a problem document; nothing is
// stored
//          unless the answer says so.
// Threads: every handler from any thread, once the routes are added.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/stop.hpp"
#include "server/api/codec_spec.hpp"
#include "server/api/conditional.hpp"
#include "server/api/problems.hpp"
#include "server/api/query.hpp"
#include "server/http/router.hpp"
#include "server/http/tokens.hpp"
#include "server/jobs/analysis_worker.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

struct ApiConfig {
  std::string version;    // of the program
  std::string base_path;  // what paths in answers begin with; empty or "/colony"
  bool tokens_required = false;  // what /docs tells its readers to send,
  bool is_encrypted = false;     // and the address that it shows
  bool is_behind_proxy = false;
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
/// Up to here a picture is analysed before the answer, beyond by the worker.
inline constexpr std::int64_t kAnalysedAtOncePixelsMax = 4'000'000;
/// The same of a colony in a comparison, by an estimate that may be half as much again too low; and cells.
inline constexpr std::int64_t kComparedAtOncePixelsMax = 2'500'000;
inline constexpr std::size_t kComparedAtOnceCellsMax = 20'000;
/// A picture is held in memory as its file: at most some 200 MB.
inline constexpr std::int64_t kServedPictureSideMax_px = 8192;
/// triangles_max unless it is given: so many a cell, at least as many, at most kServedMeshTrianglesMax.
inline constexpr std::int64_t kMeshTrianglesPerCellDefault = 400;
inline constexpr std::int64_t kMeshTrianglesDefaultMin = 200'000;
inline constexpr std::int64_t kServedMeshTrianglesMax = 4'000'000;  // 50 bytes each, and the file once more
std::int64_t mesh_triangles_default(std::size_t cell_count);
inline constexpr std::uint32_t kPackingPoints = 1024;               // a cell's volume to 1.1 %
/// Placing more founders than this can take long: one submission at a time may.
inline constexpr std::uint64_t kFoundersPlacedFreely = 1000;

class Pages;
class Feeds;
class JobTexts;
class KeptAnswers;

/// What handlers work with.
struct Context {
  JobService& jobs;
  http::TokenTable& tokens;
  const ApiConfig config;
  std::atomic<bool> draining{false};  // long computations that nobody else would stop give up, too
  std::string schema_text;            // made once
  std::string openapi_text;
  std::atomic<bool> places_many{false};  // a submission of many founders is being checked
  std::unique_ptr<AnalysisWorker> worker = {};  // from start() on
  // Not shared: a unique_ptr would have to know the class here.
  std::shared_ptr<JobTexts> job_texts = {};  // answers of GET, kept
  std::shared_ptr<Feeds> feeds = {};         // of the streams, which all end before it
  std::shared_ptr<Pages> pages = {};         // of the streams of pages, likewise
  std::atomic<std::size_t> waiting{0};  // requests that wait for a job to change
  std::string docs_text = {};           // the page of /docs, made once
  std::mutex tokens_mutex = {};  // a change of the stored tokens and of `tokens` is one
  std::shared_ptr<KeptAnswers> kept = {};  // steps and figures made last
};

/// A request that has passed the table's checks.
struct Call {
  const http::Request& request;
  Query query;
  std::string_view media;  // the media type to answer with
  std::optional<TagList> if_match = {}, if_none_match = {};
  /// Set when nobody will take the answer; every long computation polls it. `context`: of the call.
  StopFlag stop(const Context& context) const { return request.gives_up ? request.gives_up.get() : &context.draining; }
  /// The job id of the path.
  const std::string& id() const { return request.path_params.at(0); }
};

/// What the ETag of an answer is made of. Only answers with one can be 304.
enum class Validator {
  kNone,
  kJob,      // revision and last_seq
  kHistory,  // the history asked for, the query, the media type and the program: known before the work
  kBody      // the bytes of the answer: saves sending it, not making it
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
  Validator validator = Validator::kNone;
  /// What it needs where tokens are required; nullopt: read for GET, submit for all else. So only the exceptions are written down.
  std::optional<http::Access> access = std::nullopt;
};

http::Access access_of(const Endpoint& endpoint);

std::span<const Endpoint> endpoints();
/// Rows of the table that stand beside their handlers (handlers_fork.cpp).
std::vector<Endpoint> fork_endpoints();
/// The part of it in endpoints_analyses.cpp.
std::vector<Endpoint> analysis_endpoints();
/// The part of it in endpoints_pages.cpp.
std::vector<Endpoint> further_endpoints();

class Api {
 public:
  /// `tokens`: the table that admission asks; kept the same as the stored ones. Both outlive it.
  Api(JobService& jobs, http::TokenTable& tokens, ApiConfig config);
  ~Api();
  /// Takes up analyses that are queued. Before it, and without it, they wait.
  Status start();
  /// The router keeps references to this object.
  void add_routes(http::Router& router);
  /// From now on /readyz answers 503. What takes long gives up as the http server stops (Request::gives_up), and is answered with 503.
  void drain();

 private:
  std::unique_ptr<Context> context_;
};

/// Runs one endpoint: query, Accept and Content-Type first, then its handler. A handler that the end of the server
/// stopped is answered with 503.
http::Response run_endpoint(const Endpoint& endpoint, Context& context, const http::Request& request);

/// The answer of an endpoint that is known without asking a store; nullopt: run it. For an I/O thread.
std::optional<http::Response> answer_now(const Endpoint& endpoint, Context& context, const http::Request& request);

http::Response json_response(int status, const Json& body);
/// Of what is made of the colony at `at_h` of the query: the answer that needs no work (304, HEAD, or why there is none).
std::optional<http::Response> settled_by_history(Context& context, const Call& call, std::string_view more = {});
/// The tag of what was made of this colony; that of settled_by_history, unless the job went on between the two.
std::string history_tag(const Context& context, const Call& call, const ColonyAt& at, std::string_view more = {});
/// A job as the answer, with its tag.
http::Response job_response(const Context& context, int status, const JobView& view);
http::Response failure(const Error& error, const Call& call);
/// If-Match and If-None-Match of a request that changes a job, for the store to hold against its revision.
RevisionCondition revision_condition(const Call& call);
/// 412, where that did not hold for `job`: which of the two, and what the revision is.
http::Response not_as_supposed(const Call& call, const JobRow& job);
/// The same, compared now: for what makes another job and leaves this one as it is. Also the job's own failure.
std::optional<http::Response> refused_by_preconditions(Context& context, const Call& call);

// One function per endpoint.
http::Response post_job(Context& context, const Call& call);
http::Response get_jobs(Context& context, const Call& call);
http::Response get_job_counts(Context& context, const Call& call);
http::Response get_job(Context& context, const Call& call);
http::Response patch_job(Context& context, const Call& call);
http::Response get_stream(Context& context, const Call& call);
http::Response get_docs(Context& context, const Call& call);
http::Response get_docs_style(Context& context, const Call& call);
http::Response cancel_job(Context& context, const Call& call);
http::Response pause_job(Context& context, const Call& call);
http::Response resume_job(Context& context, const Call& call);
http::Response fork_job(Context& context, const Call& call);
http::Response verify_job(Context& context, const Call& call);
http::Response delete_job(Context& context, const Call& call);
http::Response get_events(Context& context, const Call& call);
http::Response get_cells(Context& context, const Call& call);
http::Response get_series(Context& context, const Call& call);
http::Response get_lineage(Context& context, const Call& call);
http::Response get_mesh(Context& context, const Call& call);
http::Response get_analysis_of_job(Context& context, const Call& call);
http::Response get_image(Context& context, const Call& call);
http::Response get_log(Context& context, const Call& call);
/// What POST /v1/analyses takes in its query; they stand where they are read.
std::vector<QueryParam> analysis_params();
http::Response post_analysis(Context& context, const Call& call);
http::Response get_analyses(Context& context, const Call& call);
http::Response get_analysis(Context& context, const Call& call);
http::Response delete_analysis(Context& context, const Call& call);
http::Response get_analysis_objects(Context& context, const Call& call);
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
http::Response post_token(Context& context, const Call& call);
http::Response get_tokens(Context& context, const Call& call);
http::Response delete_token(Context& context, const Call& call);
http::Response get_healthz(Context& context, const Call& call);
http::Response get_readyz(Context& context, const Call& call);

}  // namespace colony::server::api
