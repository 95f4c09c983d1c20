#include "server/api/job_texts.hpp"

#include <utility>

#include "server/api/codec_event.hpp"
#include "server/api/conditional.hpp"

namespace colony::server::api {

http::Response job_answer(const JobText& text) {
  http::Response response;
  response.headers.set("Content-Type", "application/json");
  response.body = text.text;
  stamp(response, text.tag);
  return response;
}

std::shared_ptr<const JobText> JobTexts::find(const std::string& id) {
  const std::uint64_t commits = jobs_.commit_count();
  const std::lock_guard lock(mutex_);
  const auto kept = kept_.find(id);
  if (kept == kept_.end() || kept->second.commits != commits || Clock::now() >= kept->second.until) return nullptr;
  return kept->second.text;
}

Result<std::shared_ptr<const JobText>> JobTexts::read(const std::string& id) {
  if (auto text = find(id)) return text;
  const std::uint64_t commits =
      jobs_.commit_count();  // before the reading: what is committed meanwhile makes the text stale at once
  const auto view = jobs_.show(id);
  if (!view) return view.error();
  auto text = std::make_shared<JobText>();
  append_job_text(text->text, *view, base_path_);
  text->tag = job_tag(view->job);
  if (text->text.size() > kJobTextBytesMax) return std::shared_ptr<const JobText>(std::move(text));
  const bool is_live = view->job.state == JobState::kRunning || view->job.state == JobState::kPaused;
  const auto until = is_live ? Clock::now() + kLiveTextAge : Clock::time_point::max();
  const std::lock_guard lock(mutex_);
  if (kept_.size() >= kJobTextsMax && !kept_.contains(id)) kept_.clear();
  kept_[id] = Kept{text, commits, until};
  return std::shared_ptr<const JobText>(std::move(text));
}

}  // namespace colony::server::api
