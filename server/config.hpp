// config: how colonyd is told what to do: built-in values, then a TOML file, then the environment, then flags; the
// later wins. Promise: one table of keys drives all three. Unknown keys, wrong types and values out of range are errors
// that name where they stand; nothing is clamped. An address that is not loopback is refused without tokens and TLS (or a proxy
// that does it).
// Errors:  kInvalid; each field is "file.toml: jobs.queued_max", "COLONY_JOBS_QUEUED_MAX" or "--jobs.queued-max".
// Threads: pure, except that the file is read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/result.hpp"
#include "server/http/server.hpp"
#include "server/jobs/service.hpp"
#include "server/log.hpp"
#include "server/store/store.hpp"

namespace colony::server {

struct Config {
  http::ServerConfig http;
  StoreConfig store;
  JobsConfig jobs;
  std::uint64_t disk_free_bytes_min = 100'000'000;  // below: /readyz says not ready
  std::uint64_t stored_image_bytes_max = 4'000'000'000;
  std::size_t analyses_waiting_max = 100;
  LogFormat log_format = LogFormat::kText;
};

/// `colonyd token create`: what its own flags say; its checks are the interface's (api/handlers_tokens).
struct TokenRequest {
  std::string name, scope;
  double expires_h = 0.0;
};

/// A configuration, perhaps with a command, or a text to print before ending well (--help, --version).
struct Invocation {
  Config config;
  std::string print;
  std::optional<TokenRequest> token = std::nullopt;  // make one and end
};

using Environment = std::vector<std::pair<std::string, std::string>>;

/// `arguments` without the program's name. `cores`: what this process may use; jobs.concurrent_max and jobs.threads_per_job, where
/// not given, are such that their product is at most that. Given values stand, also where they are too many.
Result<Invocation> configure(const std::vector<std::string>& arguments, const Environment& environment,
                             std::string_view version, std::uint64_t cores);

}  // namespace colony::server
