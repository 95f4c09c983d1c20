// Handlers of jobs themselves: submit, list, show, command, delete.
#include <algorithm>
#include <atomic>

#include "engine/base/digest.hpp"
#include "server/api/api.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/estimate.hpp"

namespace colony::server::api {
namespace {

// The key of the request; empty: none.
Result<std::string> idempotency_key(const http::Request& request) {
  constexpr std::string_view kName = "Idempotency-Key";
  if (request.headers.count(kName) == 0) return std::string();
  const std::string key(*request.headers.get(kName));
  const bool right = request.headers.count(kName) == 1 && !key.empty() && key.size() <= kIdempotencyKeyBytesMax &&
                     std::all_of(key.begin(), key.end(), [](char c) { return c >= ' ' && c <= '~'; });
  if (right) return key;
  return Error{ErrorCode::kInvalid,
               "a header is wrong",
               {{std::string(kName), "must be given once, 1 to 200 printable ASCII characters"}}};
}

// A name for the body as received: the same bytes, the same submission.
std::string hash_of(const std::string& body) {
  CanonicalBytes bytes;
  for (const char c : body) bytes.add_u8(static_cast<std::uint8_t>(c));
  return chain(Digest{}, std::move(bytes)).hex();
}

std::string percent_encoded(std::string_view text) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                       c == '_' || c == '.' || c == '~';
    if (plain) {
      out += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

Result<std::vector<std::pair<std::string, std::string>>> label_filters(const Query& query) {
  std::vector<std::pair<std::string, std::string>> labels;
  for (const std::string& text : query.texts("label")) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos || !label_key_error(text.substr(0, colon)).empty()) {
      return Error{ErrorCode::kInvalid, "query parameters are wrong", {{"label", "must be key:value"}}};
    }
    labels.emplace_back(text.substr(0, colon), text.substr(colon + 1));
  }
  return labels;
}

// Commands have no arguments: an empty body, or an empty object.
Status check_no_arguments(const std::string& body) {
  if (body.empty()) return Ok{};
  const auto json = parse_json(body);
  if (!json) return json.error();
  if (!json->is_object()) return Error{ErrorCode::kInvalid, "the body is wrong", {{"", "must be an empty object"}}};
  std::vector<FieldError> errors;
  for (const auto& [name, value] : json->items()) errors.push_back({child_pointer("", name), "unknown field"});
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "the body is wrong", std::move(errors)};
  return Ok{};
}

// The turn of a submission with many founders; a small one needs none. Two large ones would hold workers that all other
// requests wait for.
class ManyFounders {
 public:
  ManyFounders(Context& context, std::uint64_t count)
      : flag_(count > kFoundersPlacedFreely ? &context.places_many : nullptr),
        is_ours_(flag_ == nullptr || !flag_->exchange(true)) {}
  ~ManyFounders() {
    if (flag_ != nullptr && is_ours_) *flag_ = false;
  }
  ManyFounders(const ManyFounders&) = delete;
  ManyFounders& operator=(const ManyFounders&) = delete;
  bool is_ours() const { return is_ours_; }

 private:
  std::atomic<bool>* const flag_;
  const bool is_ours_;
};

http::Response command(Context& context, const Call& call,
                       Result<JobService::Commanded> (JobService::*method)(const std::string&, const std::string&)) {
  if (const Status arguments = check_no_arguments(call.request.body); !arguments)
    return failure(arguments.error(), call);
  const auto done = (context.jobs.*method)(call.id(), call.request.principal.name);
  if (!done) return failure(done.error(), call);
  return json_response(done->changed ? 202 : 200, encode_job(done->view));
}

}  // namespace

