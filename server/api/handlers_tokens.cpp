#include "server/api/handlers_tokens.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>

#include "server/api/api.hpp"
#include "server/api/schema.hpp"
#include "server/http/admission.hpp"
#include "server/store/identity.hpp"

namespace colony::server::api {
namespace {

constexpr const char* kNamePattern = "^[A-Za-z0-9][A-Za-z0-9._@-]{0,63}$";

// Who is nobody's token: the user of a server without tokens, a request without one, the service itself.
bool is_reserved(std::string_view name) { return name == "local" || name == "anonymous" || name == "service"; }

std::string name_fault(const std::string& name) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  const bool fits = !name.empty() && name.size() <= kTokenNameBytesMax && is_plain(name.front()) &&
                    std::all_of(name.begin(), name.end(), [&](char c) {
                      return is_plain(c) || c == '.' || c == '_' || c == '@' || c == '-';
                    });
  if (!fits) return "must be 1 to 64 of A-Z, a-z, 0-9, '.', '_', '@', '-', beginning with a letter or digit";
  if (is_reserved(name)) return "'" + name + "' is what the server calls others by";
  return {};
}

Json encode_token(const TokenRow& row) {
  return {{"id", row.id},
          {"name", row.name},
          {"scope", row.scope},
          {"created_by", row.created_by},
          {"created_at", row.created_at},
          {"expires_at", row.expires_at}};
}

Result<http::KnownToken> known(const TokenRow& row) {
  const auto scope = http::scope_from(row.scope);
  const auto expires = unix_ms_of(row.expires_at);
  if (!scope || !expires) return Error{ErrorCode::kStorage, "the stored token " + row.id + " cannot be read"};
  return http::KnownToken{row.id, row.name, *scope, row.secret_hash, *expires};
}

/// With tokens_mutex held, so that no removal can come between this and what follows: 401 for a token that has ended since it was let in.
std::optional<http::Response> refuse_ended(const Context& context, const Call& call) {
  const std::string& token_id = call.request.principal.token_id;
  if (token_id.empty() || context.tokens.is_alive(token_id, http::unix_time_ms())) return std::nullopt;
  return http::answer_of(http::token_has_ended(), call.request.request_id);
}

/// Whether this token is valid, an admin's, and no other will be for another kSpareAdminLife_h: one that ends in a moment would let
/// the last one go, and then nobody is left.
bool is_last_admin(const std::vector<TokenRow>& rows, const std::string& id) {
  const std::int64_t now_ms = http::unix_time_ms();
  const std::string now = wall_time_text_at(now_ms);  // such texts are in the order of time
  const std::string until = wall_time_text_at(now_ms + kSpareAdminLife_h * 3'600'000);
  bool is_one = false, is_other = false;
  for (const TokenRow& row : rows) {
    if (row.scope != "admin") continue;
    if (row.id == id) is_one = row.expires_at > now;
    if (row.id != id && row.expires_at >= until) is_other = true;
  }
  return is_one && !is_other;
}

Result<TokenWish> decode_wish(const Json& body) {
  if (!body.is_object()) return Error{ErrorCode::kInvalid, "the body is wrong", {{"", "must be an object"}}};
  TokenWish wish;
  std::vector<FieldError> errors;
  std::set<std::string> seen;
  for (const auto& [name, value] : body.items()) {
    const std::string pointer = child_pointer("", name);
    seen.insert(name);
    if (name == "name" || name == "scope") {
      if (!value.is_string()) {
        errors.push_back({pointer, "must be a string"});
      } else {
        (name == "name" ? wish.name : wish.scope) = value.get<std::string>();
      }
    } else if (name == "expires_h") {
      if (!value.is_number()) {
        errors.push_back({pointer, "must be a number"});
      } else {
        wish.expires_h = value.get<double>();
      }
    } else {
      errors.push_back({pointer, "unknown field"});
    }
  }
  for (const char* name : {"name", "scope", "expires_h"}) {
    if (!seen.contains(name)) errors.push_back({child_pointer("", name), "is needed"});
  }
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "the token is described wrongly", std::move(errors)};
  return wish;
}

}  // namespace

Result<CreatedToken> create_token(TokenStore& store, const TokenWish& wish, const std::string& created_by) {
  std::vector<FieldError> errors;
  if (std::string fault = name_fault(wish.name); !fault.empty()) errors.push_back({"/name", std::move(fault)});
  if (!http::scope_from(wish.scope)) errors.push_back({"/scope", "must be read, submit or admin"});
  if (!(wish.expires_h >= kTokenLifeMin_h && wish.expires_h <= kTokenLifeMax_h)) {
    errors.push_back({"/expires_h", "must be within 0.001 (3.6 s) and 87600 (ten years)"});
  }
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "the token is described wrongly", std::move(errors)};
  auto secret = http::new_token();
  if (!secret) return secret.error();
  NewToken token;
  token.name = wish.name;
  token.scope = wish.scope;
  token.secret_hash = http::hash_of_token(*secret);
  token.created_by = created_by;
  token.expires_at = wall_time_text_at(http::unix_time_ms() + std::llround(wish.expires_h * 3'600'000.0));
  auto made = store.create(token);
  if (!made) return made.error();
  return CreatedToken{std::move(made->row), std::move(*secret), std::move(made->removed)};
}

