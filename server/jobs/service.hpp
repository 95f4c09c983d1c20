// service: jobs as the API sees them: submit, look, command, and read the past. Owns the runner threads and the live progress hub.
// Promise: a command is durable before it returns; a seq is announced only after its commit; terminal states absorb.
// Threads: every function from any thread. Errors: Result, never exceptions.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/analysis/series.hpp"
#include "engine/base/result.hpp"
#include "engine/model/colony.hpp"
#include "engine/sim/simulator.hpp"
#include "server/store/store.hpp"

namespace colony::server {

struct JobsConfig {
  std::size_t concurrent_max = 1;          // colonies growing at a time,
  int threads_per_job = 1;                 // and the threads on which each decides; no history depends on it
  std::size_t queued_max = 1000;
  std::uint64_t cells_max = 1'000'000;     // per job; beyond: failed, reason "limit"
  std::uint64_t events_max = 50'000'000;   // per job; beyond: failed, reason "limit"
  std::size_t cached_colonies_max = 16;    // folded colonies kept for pictures and tables,
  std::uint64_t cached_cells_max = 2'000'000;  // and the cells of them all; a larger colony is served but not kept
  std::int64_t command_wait_ms = 1'000;    // how long cancel and pause wait for the runner; then the view as it is
  std::int64_t storage_retry_ms = 1'000;   // first pause after a storage error; doubles up to 64 times this
  std::uint64_t events_per_s_max = 0;      // of each job: it waits rather than be faster. 0: as fast as it decides
  std::uint64_t free_bytes_min = 16'777'216;   // a job stopped by the disk goes on only with this much free
  RetentionLimits retention;               // none by default
  std::int64_t retention_every_ms = 60'000;
  std::function<std::int64_t()> now_ms;    // since 1970, for retention; empty: the system's clock
  std::function<void(const std::string&)> log;   // what operators should see; empty: nobody does. From any thread
};

/// Where a job is now; for a live job fresher than its row (but never ahead of the last commit in `last_seq`).
struct Progress {
  std::uint64_t last_seq = 0;
  double time_h = 0.0;
  std::uint64_t cells = 0, active = 0, passive = 0, senescent = 0;
  std::optional<double> fraction;          // of the nearer bound, 0..1
  std::optional<double> cells_per_s;       // wall rate while running
  std::optional<double> eta_s;
};

struct JobView {
  JobRow job;
  Progress progress;
};

/// A colony at a past or present moment, shared and immutable.
struct ColonyAt {
  std::shared_ptr<const Colony> colony;
  std::shared_ptr<const RunSpec> spec;
  double time_h = 0.0;                     // asked for, or of the last event
  Digest digest;
};

/// What became of a job. kCommit: more events are stored, nothing else; kChange: perhaps its state, name or labels (or it is new);
/// kRemoved: it is gone, and `id` is the only thing left of it.
struct JobNews {
  enum class Kind { kCommit, kChange, kRemoved };
  std::int64_t job_key = 0;
  Kind kind = Kind::kCommit;
  std::string id = {};                     // of kRemoved
};

/// A moment of a job's history, found without folding it.
struct Moment {
  JobRow job;
  std::uint64_t seq = 0;                   // the last event of it; 0: before the first
  Digest digest;                           // after that event
};

/// Turns a stored spec into what the simulator runs (main.cpp wires the codec in, so that jobs/ needs no JSON).
using SpecDecoder = std::function<Result<RunSpec>(const std::string& spec_json)>;

/// What a job of kind "verify" is to do.
struct VerifyTask {
  std::string job_id;
  std::uint64_t to_seq = 0;                // the last event compared; 0: there is none yet
};
/// A part of a history that was grown with one spec: from where the part before ends, up to last_seq or to where a later part begins.
struct Stretch {
  std::uint64_t last_seq = 0;
  RunSpec spec;
};
struct VerifyOutcome {
  bool identical = false;
  std::uint64_t events = 0;                // found identical, from the first on
  std::optional<std::uint64_t> first_differing_seq;
  std::optional<Digest> expected_digest;   // of the event made again; none: no event should be there
  std::optional<Digest> actual_digest;     // of the event as stored; none: it is missing
  std::string message;                     // what differs, for people; empty if identical
};
/// The JSON of verify jobs, and of the origins of forks; from api/, as SpecDecoder.
struct VerifyCodec {
  std::function<Result<VerifyTask>(const std::string& spec_json)> task;
  /// In the order of seq; the last has no bound of its own.
  std::function<Result<std::vector<Stretch>>(const JobRow& job)> stretches;
  std::function<std::string(const VerifyOutcome& outcome)> result;
};

class JobService {
 public:
  /// Without a VerifyCodec jobs of kind "verify" fail.
  static std::unique_ptr<JobService> create(Store& store, JobsConfig config, SpecDecoder decode, VerifyCodec verify = {});
  virtual ~JobService() = default;         // as drain()

