#include "server/http/admission.hpp"

#include <boost/asio/ip/address.hpp>

#include "server/http/text.hpp"

namespace colony::server::http {
namespace {
namespace ip = boost::asio::ip;

constexpr std::string_view kChallenge = "Bearer realm=\"colony\"";

Refusal too_many(std::string_view what, std::int64_t retry_after_s) {
  Refusal refusal{429, "too-many-requests", "Too many requests",
                  std::string(what) + "; try again in " + std::to_string(retry_after_s) + " s"};
  refusal.retry_after_s = retry_after_s;
  return refusal;
}

Refusal unauthorized(std::string detail, std::string_view error) {
  Refusal refusal{401, "unauthorized", "A token is needed", std::move(detail)};
  refusal.challenge = kChallenge;
  if (!error.empty()) {
    refusal.challenge += ", error=\"" + std::string(error) + "\", error_description=\"" + refusal.detail + "\"";
  }
  return refusal;
}

Refusal insufficient(Scope has, Scope needed) {
  Refusal refusal{403, "insufficient-scope", "The token does not allow this",
                  "this needs a token of scope " + std::string(name_of(needed)) + ", and this one has " +
                      std::string(name_of(has))};
  refusal.challenge = std::string(kChallenge) + ", error=\"insufficient_scope\", scope=\"" +
                      std::string(name_of(needed)) + "\"";
  return refusal;
}

Scope needed_scope(Access access) {
  if (access == Access::kAdmin) return Scope::kAdmin;
  return access == Access::kSubmit ? Scope::kSubmit : Scope::kRead;
}

}  // namespace

std::optional<ClientAddress> client_address(std::string_view text) {
  boost::system::error_code error;
  ip::address address = ip::make_address(std::string(text), error);
  if (error) return std::nullopt;
  if (address.is_v6() && address.to_v6().is_v4_mapped()) {
    address = ip::make_address_v4(ip::v4_mapped, address.to_v6());
  }
  ClientAddress out{address.to_string(), address.to_string(), address.is_loopback()};
  if (address.is_v6() && !out.is_loopback) {
    auto bytes = address.to_v6().to_bytes();
    std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
    out.key = ip::address_v6(bytes).to_string() + "/64";
  }
  return out;
}

ClientAddress forwarded_address(const Headers& headers, const ClientAddress& peer) {
  std::string_view last;
  for (const auto& [name, value] : headers.all()) {
    if (equals_without_case(name, "X-Forwarded-For")) last = value;  // of several fields the last continues the list
  }
  if (const auto comma = last.rfind(','); comma != std::string_view::npos) last.remove_prefix(comma + 1);
  auto address = client_address(trim_blanks(last));
  return address ? std::move(*address) : peer;
}

Refusal token_has_ended() { return unauthorized("the token has ended meanwhile", "invalid_token"); }

Response answer_of(const Refusal& refusal, std::string_view request_id) {
  Response response = problem(refusal.status, refusal.code, refusal.title, refusal.detail, request_id);
  if (refusal.status == 503) response.headers.set("Retry-After", "1");
  if (refusal.retry_after_s > 0) response.headers.set("Retry-After", std::to_string(refusal.retry_after_s));
  if (!refusal.challenge.empty()) response.headers.set("WWW-Authenticate", refusal.challenge);
  return response;
}

Admission::Admission(AdmissionConfig config, const TokenTable& tokens)
    : config_(config),
      tokens_(tokens),
      requests_(config.requests),
      failures_({config.failed_tokens_per_min / 60.0, std::max(1.0, config.failed_tokens_per_min)}) {}

std::optional<Refusal> Admission::count_by_address(const ClientAddress& client, Moment now) {
  if (client.is_loopback && !config_.limits_loopback) return std::nullopt;
  const std::int64_t wait_s = requests_.take("address " + client.key, now.steady);
  if (wait_s == 0) return std::nullopt;
  return too_many("too many requests come from your address", wait_s);
}

Refusal Admission::refuse_token(const ClientAddress& client, Moment now, std::string_view why) {
  const std::int64_t wait_s = failures_.take(client.key, now.steady);
  if (wait_s != 0) return too_many("too many wrong tokens came from your address", wait_s);
  return unauthorized(std::string(why), "invalid_token");
}

std::optional<Refusal> Admission::admit(const Headers& headers, Access access, const ClientAddress& client, Moment now,
                                        Principal& who) {
  if (!config_.tokens_required || access == Access::kOpen) {
    who = config_.tokens_required ? Principal{"anonymous", Scope::kRead, {}} : Principal{};
    return count_by_address(client, now);
  }
  const auto field = headers.get("Authorization");
  if (!field) {
    if (auto refusal = count_by_address(client, now)) return refusal;
    return unauthorized("give a token in the header, Authorization: Bearer TOKEN", "");
  }
  if (headers.count("Authorization") > 1) {
    // Counted as a wrong token: else whoever guesses would send each guess twice.
    Refusal refusal = refuse_token(client, now, {});
    if (refusal.status == 429) return refusal;
    return Refusal{400, "bad-request", "The request is malformed", "the header holds more than one Authorization"};
  }
  const std::size_t space = field->find(' ');
  if (space == std::string_view::npos || !equals_without_case(field->substr(0, space), "Bearer")) {
    return refuse_token(client, now, "the only scheme is Bearer");
  }
  const TokenTable::Found found = tokens_.find(trim_blanks(field->substr(space)), now.unix_ms);
  if (found.verdict == TokenTable::Verdict::kExpired) return refuse_token(client, now, "the token has expired");
  if (found.verdict == TokenTable::Verdict::kUnknown) return refuse_token(client, now, "the token is not known here");
  who = found.principal;
  if (const std::int64_t wait_s = requests_.take("token " + who.token_id, now.steady); wait_s != 0) {
    return too_many("this token has made too many requests", wait_s);
  }
  const Scope needed = needed_scope(access);
  if (who.scope < needed) return insufficient(who.scope, needed);
  return std::nullopt;
}

}  // namespace colony::server::http
