// server: the listener, its sessions and the request gate (Boost.Beast inside; nothing of it is visible here).
// The gate refuses before any handler runs: bad framing (400), foreign Host or Origin (421/403), header (431), target (414),
// body (413) over the limit, header and body deadlines (408), too many connections (503 with Retry-After).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/result.hpp"
#include "server/http/router.hpp"

namespace colony::server::http {

struct ServerConfig {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;                   // 0: any free port
  std::vector<std::string> allowed_hosts = {"127.0.0.1", "localhost", "[::1]"};   // without port
  std::string base_path;                       // e.g. "/colony", taken off Request::path; empty: none
  std::size_t io_threads = 1;
  std::size_t worker_threads = 4;
  std::size_t connections_max = 2000;
  std::size_t requests_waiting_max = 256;      // for a worker; beyond: 503 with Retry-After
  std::size_t header_bytes_max = 8 * 1024;
  std::size_t header_fields_max = 100;
  std::size_t target_bytes_max = 4096;
  std::size_t body_bytes_max = 1024 * 1024;
  std::string large_body_path;                 // without the base path: a POST there may have
  std::size_t large_body_bytes_max = 32 * 1024 * 1024;   // so many bytes; the empty path: no such place
  std::size_t large_bodies_max = 8;            // held at a time, from the first byte to the answer; beyond: 503
  std::int64_t header_timeout_ms = 10'000;
  std::int64_t body_timeout_ms = 30'000;
  std::int64_t idle_timeout_ms = 60'000;
  std::int64_t write_timeout_ms = 30'000;      // without progress
  std::int64_t stream_keep_alive_ms = 15'000;  // of a stream that waits
};

/// Called once per finished request, for the log (any thread).
struct AccessRecord {
  std::string method, path, request_id, remote;
  int status = 0;
  std::int64_t duration_us = 0;
  std::uint64_t body_bytes = 0;
};

class Server {
 public:
  /// Binds and listens. Errors: kInvalid "server.listen" for an address that is not loopback or cannot be bound.
  static Result<std::unique_ptr<Server>> create(ServerConfig config, const Router& router,
                                                std::function<void(const AccessRecord&)> log);
  virtual ~Server() = default;
  virtual std::uint16_t port() const = 0;
  /// Starts the threads; returns at once.
  virtual void run() = 0;
  /// No new connections; streams get their farewell; answers under way are finished for up to `grace_ms`; then all is closed.
  virtual void stop(std::int64_t grace_ms) = 0;
};

}  // namespace colony::server::http
