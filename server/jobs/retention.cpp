#include "server/jobs/retention.hpp"

#include <chrono>
#include <string>

namespace colony::server {
namespace {

std::int64_t system_now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

std::size_t expire_jobs(Store& store, const JobsConfig& config, const std::function<void(const JobRow&)>& gone) {
  std::size_t count = 0;
  for (;;) {
    const auto expired = store.expire_jobs(config.retention, config.now_ms ? config.now_ms() : system_now_ms());
    if (!expired || expired->empty()) return count;
    for (const JobRow& job : *expired) {
      if (config.log) {
        config.log("retention: job " + job.id + " is removed: " + std::string(name_of(job.state)) + " at " + job.finished_at + ", " +
                   std::to_string(job.last_seq) + " events");
      }
      gone(job);
    }
    count += expired->size();
  }
}

}  // namespace colony::server
