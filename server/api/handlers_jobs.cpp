// Handlers of jobs themselves: submit, list, show, command, delete.
#include <algorithm>
#include <atomic>

#include "server/api/api.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/estimate.hpp"
#include "server/api/job_texts.hpp"
#include "server/api/kept.hpp"
#include "server/api/submission.hpp"

namespace colony::server::api {
namespace {

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
                       Result<JobService::Commanded> (JobService::*method)(const std::string&, const std::string&,
                                                                           const RevisionCondition&)) {
  if (const Status arguments = check_no_arguments(call.request.body); !arguments)
    return failure(arguments.error(), call);
  const auto done = (context.jobs.*method)(call.id(), call.request.principal.name, revision_condition(call));
  if (!done) return failure(done.error(), call);
  if (!done->is_current) return not_as_supposed(call, done->view.job);
  return job_response(context, done->changed ? 202 : 200, done->view);
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
    if (const Status placed = check_founders(spec->run, call.stop(context)); !placed)
      return failure(placed.error(), call);
  }
  if (call.query.boolean("dry_run", false)) {
    Json labels = Json::object();
    for (const auto& [name, value] : spec->labels) labels[name] = value;
    return json_response(200, {{"dry_run", true},
                               {"name", spec->name},
                               {"labels", labels},
                               {"spec", encode_spec(*spec)},
                               {"estimate", encode_estimate(estimate(spec->run, context.config.jobs.threads_per_job))}});
  }
  NewJob job = new_job(*spec);
  job.submitted_by = call.request.principal.name;
  job.idempotency_key = *key;
  job.body_hash = hash_of_body("", call.request.body);
  const auto submitted = context.jobs.submit(job);
  if (!submitted) return failure(submitted.error(), call);
  return submitted_response(context, submitted->view, submitted->created);
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
  http::Response response;
  response.headers.set("Content-Type", "application/json");
  response.body = "{\"items\":[";
  for (const JobView& view : page->items) {
    if (&view != &page->items.front()) response.body += ',';
    append_job_text(response.body, view, context.config.base_path);
  }
  response.body += "],\"next\":" + to_text(page->next ? Json(*page->next) : Json(nullptr)) + "}";
  if (page->next) set_next_link(context, call, response, "cursor", *page->next);
  return response;
}

http::Response get_job_counts(Context& context, const Call& call) {
  const auto counts = context.jobs.counts();
  if (!counts) return failure(counts.error(), call);
  Json body = Json::object();
  for (std::size_t i = 0; i < counts->size(); ++i) body[std::string(name_of(static_cast<JobState>(i)))] = (*counts)[i];
  return json_response(200, body);
}

http::Response cancel_job(Context& context, const Call& call) { return command(context, call, &JobService::cancel); }
http::Response pause_job(Context& context, const Call& call) { return command(context, call, &JobService::pause); }
http::Response resume_job(Context& context, const Call& call) { return command(context, call, &JobService::resume); }

http::Response delete_job(Context& context, const Call& call) {
  const auto removed = context.jobs.remove(call.id(), revision_condition(call));
  if (!removed) {
    // The one conflict that is not about an ended job.
    const ProblemKind kind = removed.error().code == ErrorCode::kConflict ? ProblemKind::kJobNotTerminal
                                                                          : problem_kind_of(removed.error().code);
    return problem_response(kind, removed.error(), call.request.request_id);
  }
  if (!removed->is_current) return not_as_supposed(call, removed->job);
  context.kept->drop(call.id());  // figures of comparisons with it
  http::Response response;
  response.status = 204;
  return response;
}

}  // namespace colony::server::api
