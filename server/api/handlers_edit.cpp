// Handlers of one job: look at it, wait for a change, edit name and labels.
#include <algorithm>
#include <memory>
#include <utility>

#include "server/api/api.hpp"
#include "server/api/codec_patch.hpp"
#include "server/api/job_texts.hpp"

namespace colony::server::api {
namespace {

constexpr std::string_view kPreferenceApplied = "Preference-Applied";

bool names_revision(const TagList& list, const JobRow& job, bool also_weak) {
  const auto revisions = revisions_of(list, also_weak);
  return std::find(revisions.begin(), revisions.end(), job.revision) != revisions.end();
}

const Endpoint& show_endpoint() {
  static const Endpoint& endpoint = *std::find_if(
      endpoints().begin(), endpoints().end(), [](const Endpoint& one) { return one.operation_id == "showJob"; });
  return endpoint;
}

/// The answer to a request that waits until the job has another revision. It holds a connection and no thread; commits of events
/// do not wake it.
class JobWait : public http::LaterAnswer {
 public:
  /// One of context.waiting is counted for it already.
  JobWait(Context& context, const Call& call, std::int64_t job_key, int wait_s)
      : context_(context),
        request_(call.request),
        call_{request_, call.query, call.media, call.if_match, call.if_none_match},
        job_key_(job_key),
        wait_s_(wait_s) {}
  ~JobWait() override { --context_.waiting; }

  void on_ready(std::function<void()> wake) override {
    subscription_ = context_.jobs.follow(job_key_, [wake = std::move(wake)](const JobNews& news) {
      if (news.kind != JobNews::Kind::kCommit) wake();
    });
  }

  std::unique_ptr<http::Response> ask(bool is_last) override {
    const auto view = context_.jobs.show(call_.id());
    if (view && !is_last && names_revision(*call_.if_none_match, view->job, true)) return nullptr;
    auto response = std::make_unique<http::Response>(view ? job_response(context_, 200, *view)
                                                          : failure(view.error(), call_));
    if (view) response->headers.set(kPreferenceApplied, "wait=" + std::to_string(wait_s_));
    apply_conditions(show_endpoint(), call_, *response);
    return response;
  }

  std::chrono::milliseconds wait_max() const override { return std::chrono::seconds(wait_s_); }

 private:
  Context& context_;
  const http::Request request_;
  const Call call_;  // of request_
  const std::int64_t job_key_;
  const int wait_s_;
  std::unique_ptr<JobService::Subscription> subscription_;
};

}  // namespace

RevisionCondition revision_condition(const Call& call) {
  RevisionCondition condition;
  if (call.if_match && !call.if_match->is_any) condition.one_of = revisions_of(*call.if_match, false);
  if (call.if_none_match && call.if_none_match->is_any) condition.one_of = std::vector<std::uint64_t>{};  // whatever is there is one too many
  if (call.if_none_match) condition.none_of = revisions_of(*call.if_none_match, true);
  return condition;
}

http::Response not_as_supposed(const Call& call, const JobRow& job) {
  const std::string revision = std::to_string(job.revision);
  const bool is_matched = !call.if_match || call.if_match->is_any || names_revision(*call.if_match, job, false);
  const FieldError fault = is_matched ? FieldError{"If-None-Match", "names revision " + revision + ", or any"}
                                      : FieldError{"If-Match", "names no tag of revision " + revision + " (a weak tag names none)"};
  return problem_response(ProblemKind::kPreconditionFailed,
                          {ErrorCode::kConflict, "the job is at revision " + revision + "; nothing was changed", {fault}},
                          call.request.request_id);
}

std::optional<http::Response> refused_by_preconditions(Context& context, const Call& call) {
  if (!call.if_match && !call.if_none_match) return std::nullopt;
  const auto view = context.jobs.show(call.id());
  if (!view) return failure(view.error(), call);
  if (revision_condition(call).holds(view->job.revision)) return std::nullopt;
  return not_as_supposed(call, view->job);
}

http::Response get_job(Context& context, const Call& call) {
  const auto wait_s = wait_wished(call.request.headers);
  if (!wait_s || !call.if_none_match) {
    const auto text = context.job_texts->read(call.id());
    return text ? job_answer(**text) : failure(text.error(), call);
  }
  const auto view = context.jobs.show(call.id());
  if (!view) return failure(view.error(), call);
  const bool is_to_wait = wait_s && call.if_none_match && names_revision(*call.if_none_match, view->job, true);
  // A wish may be left alone (RFC 7240): with half of the connections waiting, the others are for those who do not. The answer then
  // lacks Preference-Applied.
  if (is_to_wait && !context.draining) {
    if (context.waiting.fetch_add(1) < std::max<std::size_t>(context.config.connections_max / 2, 1)) {
      http::Response response;
      response.later = std::make_unique<JobWait>(context, call, view->job.job_key, *wait_s);
      return response;
    }
    --context.waiting;
  }
  http::Response response = job_response(context, 200, *view);
  if (wait_s && call.if_none_match && !is_to_wait)
    response.headers.set(kPreferenceApplied, "wait=" + std::to_string(*wait_s));
  return response;
}

http::Response patch_job(Context& context, const Call& call) {
  const auto body = parse_json(call.request.body);
  if (!body) return failure(body.error(), call);
  const auto change = decode_job_patch(*body);
  if (!change) return failure(change.error(), call);
  const auto edited = context.jobs.edit(call.id(), *change, revision_condition(call), call.request.principal.name);
  if (!edited) return failure(edited.error(), call);
  if (!edited->is_current) return not_as_supposed(call, edited->view.job);
  return job_response(context, 200, edited->view);
}

}  // namespace colony::server::api
