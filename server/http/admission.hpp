// admission: who asks, whether they may, and whether too often. After the gate (only well-formed requests are looked at) and
// before the body (a stranger cannot make the server hold one).
// Order:   an open endpoint asks for no token; else the token (401), then its rate (429), then its scope (403).
// Promises that a valid token is never refused for what others did from the same address: wrong tokens are counted by
//          address and answered 429 beyond the limit, right ones are let pass. To lock a lab out would be easier than to
//          guess 256 bits.
// Threads: every function from any thread; nothing waits.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/buckets.hpp"
#include "server/http/gate.hpp"
#include "server/http/router.hpp"
#include "server/http/tokens.hpp"

namespace colony::server::http {

struct AdmissionConfig {
  bool tokens_required = false;          // else everybody who gets here is "local", an admin
  bool trusts_forwarded_for = false;     // the peer is a proxy that appends the client's address
  bool limits_loopback = false;          // count requests without a token from this machine, too
  Rate requests{200.0, 1000.0};          // of a token; of an address where there is none
  double failed_tokens_per_min = 30.0;   // of an address; 0: no limit
};

/// What an address counts as: IPv4 whole (also written as IPv6), IPv6 its first 64 bits, which is what one customer gets.
struct ClientAddress {
  std::string text;           // for the log
  std::string key;            // for counting
  bool is_loopback = false;
};
/// nullopt: not an IP address.
std::optional<ClientAddress> client_address(std::string_view ip);
/// Of the last entry of X-Forwarded-For: the one that the proxy wrote and no client can forge. Absent or no address: the peer.
ClientAddress forwarded_address(const Headers& headers, const ClientAddress& peer);

/// 401 for a token that was good when the request came.
Refusal token_has_ended();
/// The problem document, with the fields that go with it.
Response answer_of(const Refusal& refusal, std::string_view request_id);

class Admission {
 public:
  struct Moment {
    Buckets::Clock::time_point steady;
    std::int64_t unix_ms = 0;
    static Moment now() { return {Buckets::Clock::now(), unix_time_ms()}; }
  };

  /// `tokens` outlives it.
  Admission(AdmissionConfig config, const TokenTable& tokens);
  /// Sets `who` if the request may go on.
  std::optional<Refusal> admit(const Headers& headers, Access access, const ClientAddress& client, Moment now,
                               Principal& who);
  const AdmissionConfig& config() const { return config_; }
  const TokenTable& tokens() const { return tokens_; }

 private:
  std::optional<Refusal> count_by_address(const ClientAddress& client, Moment now);
  Refusal refuse_token(const ClientAddress& client, Moment now, std::string_view why);

  const AdmissionConfig config_;  // fixed after construction
  const TokenTable& tokens_;      // synchronises itself, as the two below
  Buckets requests_;
  Buckets failures_;
};

}  // namespace colony::server::http
