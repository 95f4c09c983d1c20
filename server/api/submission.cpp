#include "server/api/submission.hpp"

#include <algorithm>

#include "engine/base/digest.hpp"

namespace colony::server::api {

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

std::string hash_of_body(std::string_view what, const std::string& body) {
  CanonicalBytes bytes;
  for (const char c : what) bytes.add_u8(static_cast<std::uint8_t>(c));
  for (const char c : body) bytes.add_u8(static_cast<std::uint8_t>(c));
  return chain(Digest{}, std::move(bytes)).hex();
}

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

http::Response submitted_response(const Context& context, const JobView& view, bool is_new) {
  http::Response response = job_response(context, is_new ? 201 : 200, view);
  response.headers.set("Location", context.config.base_path + "/v1/jobs/" + view.job.id);
  return response;
}

}  // namespace colony::server::api
