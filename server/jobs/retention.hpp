// retention: lets ended jobs go that are too old, or too much together; oldest end first.
// Promise: live jobs, jobs with the label keep=true and jobs that a verify reads stay. Each job that goes is logged.
// Threads: run() from one thread at a time.
#pragma once

#include <cstddef>
#include <functional>

#include "server/jobs/service.hpp"

namespace colony::server {

/// One round: marks what may go, tells `gone` of each. How many it were; an error of the store is left for the next round.
std::size_t expire_jobs(Store& store, const JobsConfig& config, const std::function<void(const JobRow&)>& gone);

}  // namespace colony::server
