// Handler of the one event stream for a page.
#include <algorithm>
#include <memory>
#include <utility>

#include "server/api/api.hpp"
#include "server/api/page_stream.hpp"

namespace colony::server::api {
namespace {

bool is_uuid(std::string_view text) {
  constexpr std::string_view kForm = "xxxxxxxx-xxxx-xxxx-xxxx-xxxxxxxxxxxx";
  return std::equal(text.begin(), text.end(), kForm.begin(), kForm.end(), [](char c, char form) {
    return form == '-' ? c == '-' : (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
  });
}

Result<PageWish> page_wish(JobService& jobs, const std::string& text) {
  PageWish wish;
  wish.is_all = text == "all";
  if (wish.is_all) return wish;
  const std::vector<std::string> ids = split(text, ',');
  if (ids.size() > kPageJobsMax || !std::all_of(ids.begin(), ids.end(), is_uuid)) {
    return Error{ErrorCode::kInvalid,
                 "query parameters are wrong",
                 {{"jobs", "must be all, or at most " + std::to_string(kPageJobsMax) +
                               " ids of jobs in lower case, separated by commas"}}};
  }
  for (const std::string& id : ids) {
    const auto view = jobs.show(id);
    if (view) {
      wish.jobs[view->job.job_key] = id;
    } else if (view.error().code == ErrorCode::kNotFound) {
      // Deleted while a page that shows it was away: the page must learn that from the stream, EventSource shows it no status.
      wish.missing.push_back(id);
    } else {
      return view.error();
    }
  }
  return wish;
}

}  // namespace

http::Response get_stream(Context& context, const Call& call) {
  auto wish = page_wish(context.jobs, call.query.text("jobs").value_or("all"));
  if (!wish) return failure(wish.error(), call);
  http::Response response;
  response.headers.set("Content-Type", call.media);
  response.headers.set("Cache-Control", "no-store");
  response.headers.set("X-Accel-Buffering", "no");  // nginx would keep events back
  response.stream = std::make_unique<PageStream>(context.jobs, *context.pages, std::move(*wish));
  return response;
}

}  // namespace colony::server::api
