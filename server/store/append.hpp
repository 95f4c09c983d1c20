// append: a batch of events into an open write transaction. Not for use outside this folder.
#pragma once

#include "server/store/connection.hpp"
#include "server/store/store.hpp"

namespace colony::server {

/// Writes the rows and brings `job` (last_seq, time, digest, counts) up to date; the caller writes the job row.
/// kConflict if the batch does not follow job.last_seq; the caller's savepoint then undoes what was written.
Status append_batch(Connection& connection, const EventBatch& batch, JobRow& job);

}  // namespace colony::server
