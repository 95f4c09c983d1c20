// finished_event: the last event of a history that ends from outside (cancel, limit, failure), made from the job's row alone.
#pragma once

#include "engine/model/event.hpp"
#include "server/store/records.hpp"

namespace colony::server {

/// seq follows job.last_seq; the time and the digest are those of the last event, because `finished` is outside the chain.
inline Event finished_event(const JobRow& job, FinishReason reason) {
  Event event;
  event.seq = job.last_seq + 1;
  event.time_h = job.time_h;
  event.body = Finished{reason, job.cell_count};
  event.digest = job.digest;
  return event;
}

}  // namespace colony::server
