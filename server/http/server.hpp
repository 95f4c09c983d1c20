// server: the listener, its sessions and the request gate (Boost.Beast inside; nothing of it is visible here).
// The gate refuses before any handler runs: bad framing (400), foreign Host or Origin (421/403), header (431), target (414),
// body (413) over the limit, header and body deadlines (408), too many connections (503 with Retry-After). Then admission:
// tokens (401), scopes (403), rates (429).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/result.hpp"
#include "server/http/router.hpp"
#include "server/http/tokens.hpp"

namespace colony::server::http {

struct ServerConfig {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;                   // 0: any free port
  std::vector<std::string> allowed_hosts = {"127.0.0.1", "localhost", "[::1]"};   // without port
  std::string base_path;                       // e.g. "/colony", taken off Request::path; empty: none
  std::size_t io_threads = 1;
  std::size_t worker_threads = 4;
  std::size_t connections_max = 2000;
  std::size_t connections_per_address_max = 200;   // not of loopback, unless
  bool limits_loopback = false;                // this says so; also for rates without a token
  std::size_t requests_waiting_max = 256;      // for a worker; beyond: 503 with Retry-After
  std::size_t header_bytes_max = 8 * 1024;
  std::size_t header_fields_max = 100;
  std::size_t target_bytes_max = 4096;
  std::size_t body_bytes_max = 1024 * 1024;
  std::string large_body_path;                 // without the base path: a POST there may have
  std::size_t large_body_bytes_max = 32 * 1024 * 1024;   // so many bytes; the empty path: no such place
  std::size_t large_bodies_max = 8;            // held at a time, from the first byte to the answer; beyond: 503
  std::vector<std::string> cors_origins;       // "https://lab.example": sites whose pages may ask
  bool tokens_required = false;
  std::string tls_certificate, tls_key;        // paths of PEM files; both or neither
  bool behind_proxy = false;                   // a proxy does TLS: an address that is not loopback may be bound without
  bool trusts_forwarded_for = false;           // the last entry of X-Forwarded-For is the client's address
  double requests_per_s = 200.0;               // of a token, or of an address without one; 0: no limit
  double requests_burst = 1000.0;
  double failed_tokens_per_min = 30.0;         // of an address; 0: no limit
  std::int64_t handshake_timeout_ms = 10'000;
  std::int64_t header_timeout_ms = 10'000;
  std::int64_t body_timeout_ms = 30'000;
  std::int64_t idle_timeout_ms = 60'000;
  std::int64_t write_timeout_ms = 30'000;      // without progress
  std::int64_t stream_keep_alive_ms = 15'000;  // of a stream that waits
};

/// In the log only: the peer had left, and the work was given up or never begun (what was done has its own status, and peer_left). The number by which other servers' logs know it.
inline constexpr int kPeerHasLeft = 499;

/// Called once per finished request, for the log (any thread).
struct AccessRecord {
  std::string method, path, request_id, remote;
  int status = 0;
  std::int64_t duration_us = 0;
  std::uint64_t body_bytes = 0;
  std::string actor, token_id;                 // empty: refused before it was known
  bool peer_left = false;                      // nobody took the answer
};

class Server {
 public:
  /// Binds and listens; `router` and `tokens` outlive it. Errors: kInvalid for a configuration that
  /// cannot serve: "server.listen" for what is no address, or not loopback without tokens and either TLS or a proxy that does it;
  /// "tls.certificate", "tls.key". kUnavailable for an address that cannot be bound now.
  static Result<std::unique_ptr<Server>> create(ServerConfig config, const Router& router, const TokenTable& tokens,
                                                std::function<void(const AccessRecord&)> log);
  virtual ~Server() = default;
  virtual std::uint16_t port() const = 0;
  /// Starts the threads; returns at once.
  virtual void run() = 0;
  /// No new connections; streams get their farewell; handlers under way are asked to give up (Request::gives_up), their answers are
  /// waited for up to `grace_ms`; then all is closed.
  virtual void stop(std::int64_t grace_ms) = 0;
};

}  // namespace colony::server::http
