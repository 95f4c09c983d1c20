// store: the one SQLite database DATA/colony.db. One writer thread does every write and every checkpoint (group commit);
// readers use read-only connections, never checkpoint and hold no transaction across a wait.
// Promise: a call that returns success is on disk (synchronous=FULL). An event is visible to readers only when committed.
// Errors:  kStorage for the disk, kNotFound, kConflict, kKeyReused, kLimit as named at each call; the data is then as before.
// Threads: every function from any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/analysis/series.hpp"
#include "engine/base/result.hpp"
#include "engine/model/event.hpp"
#include "server/store/analyses.hpp"
#include "server/store/records.hpp"
#include "server/store/tokens.hpp"

namespace colony::server {

struct StoreConfig {
  std::string data_dir;
  std::size_t batch_rows_max = 1000;        // a write batch closes at this many rows,
  std::int64_t batch_wait_ms = 50;          // this age, or at once when a request waits
  std::size_t queued_events_max = 20'000;   // a full queue makes append_events wait
  std::uint64_t database_bytes_max = 0;     // of colony.db; beyond: kStorage. 0: as much as the disk holds; else at least 256 KiB
};

struct JobFilter {
  std::optional<JobState> state;
  std::optional<std::string> kind;
  std::optional<std::string> name;
  std::vector<std::pair<std::string, std::string>> labels;
};

struct JobPage {
  std::vector<JobRow> items;               // newest first
  std::optional<std::string> next;         // opaque cursor, authenticated by its own form: a made-up one is kInvalid "cursor"
};

struct EventFilter {
  std::uint64_t after = 0;                 // seq > after
  std::vector<EventKind> kinds;            // empty: all
  std::optional<std::uint32_t> cell_id;    // the subject, or one of the cells of the event
};

/// What the runner knows with a batch of events.
struct EventBatch {
  std::int64_t job_key = 0;
  std::vector<Event> events;               // dense, following last_seq
  std::vector<SeriesRow> series;           // hourly rows
  std::uint64_t cell_count = 0, active_count = 0, passive_count = 0, senescent_count = 0;   // after the last event
  std::string result_json;                 // with the `finished` event of a job of kind "verify"; else empty
};

/// Where a fork leaves its origin, and what its row says there.
struct ForkTail {
  std::uint64_t at_seq = 0;                // the last event copied; not `finished`
  double time_h = 0.0;
  Digest digest;
  std::uint64_t cell_count = 0, active_count = 0, passive_count = 0, senescent_count = 0;
};

/// Which ended jobs may go. 0: no bound. A label keep=true keeps a job, and so does a verify job that has not ended.
struct RetentionLimits {
  std::uint64_t keep_days = 0;             // since it ended
  std::uint64_t keep_bytes = 0;            // of the histories of all ended jobs; the oldest end goes first
};

class Store {
 public:
  /// Opens or creates DATA (0700) and its database, takes the lock file, migrates the schema by user_version.
  /// What it made is on disk when it returns, the folders too.
  /// Errors: kInvalid for a config that cannot be meant, kConflict when another process holds the lock, kStorage otherwise.
  static Result<std::unique_ptr<Store>> open(const StoreConfig& config);
  virtual ~Store() = default;

