#include "server/api/kept.hpp"

#include <algorithm>

#include "engine/base/check.hpp"
#include "server/api/conditional.hpp"

namespace colony::server::api {

std::optional<http::Response> KeptAnswers::find(const std::string& tag) {
  http::Response response;
  std::shared_ptr<const std::string> body;
  {
    const std::lock_guard lock(mutex_);
    const auto at = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& one) { return one.tag == tag; });
    if (at == kept_.end()) return std::nullopt;
    kept_.splice(kept_.begin(), kept_, at);
    response.headers.set("Content-Type", at->content_type);
    body = at->body;
  }
  response.body = *body;  // megabytes: not under the lock
  stamp(response, tag);
  return response;
}

void KeptAnswers::keep(const std::string& tag, const http::Response& response) {
  CHECK(response.status == 200 && !response.stream);
  if (response.body.size() > bytes_max_) return;
  Kept one{tag, std::string(response.headers.get("Content-Type").value_or("")), std::make_shared<const std::string>(response.body)};
  const std::lock_guard lock(mutex_);
  if (std::any_of(kept_.begin(), kept_.end(), [&](const Kept& other) { return other.tag == tag; })) return;
  bytes_ += one.body->size();
  kept_.push_front(std::move(one));
  while (bytes_ > bytes_max_) {
    bytes_ -= kept_.back().body->size();
    kept_.pop_back();
  }
}

}  // namespace colony::server::api
