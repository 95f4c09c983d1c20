// records: what the store keeps, as plain values. Names are those of the HTTP interface and of the tables (server/DESIGN.md).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/digest.hpp"

namespace colony::server {

/// queued -> running | paused | cancelled | failed; running -> paused | succeeded | failed | cancelled; paused -> queued | cancelled.
enum class JobState { kQueued, kRunning, kPaused, kSucceeded, kFailed, kCancelled };
std::string_view name_of(JobState state);
std::optional<JobState> job_state_from(std::string_view name);
bool is_terminal(JobState state);
inline constexpr int kJobStateCount = 6;
/// The table above: true if a job may go from `from` to `to` (never to itself).
bool may_follow(JobState from, JobState to);

/// What a person asks of a job. kResumeStorage is the service's own: it resumes only what stopped for reason "storage".
enum class JobCommand { kCancel, kPause, kResume, kResumeStorage };

/// Kinds of jobs: what grows, and what verifies the history of another.
inline constexpr std::string_view kColonyKind = "colony";
inline constexpr std::string_view kVerifyKind = "verify";

/// What a client submitted, after validation, in the form that is stored. `spec_json` is the complete normalised job spec.
struct NewJob {
  std::string kind = "colony";              // or "verify"
  std::string name;
  std::map<std::string, std::string> labels;
  std::string spec_json;
  std::optional<double> until_time_h;      // for the progress fraction
  std::optional<std::uint64_t> until_cells;
  std::string submitted_by = "local";
  std::string idempotency_key;             // empty: none
  std::string origin_json;                 // of a fork: where its first rows come from (JSON); empty: none
  std::string body_hash;                   // of the request body as received; compared when the key is used again
};

struct JobRow {
  std::int64_t job_key = 0;                // the integer of the tables; never shown
  std::string id;                          // UUIDv7, lower case
  std::string kind = "colony";
  std::string name;
  std::map<std::string, std::string> labels;
  JobState state = JobState::kQueued;
  std::string reason;                      // why paused ("user", "storage") or how it ended; empty otherwise
  std::string detail;                      // for people: the message of a failure; empty otherwise
  std::string command;                     // "cancel" or "pause": a durable wish that the runner has not carried out yet
  std::string submitted_by;
  std::string created_at, started_at, finished_at;   // RFC 3339 UTC with milliseconds; empty: not yet
  std::uint64_t revision = 1;              // grows with state, name, labels
  std::uint64_t last_seq = 0;
  Digest digest;
  std::string engine_version;
  std::string spec_json;
  std::string origin_json;                 // of a fork {job_id, at_seq, spec, origin}; empty: none
  std::string result_json;                 // of a job of kind "verify" that ended; empty: none
  std::optional<double> until_time_h;
  std::optional<std::uint64_t> until_cells;
  // As of last_seq, stored with the events:
  double time_h = 0.0;
  std::uint64_t cell_count = 0, active_count = 0, passive_count = 0, senescent_count = 0;
};

/// Which revision a job must have for a write to be done. It is looked at in the transaction that writes, so nothing comes in between.
struct RevisionCondition {
  std::optional<std::vector<std::uint64_t>> one_of;   // without: any; empty: none will do
  std::vector<std::uint64_t> none_of;
  bool holds(std::uint64_t revision) const;
};

/// What a client wants of a job's name and labels. What is not named stays as it is.
struct JobTextChange {
  std::optional<std::string> name;
  bool drops_labels = false;               // all there are, before `labels` is looked at
  std::map<std::string, std::optional<std::string>> labels;   // without a value: this label goes
  std::size_t labels_max = 32;             // that the job may have afterwards
};

/// One line of a job's log.
struct LogRow {
  std::int64_t index = 0;                  // 1, 2, 3, ... within the job
  std::string at;                          // RFC 3339 UTC
  std::string level;                       // "info", "warning", "error"
  std::string message;
  std::string actor = {};                       // who asked for it (name of a token, or "local"); empty: the service itself
};

}  // namespace colony::server