  // --- jobs; every write is durable when it returns ---
  struct Submitted { JobRow job; bool created = true; };
  /// A used key with the same body hash returns the same job (created = false); with another, kKeyReused.
  /// More than `queued_max` queued jobs: kBusy.
  virtual Result<Submitted> create_job(const NewJob& job, std::size_t queued_max) = 0;
  /// The job that `job`'s idempotency key made before, if it did; kKeyReused as above. Looks only.
  virtual Result<std::optional<JobRow>> find_submitted(const NewJob& job) = 0;
  /// As create_job, but the job begins with a copy of the rows of `source_key` up to tail.at_seq: events, placements, woken, hourly
  /// series, index by cell. Copied in pieces, so that other writes come between; nobody sees the job before all is there, and a crash
  /// leaves nothing. `stop` ends it (kUnavailable). kNotFound when the source goes meanwhile, kInternal when the copy does not fit the tail.
  virtual Result<Submitted> fork_job(const NewJob& job, std::int64_t source_key, const ForkTail& tail, std::size_t queued_max,
                                     const std::atomic<bool>* stop) = 0;
  virtual Result<JobRow> find_job(const std::string& id) = 0;
  virtual Result<JobRow> find_job(std::int64_t job_key) = 0;
  virtual Result<JobPage> list_jobs(const JobFilter& filter, std::size_t limit, const std::string& cursor) = 0;
  /// Count of jobs by state, in the order of JobState.
  virtual Result<std::vector<std::uint64_t>> count_jobs() = 0;
  /// Oldest queued job -> running, in one transaction; nullopt if none is queued.
  virtual Result<std::optional<JobRow>> take_queued_job() = 0;
  /// Moves a job from one of `from` to `to`; kConflict (and no change) if its state is none of them, if may_follow() forbids
  /// it, if `to` is terminal (that is finish_job's), or if a recorded cancel waits. Clears the wish it fulfils. Adds a log line.
  virtual Result<JobRow> set_state(std::int64_t job_key, const std::vector<JobState>& from, JobState to,
                                   const std::string& reason, const std::string& detail) = 0;
  /// The `finished` event, the terminal state and its reason in one transaction, after all events appended before.
  /// `last.events` ends with `finished`. kConflict if the job's state or last_seq does not fit.
  virtual Result<JobRow> finish_job(const EventBatch& last, JobState state, const std::string& reason,
                                    const std::string& detail) = 0;
  /// One transaction decides by the state found in it, so no runner can come in between.
  /// Cancel: queued and paused jobs end cancelled, with their `finished` event; of a running one the wish is recorded.
  /// Pause: queued becomes paused ("user"), so does paused ("storage"); of a running one the wish is recorded.
  /// Resume: paused becomes queued. Already there: changed = false. Another terminal state, or a wish that a recorded cancel
  /// forbids: kConflict. `pending`: the job runs on until its runner has carried out job.command; then ask again.
  /// Before all that: if `condition` does not hold, nothing changes and is_current is false.
  struct Commanded { JobRow job; bool changed = true; bool pending = false; bool is_current = true; };
  /// `actor`: who asked, for the log; empty: the service itself.
  virtual Result<Commanded> command_job(std::int64_t job_key, JobCommand command, const std::string& actor = {},
                                        const RevisionCondition& condition = {}) = 0;
  /// Name and labels, in any state. Decided in one transaction: if `condition` does not hold, nothing changes and is_current is false;
  /// what leaves all as it was changes nothing, not even the revision. More than labels_max labels: kInvalid "/labels". Adds a log line.
  struct TextUpdated { JobRow job; bool changed = true; bool is_current = true; };
  virtual Result<TextUpdated> update_job_text(std::int64_t job_key, const JobTextChange& change,
                                              const RevisionCondition& condition, const std::string& actor) = 0;
  /// Only terminal jobs (else kConflict); events, placements, series and log go with it. Before that is asked: if `condition` does not
  /// hold, nothing changes and is_current is false.
  struct Deleted { JobRow job; bool is_current = true; };
  virtual Result<Deleted> delete_job(std::int64_t job_key, const RevisionCondition& condition = {}) = 0;
  /// Marks as deleted what the limits let go at `now_ms` (since 1970): first by age, then, once nothing is being removed any more, by
  /// bytes. Returns the rows marked, at most 100 a call; their histories go as with delete_job.
  virtual Result<std::vector<JobRow>> expire_jobs(const RetentionLimits& limits, std::int64_t now_ms) = 0;
  /// Every job in state running (after a crash).
  virtual Result<std::vector<JobRow>> running_jobs() = 0;

  // --- events ---
  /// Queues a batch for the writer; waits while the queue is full. `committed` runs on the writer thread after the commit
  /// (or with the error: then nothing of this batch was stored); it must not call the store. Batches of a job commit in the
  /// order given; after a failed one the later ones fail too (kConflict), because seq stays dense. Only of running jobs.
  virtual void append_events(EventBatch batch, std::function<void(const Status&)> committed) = 0;
  /// Grows with every commit, before whoever waits for it or is told of it hears. While it stands, every reading is the same as one made
  /// after it was last asked for.
  virtual std::uint64_t commit_count() const = 0;
  /// Waits until everything queued before is committed.
  virtual Status flush() = 0;
  /// Up to `limit` events by ascending seq. Complete: placement and woken rows joined.
  virtual Result<std::vector<Event>> read_events(std::int64_t job_key, const EventFilter& filter, std::size_t limit) = 0;
  /// The seq of event number `limit` of those that read_events would give, if one more follows it; else nullopt. limit >= 1.
  virtual Result<std::optional<std::uint64_t>> page_end(std::int64_t job_key, const EventFilter& filter, std::size_t limit) = 0;
  /// The last seq whose event has time_h <= at_h; 0 if none.
  virtual Result<std::uint64_t> seq_at(std::int64_t job_key, double at_h) = 0;
  /// The hourly rows, ascending.
  virtual Result<std::vector<SeriesRow>> read_series(std::int64_t job_key) = 0;

  // --- log ---
  virtual Status add_log(std::int64_t job_key, const std::string& level, const std::string& message) = 0;
  virtual Result<std::vector<LogRow>> read_log(std::int64_t job_key, std::int64_t after_index, std::size_t limit) = 0;

  /// Pictures and what was measured on them; lives as long as the store.
  virtual AnalysisStore& analyses() = 0;
  /// Likewise.
  virtual TokenStore& tokens() = 0;

  /// ok if a write transaction would succeed now (for readyz): database writable and at least `free_bytes_min` free on the disk.
  virtual Status check_writable(std::uint64_t free_bytes_min) = 0;
};

}  // namespace colony::server