std::string removed_text(const TokenRow& row) {
  return "token " + row.id + " of " + row.name + " (" + row.scope + "), expired at " + row.expires_at +
         ", was removed to make room for a new one";
}

Status load_tokens(TokenStore& store, http::TokenTable& table) {
  const auto rows = store.list();
  if (!rows) return rows.error();
  for (const TokenRow& row : *rows) {
    auto token = known(row);
    if (!token) return token.error();
    table.add(std::move(*token));
  }
  return Ok{};
}

http::Response post_token(Context& context, const Call& call) {
  const auto body = parse_json(call.request.body);
  if (!body) return failure(body.error(), call);
  const auto wish = decode_wish(*body);
  if (!wish) return failure(wish.error(), call);
  // Store and table change together: else a removal in between would be undone in the table.
  const std::lock_guard lock(context.tokens_mutex);
  if (auto refused = refuse_ended(context, call)) return std::move(*refused);
  const auto created = create_token(context.jobs.store().tokens(), *wish, call.request.principal.name);
  if (!created) return failure(created.error(), call);
  for (const TokenRow& old : created->removed) {
    context.tokens.remove(old.id);
    if (context.config.jobs.log) context.config.jobs.log(removed_text(old));
  }
  auto token = known(created->row);
  if (!token) return failure(token.error(), call);
  context.tokens.add(std::move(*token));
  Json answer = encode_token(created->row);
  answer["token"] = created->secret;
  http::Response response = json_response(201, answer);
  response.headers.set("Location", context.config.base_path + "/v1/tokens/" + created->row.id);
  return response;
}

http::Response get_tokens(Context& context, const Call& call) {
  const auto rows = context.jobs.store().tokens().list();
  if (!rows) return failure(rows.error(), call);
  Json items = Json::array();
  for (const TokenRow& row : *rows) items.push_back(encode_token(row));
  return json_response(200, {{"items", std::move(items)}, {"next", nullptr}});
}

http::Response delete_token(Context& context, const Call& call) {
  const std::lock_guard lock(context.tokens_mutex);
  if (auto refused = refuse_ended(context, call)) return std::move(*refused);
  // Where nobody needs a token (or asks as nobody's token), nobody can be locked out.
  if (!call.request.principal.token_id.empty()) {
    const auto rows = context.jobs.store().tokens().list();
    if (!rows) return failure(rows.error(), call);
    if (is_last_admin(*rows, call.id())) {
      return problem_response(ProblemKind::kLastAdmin,
                              {ErrorCode::kConflict, "no other token of scope admin is valid for at least " + std::to_string(kSpareAdminLife_h) +
                                                     " h more, so soon nobody could make one; make such a one first. With the server stopped, "
                                                     "`colonyd token create` makes one too"},
                              call.request.request_id);
    }
  }
  const Status removed = context.jobs.store().tokens().remove(call.id());
  if (!removed) return failure(removed.error(), call);
  context.tokens.remove(call.id());
  http::Response response;
  response.status = 204;
  return response;
}

Json token_components() {
  const Json text = {{"type", "string"}};
  const Json time = {{"type", "string"}, {"format", "date-time"}};
  const Json scope = {{"enum", Json::array({"read", "submit", "admin"})}};
  const Json token = {{"id", text},         {"name", text},       {"scope", scope},
                      {"created_by", text}, {"created_at", time}, {"expires_at", time}};
  Json created = token;
  created["token"] = {{"type", "string"}, {"pattern", "^colony_[0-9a-f]{64}$"}, {"description", "the secret, shown once"}};
  return {{"NewToken", strict_object({{"name", {{"type", "string"}, {"pattern", kNamePattern}}},
                                      {"scope", scope},
                                      {"expires_h",
                                       {{"type", "number"},
                                        {"minimum", kTokenLifeMin_h},
                                        {"maximum", kTokenLifeMax_h},
                                        {"description", "hours from now"}}}})},
          {"Token", strict_object(token)},
          {"CreatedToken", strict_object(created)},
          {"TokenList", strict_object({{"items", {{"type", "array"}, {"items", reference("Token")}}},
                                       {"next", {{"type", "null"}}}})}};
}

}  // namespace colony::server::api
