#include "server/api/conditional.hpp"

#include <algorithm>
#include <limits>
#include <memory>

#include "server/api/api.hpp"

namespace colony::server::api {
namespace {

constexpr std::string_view kRevalidate = "private, no-cache";

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return out;
}

/// The fields of a name as one list.
std::string joined_fields(const http::Headers& headers, std::string_view name) {
  std::string out;
  for (const auto& [key, value] : headers.all()) {
    if (lower(key) == lower(name)) out += (out.empty() ? "" : ", ") + value;
  }
  return out;
}

/// Takes one tag from the front; nullopt if there is none.
std::optional<EntityTag> take_tag(std::string_view& text) {
  EntityTag tag;
  if (text.starts_with("W/")) {
    tag.is_weak = true;
    text.remove_prefix(2);
  }
  if (!text.starts_with('"')) return std::nullopt;
  const std::size_t end = text.find('"', 1);
  if (end == std::string_view::npos) return std::nullopt;
  tag.text = text.substr(0, end + 1);
  const auto allowed = [](char c) { return c == '!' || (static_cast<unsigned char>(c) >= '#' && c != '\x7f'); };
  if (!std::all_of(tag.text.begin() + 1, tag.text.end() - 1, allowed)) return std::nullopt;
  text.remove_prefix(end + 1);
  return tag;
}

/// Each part behind its length, so that no two lists of parts give the same bytes.
std::string tag_of(std::initializer_list<std::string_view> parts) {
  CanonicalBytes bytes;
  for (const std::string_view part : parts) {
    bytes.add_u64(part.size());
    for (const char c : part) bytes.add_u8(static_cast<std::uint8_t>(c));
  }
  return '"' + chain(Digest{}, std::move(bytes)).hex() + '"';
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

/// A body that HEAD does not make; chunked framing then says that its length is not known.
class NotMade : public http::BodySource {
 public:
  Pull pull(std::string&) override { return Pull::kEnd; }
};

bool is_safe(const http::Request& request) { return request.method == "GET" || request.method == "HEAD"; }

/// 304 with those fields that it must have (RFC 9110, 15.4.5), and without those of the content.
http::Response not_modified(const http::Response& full) {
  http::Response response;
  response.status = 304;
  for (const auto& [name, value] : full.headers.all()) {
    if (lower(name) != "content-type") response.headers.add(name, value);
  }
  return response;
}

/// The GET of an endpoint's own path, if its answers have a tag.
const Endpoint* tagged_get(const Endpoint& endpoint) {
  for (const Endpoint& one : endpoints()) {
    if (one.method == "GET" && one.path == endpoint.path && one.validator != Validator::kNone) return &one;
  }
  return nullptr;
}

}  // namespace

Result<std::optional<TagList>> read_tags(const http::Headers& headers, std::string_view name) {
  if (headers.count(name) == 0) return std::optional<TagList>();
  const std::string field = joined_fields(headers, name);
  std::string_view rest = trimmed(field);
  TagList list;
  if (rest == "*") {
    list.is_any = true;
    return std::optional(std::move(list));
  }
  bool is_due = true;  // a tag may stand here: not right behind another one. Empty elements are let pass (RFC 9110, 5.6.1).
  while (!rest.empty()) {
    if (rest.front() == ',') {
      is_due = true;
      rest = trimmed(rest.substr(1));
      continue;
    }
    auto tag = is_due ? take_tag(rest) : std::nullopt;
    if (!tag) break;
    list.tags.push_back(std::move(*tag));
    is_due = false;
    rest = trimmed(rest);
  }
  if (rest.empty() && !list.tags.empty()) return std::optional(std::move(list));
  return Error{ErrorCode::kMalformed,
               "a header cannot be read",
               {{std::string(name), "must be * or entity tags in quotes, separated by commas"}}};
}

bool matches_weakly(const TagList& list, std::string_view tag) {
  return list.is_any ||
         std::any_of(list.tags.begin(), list.tags.end(), [&](const EntityTag& one) { return one.text == tag; });
}

bool matches_strongly(const TagList& list, std::string_view tag) {
  return list.is_any || std::any_of(list.tags.begin(), list.tags.end(),
                                    [&](const EntityTag& one) { return !one.is_weak && one.text == tag; });
}

std::optional<int> wait_wished(const http::Headers& headers) {
  for (const std::string& element : split(joined_fields(headers, "Prefer"), ',')) {
    const std::string wish = std::string(trimmed(element.substr(0, element.find(';'))));
    const std::size_t equals = wish.find('=');
    if (lower(trimmed(wish.substr(0, equals))) != "wait") continue;
    if (equals == std::string::npos) return std::nullopt;
    std::string_view value = trimmed(std::string_view(wish).substr(equals + 1));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    const bool is_digits = !value.empty() && value.find_first_not_of("0123456789") == std::string_view::npos;
    if (!is_digits) return std::nullopt;
    return static_cast<int>(std::min<std::uint64_t>(parse_integer(value).value_or(kWaitMax_s), kWaitMax_s));
  }
  return std::nullopt;
}

std::string job_tag(const JobRow& job) {
  return '"' + std::to_string(job.revision) + '.' + std::to_string(job.last_seq) + '"';
}

std::vector<std::uint64_t> revisions_of(const TagList& list, bool also_weak) {
  std::vector<std::uint64_t> revisions;
  for (const EntityTag& tag : list.tags) {
    if (tag.is_weak && !also_weak) continue;
    const std::string inner = tag.text.substr(1, tag.text.size() - 2);
    const std::size_t dot = inner.find('.');
    if (dot == std::string::npos || !parse_integer(inner.substr(dot + 1))) continue;
    if (const auto revision = parse_integer(inner.substr(0, dot))) revisions.push_back(*revision);
  }
  return revisions;
}

std::string derived_tag(const Context& context, const Call& call, const Digest& digest, std::uint64_t seq,
                        std::string_view more) {
  // Which resource of the job it is; not which job: the same history has the same tag wherever it was grown.
  const std::string_view resource = std::string_view(call.request.path).substr(call.request.path.rfind('/') + 1);
  // No coding but identity is ever applied here; it is named so that one to come changes the tag.
  return tag_of({resource, digest.hex(), std::to_string(seq), call.query.normalised(), call.media, "identity",
                 context.config.version, more});
}

std::optional<http::Response> settled_by_tag(const Call& call, const std::string& tag) {
  // `*` asks whether there is an answer at all: only the work can tell. What the program cannot have given out matches nothing.
  const bool is_known = call.if_none_match && !call.if_none_match->is_any && matches_weakly(*call.if_none_match, tag);
  const bool is_refused = call.if_match && !matches_strongly(*call.if_match, tag);  // apply_conditions says so
  if (!is_known && !is_refused && call.request.method != "HEAD") return std::nullopt;
  http::Response response;
  response.headers.set("Content-Type", content_type(call.media));
  response.stream = std::make_unique<NotMade>();
  stamp(response, tag);
  return response;
}

std::optional<http::Response> settled_by_history(Context& context, const Call& call, std::string_view more) {
  const auto moment = context.jobs.moment(call.id(), call.query.number("at_h"));
  if (moment && moment->job.kind != kColonyKind) return std::nullopt;  // the handler says what it lacks
  if (!moment) return failure(moment.error(), call);
  return settled_by_tag(call, derived_tag(context, call, moment->digest, moment->seq, more));
}

std::string history_tag(const Context& context, const Call& call, const ColonyAt& at, std::string_view more) {
  return derived_tag(context, call, at.digest, at.colony->last_seq(), more);
}

void stamp(http::Response& response, const std::string& tag) {
  response.headers.set("ETag", tag);
  response.headers.set("Cache-Control", kRevalidate);
}

Compared compared_by(const Endpoint& endpoint) {
  // What is sent to a collection makes something that has no tag yet. The list's own tag is no stand-in: it changes with each event of
  // any job, and the repetition that an Idempotency-Key allows would be told 412 because the first one had been carried out.
  if (endpoint.method == "POST" && endpoint.path.find('{') == std::string_view::npos) return Compared::kNothing;
  if (endpoint.path.starts_with("/v1/jobs/{job_id}")) return Compared::kJob;
  return tagged_get(endpoint) != nullptr ? Compared::kGet : Compared::kNothing;
}

std::optional<http::Response> refused_before(const Endpoint& endpoint, Context& context, const Call& call) {
  if ((!call.if_match && !call.if_none_match) || is_safe(call.request)) return std::nullopt;
  const Compared by = compared_by(endpoint);
  if (by == Compared::kJob) return std::nullopt;
  if (by == Compared::kNothing) {
    std::vector<FieldError> fields;
    for (const char* name : {"If-Match", "If-None-Match"}) {
      if (call.request.headers.count(name) > 0) fields.push_back({name, "cannot be held: there is nothing with a tag to hold it against"});
    }
    return failure({ErrorCode::kMalformed, "this request takes no preconditions; nothing was done", std::move(fields)}, call);
  }
  http::Request get;
  get.method = "GET";
  get.path = call.request.path;
  get.path_params = call.request.path_params;
  get.principal = call.request.principal;
  get.request_id = call.request.request_id;
  http::Response is = run_endpoint(*tagged_get(endpoint), context, get);
  if (is.status == 404) return std::nullopt;  // the handler says what there is not
  if (is.status != 200) return is;
  const std::string tag(is.headers.get("ETag").value_or(""));
  if (call.if_match && !matches_strongly(*call.if_match, tag)) {
    return problem_response(ProblemKind::kPreconditionFailed,
                            {ErrorCode::kConflict, "what is there has another tag; nothing was done", {{"If-Match", "is not " + tag}}},
                            call.request.request_id);
  }
  if (call.if_none_match && matches_weakly(*call.if_none_match, tag)) {
    return problem_response(ProblemKind::kPreconditionFailed,
                            {ErrorCode::kConflict, "what is there is what must not be; nothing was done",
                             {{"If-None-Match", "fits " + tag}}},
                            call.request.request_id);
  }
  return std::nullopt;
}

void apply_conditions(const Endpoint& endpoint, const Call& call, http::Response& response) {
  if (endpoint.media.size() > 1) response.headers.set("Vary", "Accept");
  if (!is_safe(call.request) || response.status != 200) return;
  if (endpoint.validator == Validator::kBody && !response.stream && response.headers.count("ETag") == 0)
    stamp(response, tag_of({call.media, response.body}));
  const std::string tag(response.headers.get("ETag").value_or(""));
  if (call.if_match && !matches_strongly(*call.if_match, tag)) {
    response = problem_response(
        ProblemKind::kPreconditionFailed,
        {ErrorCode::kConflict, "the answer has another tag", {{"If-Match", tag.empty() ? "there is no tag here" : "is not " + tag}}},
        call.request.request_id);
  } else if (call.if_none_match && matches_weakly(*call.if_none_match, tag)) {
    response = not_modified(response);
  }
}

std::string content_type(std::string_view media) {
  return media == "text/csv" ? "text/csv; charset=utf-8; header=present" : std::string(media);
}

void set_next_link(const Context& context, const Call& call, http::Response& response, std::string_view name,
                   std::string_view value) {
  std::string target = context.config.base_path + call.request.path + "?";
  for (const auto& [key, text] : call.request.query) {
    if (key != name) target += percent_encoded(key) + "=" + percent_encoded(text) + "&";
  }
  target += std::string(name) + "=" + percent_encoded(value);
  response.headers.set("Link", "<" + target + ">; rel=\"next\"");
}

}  // namespace colony::server::api
