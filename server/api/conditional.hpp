// conditional: validators and preconditions (RFC 9110, 8.8 and 13), the wish to wait (RFC 7240) and links to a next page (RFC 8288).
// Promise: a tag is a function of what the answer is a function of; what the tag settles is answered before the work.
// Errors:  kMalformed for a field that is no list of tags: a precondition that cannot be read must not be passed over.
// Threads: pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/digest.hpp"
#include "engine/base/result.hpp"
#include "server/http/message.hpp"

namespace colony::server {
struct JobRow;
}

namespace colony::server::api {

struct Call;
struct Context;
struct Endpoint;

struct EntityTag {
  std::string text;  // with its quotes
  bool is_weak = false;
};

/// If-Match or If-None-Match: `*`, or any number of tags.
struct TagList {
  bool is_any = false;
  std::vector<EntityTag> tags;
};

/// All fields of this name as one list; nullopt without the field.
Result<std::optional<TagList>> read_tags(const http::Headers& headers, std::string_view name);
/// The weak comparison, of If-None-Match. `tag` with its quotes, without W/.
bool matches_weakly(const TagList& list, std::string_view tag);
/// The strong comparison, of If-Match: a weak tag matches nothing.
bool matches_strongly(const TagList& list, std::string_view tag);

inline constexpr int kWaitMax_s = 60;
/// `wait` of Prefer, s; above kWaitMax_s: kWaitMax_s. nullopt without the wish, and where it cannot be read: RFC 7240 wants wishes
/// that a server does not understand to be passed over. Of several the first counts.
std::optional<int> wait_wished(const http::Headers& headers);

/// `"<revision>.<last_seq>"`
std::string job_tag(const JobRow& job);
/// The revisions that these tags name; weak tags name one too if `also_weak`.
std::vector<std::uint64_t> revisions_of(const TagList& list, bool also_weak);

/// The tag of an answer that is a function of a history up to `seq`, of `more`, the request's query and the program.
std::string derived_tag(const Context& context, const Call& call, const Digest& digest, std::uint64_t seq,
                        std::string_view more = {});
/// 304 if the request has this tag already; for HEAD the header without the work; else nullopt: work.
std::optional<http::Response> settled_by_tag(const Call& call, const std::string& tag);
/// ETag, and that a cache must ask before it gives the answer again.
void stamp(http::Response& response, const std::string& tag);

/// What If-Match and If-None-Match of a request that changes something are held against.
enum class Compared {
  kNothing,  // the target has no tag, or is a collection to add to: such a request is refused (400), not passed over
  kJob,      // the job of the path, by its revision; the handler looks (refused_by_preconditions)
  kGet       // what GET of the same path answers (DELETE of an analysis)
};
/// Of POST, PATCH and DELETE.
Compared compared_by(const Endpoint& endpoint);
/// 400 or 412 of such a request, before its handler; nullopt: run it. Of kJob always: its handler knows when to look.
std::optional<http::Response> refused_before(const Endpoint& endpoint, Context& context, const Call& call);

/// What is left to do after a handler: the tag of the body where the endpoint has one, If-Match and If-None-Match of GET and HEAD, Vary.
void apply_conditions(const Endpoint& endpoint, const Call& call, http::Response& response);

/// Content-Type of an answer in this media type.
std::string content_type(std::string_view media);

/// Link rel=next: the request's own target with parameter `name` = `value`.
void set_next_link(const Context& context, const Call& call, http::Response& response, std::string_view name,
                   std::string_view value);

}  // namespace colony::server::api