http::Response post_job(Context& context, const Call& call) {
  const auto key = idempotency_key(call.request);
  if (!key) return failure(key.error(), call);
  const auto body = parse_json(call.request.body);
  if (!body) return failure(body.error(), call);
  const auto spec = decode_spec(*body, SpecLimits{context.config.jobs.cells_max});
  if (!spec) return failure(spec.error(), call);
  {
    const ManyFounders turn(context, founder_count(spec->run.params.founders));
    if (!turn.is_ours()) {
      return problem_response(ProblemKind::kOccupied,
                              {ErrorCode::kBusy, "a submission of more than " + std::to_string(kFoundersPlacedFreely) +
                                                     " founders is being checked; one at a time"},
                              call.request.request_id);
    }
    if (const Status placed = check_founders(spec->run, &context.draining); !placed)
      return failure(placed.error(), call);
  }
  if (call.query.boolean("dry_run", false)) {
    Json labels = Json::object();
    for (const auto& [name, value] : spec->labels) labels[name] = value;
    return json_response(200, {{"dry_run", true},
                               {"name", spec->name},
                               {"labels", labels},
                               {"spec", encode_spec(*spec)},
                               {"estimate", encode_estimate(estimate(spec->run))}});
  }
  NewJob job = new_job(*spec);
  job.submitted_by = call.request.principal.name;
  job.idempotency_key = *key;
  job.body_hash = hash_of(call.request.body);
  const auto submitted = context.jobs.submit(job);
  if (!submitted) return failure(submitted.error(), call);
  http::Response response = json_response(submitted->created ? 201 : 200, encode_job(submitted->view));
  response.headers.set("Location", context.config.base_path + "/v1/jobs/" + submitted->view.job.id);
  return response;
}

http::Response get_jobs(Context& context, const Call& call) {
  JobFilter filter;
  if (const auto state = call.query.text("state")) filter.state = job_state_from(*state);
  filter.kind = call.query.text("kind");
  filter.name = call.query.text("name");
  auto labels = label_filters(call.query);
  if (!labels) return failure(labels.error(), call);
  filter.labels = std::move(*labels);
  const std::uint64_t limit = call.query.integer("limit").value_or(kJobsPerPageDefault);
  const auto cursor = call.query.text("cursor");
  if (cursor && cursor->empty()) {
    return failure(
        {ErrorCode::kInvalid, "query parameters are wrong", {{"cursor", "must be `next` of the page before"}}}, call);
  }
  const auto page = context.jobs.list(filter, limit, cursor.value_or(""));
  if (!page) return failure(page.error(), call);
  Json items = Json::array();
  for (const JobView& view : page->items) items.push_back(encode_job(view));
  http::Response response =
      json_response(200, {{"items", std::move(items)}, {"next", page->next ? Json(*page->next) : Json(nullptr)}});
  if (page->next) {
    std::string target = context.config.base_path + "/v1/jobs?";
    for (const auto& [name, value] : call.request.query) {
      if (name != "cursor") target += percent_encoded(name) + "=" + percent_encoded(value) + "&";
    }
    response.headers.set("Link", "<" + target + "cursor=" + percent_encoded(*page->next) + ">; rel=\"next\"");
  }
  return response;
}

http::Response get_job_counts(Context& context, const Call& call) {
  const auto counts = context.jobs.counts();
  if (!counts) return failure(counts.error(), call);
  Json body = Json::object();
  for (std::size_t i = 0; i < counts->size(); ++i) body[std::string(name_of(static_cast<JobState>(i)))] = (*counts)[i];
  return json_response(200, body);
}

http::Response get_job(Context& context, const Call& call) {
  const auto view = context.jobs.show(call.id());
  return view ? json_response(200, encode_job(*view)) : failure(view.error(), call);
}

http::Response cancel_job(Context& context, const Call& call) { return command(context, call, &JobService::cancel); }
http::Response pause_job(Context& context, const Call& call) { return command(context, call, &JobService::pause); }
http::Response resume_job(Context& context, const Call& call) { return command(context, call, &JobService::resume); }

http::Response delete_job(Context& context, const Call& call) {
  const Status removed = context.jobs.remove(call.id());
  if (!removed) {
    // The one conflict that is not about an ended job.
    const ProblemKind kind = removed.error().code == ErrorCode::kConflict ? ProblemKind::kJobNotTerminal
                                                                          : problem_kind_of(removed.error().code);
    return problem_response(kind, removed.error(), call.request.request_id);
  }
  http::Response response;
  response.status = 204;
  return response;
}

}  // namespace colony::server::api
