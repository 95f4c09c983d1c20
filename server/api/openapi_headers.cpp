#include "server/api/openapi_headers.hpp"

#include <array>

namespace colony::server::api {
namespace {

constexpr std::string_view kTagPattern = "^\"[!#-~]*\"$";
constexpr std::string_view kTagListPattern = "^(\\*|(W/)?\"[!#-~]*\"([ \\t]*,[ \\t]*(W/)?\"[!#-~]*\")*)$";

Json header(std::string_view text, Json schema = {{"type", "string"}}, bool is_required = false) {
  Json out = {{"description", text}, {"schema", std::move(schema)}};
  if (is_required) out["required"] = true;
  return out;
}

Json pattern(std::string_view text) { return {{"type", "string"}, {"pattern", text}}; }

Json path_schema() { return {{"type", "string"}, {"format", "uri-reference"}}; }

Json common_headers() {
  return {{"X-Request-Id", header("of this request, the client's own if it sent a fine one (1 to 64 of A-Z a-z 0-9 . _ -)",
                                  pattern("^[A-Za-z0-9._-]{1,64}$"), true)}};
}

bool is_paged(const Endpoint& endpoint) {
  for (const std::string_view id : {"listJobs", "listEvents", "listAnalyses", "listComparisons"}) {
    if (endpoint.operation_id == id) return true;
  }
  return false;
}

bool makes_something(const Endpoint& endpoint) {
  for (const std::string_view id : {"submitJob", "forkJob", "verifyJob", "analyseImage", "compare", "createToken"}) {
    if (endpoint.operation_id == id) return true;
  }
  return false;
}

bool answers_a_job(const Endpoint& endpoint) {
  return endpoint.schema == "Job" || endpoint.operation_id == "submitJob";
}

struct Group {
  std::string_view name, text;
};
constexpr std::array<Group, 6> kGroups = {{
    {"Jobs", "Submit, look, wait, command, edit, remove."},
    {"Results", "What a job has produced, at any time of its history."},
    {"Streams", "Server-sent events."},
    {"Analyses", "Pictures that are sent, what is measured on them, and how a job compares."},
    {"Server", "What the server says about itself."},
    {"Administration", "For admins."},
}};

}  // namespace

void add_header_parameters(const Endpoint& endpoint, Json& parameters) {
  const auto add = [&](const char* name, std::string_view text, Json schema) {
    parameters.push_back({{"name", name}, {"in", "header"}, {"description", text}, {"schema", std::move(schema)}});
  };
  const bool makes_job =
      endpoint.operation_id == "submitJob" || endpoint.operation_id == "forkJob" || endpoint.operation_id == "verifyJob";
  if (makes_job) {
    add("Idempotency-Key", "the same key and body give the same job",
        {{"type", "string"}, {"minLength", 1}, {"maxLength", kIdempotencyKeyBytesMax}, {"pattern", "^[ -~]+$"}});
  }
  if (endpoint.operation_id == "listEvents") {
    add("Last-Event-ID", "text/event-stream: the last seq seen; of this and `after` the greater wins", pattern("^[0-9]+$"));
  }
  if (endpoint.validator != Validator::kNone) {
    add("If-None-Match", "tags of answers that the client has: 304 if one of them is still the answer", pattern(kTagListPattern));
  }
  if (endpoint.operation_id == "showJob") {
    add("Prefer",
        "wait=N, with If-None-Match: answer when the revision differs from those of the tags, or after N s (at most 60). An answer without "
        "Preference-Applied did not wait",
        {{"type", "string"}});
  }
  if (endpoint.method == "GET") return;
  if (compared_by(endpoint) == Compared::kJob) {
    add("If-Match", "only if the job has one of these revisions; of a tag only the part before the dot counts", pattern(kTagListPattern));
    add("If-None-Match", "only if the job has none of these revisions, compared likewise", pattern(kTagListPattern));
  } else if (compared_by(endpoint) == Compared::kGet) {
    add("If-Match", "only if GET of this path has one of these tags now", pattern(kTagListPattern));
    add("If-None-Match", "only if GET of this path has none of these tags now", pattern(kTagListPattern));
  }
}

Json answer_headers(const Endpoint& endpoint, int status) {
  Json out = common_headers();
  const bool is_get = endpoint.method == "GET";
  if ((is_get && endpoint.validator != Validator::kNone && status != 204) || (!is_get && answers_a_job(endpoint))) {
    std::string_view text = "`\"<revision>.<last_seq>\"` of the job";
    if (endpoint.validator == Validator::kBody) text = "of the bytes of the answer";
    if (endpoint.validator == Validator::kHistory)
      text = "of the history, the query, the form and the program; missing where the job went on while the answer was made";
    out["ETag"] = header(text, pattern(kTagPattern), endpoint.validator == Validator::kJob);
  }
  if (endpoint.media.size() > 1) out["Vary"] = header("Accept: the answer depends on it", pattern("\\bAccept\\b"), true);
  if (endpoint.operation_id == "showJob") {
    out["Preference-Applied"] = header("wait=N as it was applied", pattern("^wait=[0-9]+$"));
  }
  if (is_paged(endpoint) && status != 204) {
    out["Link"] = header("rel=next, if there is a next page", pattern("^<[^<>]+>; rel=\"next\"$"));
  }
  if (makes_something(endpoint)) {
    out["Location"] = header("path of what was made", path_schema(), status == 201 || status == 202);
  }
  return out;
}

Json problem_headers(const Endpoint& endpoint, int status) {
  Json out = common_headers();
  if (status == 429 || status == 503) out["Retry-After"] = header("seconds", pattern("^[0-9]+$"), true);
  if (status == 405) out["Allow"] = header("the methods that the path has", {{"type", "string"}}, true);
  if (status == 415) {
    out[endpoint.method == "PATCH" ? "Accept-Patch" : "Accept-Post"] = header("what a body may be");
  }
  if (endpoint.media.size() > 1) out["Vary"] = header("Accept", pattern("\\bAccept\\b"));
  return out;
}

std::string_view tag_of(const Endpoint& endpoint) {
  const std::string_view path = endpoint.path;
  if (path == "/v1/stream") return "Streams";
  if (path.starts_with("/v1/analyses") || path.starts_with("/v1/comparisons")) return "Analyses";
  if (path.starts_with("/v1/tokens") || path.starts_with("/v1/backup")) return "Administration";
  if (path.starts_with("/v1/jobs/{job_id}/") && endpoint.method == "GET") return "Results";
  return path.starts_with("/v1/jobs") ? "Jobs" : "Server";
}

Json tag_list() {
  Json out = Json::array();
  for (const Group& group : kGroups) {
    bool is_used = false;
    for (const Endpoint& endpoint : endpoints()) is_used = is_used || tag_of(endpoint) == group.name;
    if (is_used) out.push_back({{"name", group.name}, {"description", group.text}});
  }
  return out;
}

}  // namespace colony::server::api