  /// Recovers jobs that were running when the process died, then starts the runners.
  virtual Status start() = 0;
  /// Stops taking jobs, stops runners at once (jobs stay `running` in the store and go on at the next start), ends questions about
  /// the past (kUnavailable, unless the answer is kept), flushes.
  virtual void drain() = 0;

  struct Submitted { JobView view; bool created = true; };
  virtual Result<Submitted> submit(const NewJob& job) = 0;
  /// The job that `job`'s idempotency key made before, if any; kKeyReused if with another body.
  virtual Result<std::optional<JobView>> submitted_before(const NewJob& job) = 0;
  /// A place in a history where another may leave it.
  struct ForkPoint {
    JobRow origin;
    std::uint64_t at_seq = 0;              // never that of `finished`
    ColonyAt at;
  };
  /// Of a colony, by time (all events up to at_h; beyond the end: the last state) or by seq: exactly one is given. Errors name "/at_h"
  /// or "/at_seq": kNotReached where a live job has not come yet, kInvalid beyond the end. Long for a long history, as colony_at.
  virtual Result<ForkPoint> fork_point(const std::string& id, std::optional<double> at_h, std::optional<std::uint64_t> at_seq) = 0;
  /// A new job that goes on from there. Whether job.spec_json suits the colony is the caller's to know. Returns when all is copied.
  virtual Result<Submitted> fork(const NewJob& job, const ForkPoint& point) = 0;
  virtual Result<JobView> show(const std::string& id) = 0;
  /// As Store::commit_count. But for rates, which are of the moment, and a job that the store has stopped and could not say so, a view is
  /// as it was while this number stands.
  virtual std::uint64_t commit_count() const = 0;
  virtual Result<JobView> show(std::int64_t job_key) = 0;
  /// Of a job that has a runner, from memory; nullopt for all others.
  virtual std::optional<Progress> live_progress(std::int64_t job_key) = 0;
  struct Page { std::vector<JobView> items; std::optional<std::string> next; };
  virtual Result<Page> list(const JobFilter& filter, std::size_t limit, const std::string& cursor) = 0;
  virtual Result<std::vector<std::uint64_t>> counts() = 0;

  /// `changed` false: the job was already in the state this leads to. Another terminal state: kConflict ("job-terminal").
  /// `is_current` false: `condition` did not hold (for the store, as it wrote), and nothing was done; so in all that follows.
  struct Commanded { JobView view; bool changed = true; bool is_current = true; };
  /// `actor`: who asks; it goes into the job's log with what was done.
  virtual Result<Commanded> cancel(const std::string& id, const std::string& actor, const RevisionCondition& condition = {}) = 0;
  virtual Result<Commanded> pause(const std::string& id, const std::string& actor, const RevisionCondition& condition = {}) = 0;
  virtual Result<Commanded> resume(const std::string& id, const std::string& actor, const RevisionCondition& condition = {}) = 0;
  /// As Store::delete_job.
  struct Removed { JobRow job; bool is_current = true; };
  virtual Result<Removed> remove(const std::string& id, const RevisionCondition& condition = {}) = 0;
  /// As Store::update_job_text.
  struct Edited { JobView view; bool changed = true; bool is_current = true; };
  virtual Result<Edited> edit(const std::string& id, const JobTextChange& change,
                              const RevisionCondition& condition, const std::string& actor) = 0;

  virtual Result<std::vector<Event>> events(const std::string& id, const EventFilter& filter, std::size_t limit) = 0;
  /// As Store::page_end.
  virtual Result<std::optional<std::uint64_t>> page_end(const std::string& id, const EventFilter& filter,
                                                        std::size_t limit) = 0;
  virtual Result<std::vector<LogRow>> log(const std::string& id, std::int64_t after_index, std::size_t limit) = 0;
  /// Events with time_h <= at_h (all stored ones if none). Beyond a live job's time: kNotReached, parameter "at_h".
  /// Long for a long history; kUnavailable when drain() comes meanwhile. series() likewise.
  virtual Result<ColonyAt> colony_at(const std::string& id, std::optional<double> at_h) = 0;
  /// The moment that colony_at() would fold to; the same errors, cheap.
  virtual Result<Moment> moment(const std::string& id, std::optional<double> at_h) = 0;
  /// `points` rows in equal steps from 0 to the end (values after the last event <= t).
  virtual Result<std::vector<SeriesRow>> series(const std::string& id, std::size_t points) = 0;

  /// Calls `wake` (any thread, may be spurious; it must not block, call the service or end a subscription) after every commit
  /// and every state change of the job, until the subscription is destroyed. Progress changes only with commits.
  class Subscription { public: virtual ~Subscription() = default; };
  virtual std::unique_ptr<Subscription> subscribe(std::int64_t job_key, std::function<void()> wake) = 0;
  /// Calls `hear` with all news of this job, or of every job if none is given; as subscribe() in all else.
  virtual std::unique_ptr<Subscription> follow(std::optional<std::int64_t> job_key,
                                               std::function<void(const JobNews&)> hear) = 0;

  virtual Store& store() = 0;
};

}  // namespace colony::server
