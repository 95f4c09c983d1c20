#include "server/api/kept.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "engine/base/check.hpp"
#include "server/api/conditional.hpp"

namespace colony::server::api {

std::optional<http::Response> KeptAnswers::find(const std::string& tag) {
  http::Response response;
  std::shared_ptr<const std::string> body;
  {
    const std::lock_guard lock(mutex_);
    const auto at = by_tag_.find(tag);
    if (at == by_tag_.end()) return std::nullopt;
    const Entry entry = at->second;
    kept_.splice(kept_.begin(), kept_, entry);
    response.headers.set("Content-Type", entry->content_type);
    body = entry->body;
  }
  response.body = *body;  // megabytes: not under the lock
  stamp(response, tag);
  return response;
}

void KeptAnswers::keep(const std::string& tag, std::vector<std::string> made_of, const http::Response& response) {
  CHECK(response.status == 200 && !response.stream);
  if (response.body.size() > bytes_max_) return;
  Kept one{tag, std::string(response.headers.get("Content-Type").value_or("")), std::move(made_of),
           std::make_shared<const std::string>(response.body)};
  const std::lock_guard lock(mutex_);
  if (by_tag_.contains(tag)) return;
  bytes_ += one.body->size();
  kept_.push_front(std::move(one));
  by_tag_.emplace(kept_.front().tag, kept_.begin());
  while (bytes_ > bytes_max_ || kept_.size() > entries_max_) erase(std::prev(kept_.end()));
}

// A walk: deletions are rare, and the entries are few.
void KeptAnswers::drop(std::string_view id) {
  const std::lock_guard lock(mutex_);
  for (Entry entry = kept_.begin(); entry != kept_.end();) {
    const Entry one = entry++;
    if (std::find(one->made_of.begin(), one->made_of.end(), id) != one->made_of.end()) erase(one);
  }
}

void KeptAnswers::erase(Entry entry) {
  bytes_ -= entry->body->size();
  by_tag_.erase(entry->tag);  // first: its key is in the entry
  kept_.erase(entry);
}

}  // namespace colony::server::api
