// runner: grows one colony from its stored events to its end, or until it is asked to stop, which it does in the middle of a step too.
// Promise: what was stored before is folded and its digest checked before anything is decided; events reach the store in order;
//          the terminal state and `finished` are one transaction.
// Errors:  a bug or a wrong spec fails the job (reason "internal" with the replay hint), never the server.
// Threads: one job, one thread; commits are reported from the writer's thread.
#pragma once

#include <memory>

#include "server/jobs/live.hpp"
#include "server/jobs/service.hpp"

namespace colony::server {

struct RunnerEnvironment {
  Store& store;
  const JobsConfig& config;
  const SpecDecoder& decode;
  const VerifyCodec& verify;
  Hub& hub;
};

enum class RunEnd {
  kDone,     // ended or paused: the row says how
  kDrained,  // still `running` in the store, to go on later
  kStorage,  // the store refused; the same, to go on when it is writable again
};

/// `job` is in state running. Everything it stored is committed when this returns.
RunEnd run_job(const RunnerEnvironment& environment, const JobRow& job, const std::shared_ptr<LiveJob>& live);

}  // namespace colony::server
