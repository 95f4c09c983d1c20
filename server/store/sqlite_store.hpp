// sqlite_store: the Store over SQLite. Not for use outside this folder; see store.hpp for the promises.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/store/connection.hpp"
#include "server/store/data_dir.hpp"
#include "server/store/reader_pool.hpp"
#include "server/store/sqlite_analyses.hpp"
#include "server/store/sqlite_tokens.hpp"
#include "server/store/store.hpp"
#include "server/store/writer.hpp"

namespace colony::server {

class SqliteStore final : public Store {
 public:
  SqliteStore(const StoreConfig& config, std::unique_ptr<DataDir> dir, std::unique_ptr<Connection> write_connection);
  ~SqliteStore() override;

  Result<Submitted> create_job(const NewJob& job, std::size_t queued_max) override;
  Result<std::optional<JobRow>> find_submitted(const NewJob& job) override;
  Result<Submitted> fork_job(const NewJob& job, std::int64_t source_key, const ForkTail& tail, std::size_t queued_max,
                             const std::atomic<bool>* stop) override;
  Result<JobRow> find_job(const std::string& id) override;
  Result<JobRow> find_job(std::int64_t job_key) override;
  Result<JobPage> list_jobs(const JobFilter& filter, std::size_t limit, const std::string& cursor) override;
  Result<std::vector<std::uint64_t>> count_jobs() override;
  Result<std::optional<JobRow>> take_queued_job() override;
  Result<JobRow> set_state(std::int64_t job_key, const std::vector<JobState>& from, JobState to,
                           const std::string& reason, const std::string& detail) override;
  Result<JobRow> finish_job(const EventBatch& last, JobState state, const std::string& reason,
                            const std::string& detail) override;
  Result<Commanded> command_job(std::int64_t job_key, JobCommand command, const std::string& actor,
                                const RevisionCondition& condition) override;
  Result<TextUpdated> update_job_text(std::int64_t job_key, const JobTextChange& change,
                                      const RevisionCondition& condition, const std::string& actor) override;
  Result<Deleted> delete_job(std::int64_t job_key, const RevisionCondition& condition) override;
  Result<std::vector<JobRow>> expire_jobs(const RetentionLimits& limits, std::int64_t now_ms) override;
  Result<std::vector<JobRow>> running_jobs() override;

  void append_events(EventBatch batch, std::function<void(const Status&)> committed) override;
  std::uint64_t commit_count() const override { return writer_->commit_count(); }
  Status flush() override;
  Result<std::vector<Event>> read_events(std::int64_t job_key, const EventFilter& filter, std::size_t limit) override;
  Result<std::optional<std::uint64_t>> page_end(std::int64_t job_key, const EventFilter& filter,
                                                std::size_t limit) override;
  Result<std::uint64_t> seq_at(std::int64_t job_key, double at_h) override;
  Result<std::vector<SeriesRow>> read_series(std::int64_t job_key) override;

  Status add_log(std::int64_t job_key, const std::string& level, const std::string& message) override;
  Result<std::vector<LogRow>> read_log(std::int64_t job_key, std::int64_t after_index, std::size_t limit) override;

  AnalysisStore& analyses() override { return *analyses_; }
  TokenStore& tokens() override { return *tokens_; }

  Status check_writable(std::uint64_t free_bytes_min) override;

 private:
  /// Runs a write that answers with a value: `body(connection) -> Result<T>`.
  template <class T, class Body>
  Result<T> write(Body body, bool in_order = false);

  const StoreConfig config_;  // fixed after construction
  const std::unique_ptr<DataDir> dir_;
  std::int64_t cursor_salt_ = 0;
  const std::unique_ptr<Connection> write_connection_;  // the writer thread's
  std::unique_ptr<ReaderPool> readers_;                 // synchronises itself
  std::unique_ptr<Writer> writer_;                      // synchronises itself
  std::unique_ptr<SqliteAnalyses> analyses_;            // over the two above
  std::unique_ptr<SqliteTokens> tokens_;                // likewise
};

template <class T, class Body>
Result<T> SqliteStore::write(Body body, bool in_order) {
  Result<T> answer = Error{ErrorCode::kInternal, "the write did not run"};
  const auto run = [&](Connection& connection) -> Status {
    answer = body(connection);
    if (!answer) return answer.error();
    return Ok{};
  };
  const Status status = in_order ? writer_->request_in_order(run) : writer_->request(run);
  if (!status) return status.error();  // also when the commit failed after the body succeeded
  return answer;
}

}  // namespace colony::server
