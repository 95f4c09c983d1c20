// job_rows: rows of job, label, idempotency and job_log. The one place that knows their columns.
// Rows marked deleted do not exist for any function here.
// Errors:  DbError. Threads: as the connection.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "server/store/connection.hpp"
#include "server/store/store.hpp"

namespace colony::server {

std::optional<JobRow> find_job_row(Connection& connection, std::int64_t job_key);
std::optional<JobRow> find_job_row(Connection& connection, const std::string& id);
/// The oldest queued job.
std::optional<JobRow> oldest_queued_row(Connection& connection);
/// Newest first, with job_key < before.
/// Ends after the first row with which the specs exceed spec_bytes_max together.
std::vector<JobRow> list_job_rows(Connection& connection, const JobFilter& filter, std::int64_t before,
                                  std::size_t limit,
                                  std::size_t spec_bytes_max = std::numeric_limits<std::size_t>::max());
std::vector<std::uint64_t> count_job_rows(Connection& connection);
/// Reads the queued ones only, whatever the number of ended ones.
std::uint64_t count_queued_rows(Connection& connection);

/// A new queued job; returns its key.
std::int64_t insert_job_row(Connection& connection, const NewJob& job);
/// Writes back everything that can change: state, reason, detail, command, wall times, revision, last_seq, digest, counts, time.
void update_job_row(Connection& connection, const JobRow& job);

/// The job that the key of `job` made, if it was used with the same body; kKeyReused with another.
Result<std::optional<JobRow>> find_submitted_row(Connection& connection, const NewJob& job);
/// Name, labels and revision.
void update_job_text_row(Connection& connection, const JobRow& job);
void insert_used_key(Connection& connection, const NewJob& job, std::int64_t job_key);

void insert_log_row(Connection& connection, std::int64_t job_key, const std::string& level, const std::string& message,
                    const std::string& actor = {});
std::vector<LogRow> read_log_rows(Connection& connection, std::int64_t job_key, std::int64_t after_index,
                                  std::size_t limit);

/// What `deleted` says of a job that is being made, piece by piece: unseen as well, and swept if it is found at a start.
inline constexpr int kBeingMade = 2;
/// Turns what was being made when the process died into what is to be swept.
void mark_unmade_jobs_deleted(Connection& connection);
/// Takes the job out of every reader's sight, and frees its idempotency key and labels.
void mark_job_deleted(Connection& connection, std::int64_t job_key);
/// Removes up to about `seqs` events of one job marked deleted, at last the job itself; false if none is marked.
bool sweep_deleted(Connection& connection, std::int64_t seqs);

}  // namespace colony::server
