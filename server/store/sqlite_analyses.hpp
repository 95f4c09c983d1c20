// sqlite_analyses: the AnalysisStore over the writer and the readers of the one database. Not for use outside this folder.
#pragma once

#include <string>

#include "server/store/analyses.hpp"
#include "server/store/reader_pool.hpp"
#include "server/store/writer.hpp"

namespace colony::server {

class SqliteAnalyses final : public AnalysisStore {
 public:
  /// All three outlive it. `cursor_salt` as of the job cursors.
  SqliteAnalyses(Writer& writer, ReaderPool& readers, std::int64_t cursor_salt)
      : writer_(writer), readers_(readers), cursor_salt_(cursor_salt) {}

  Result<AnalysisRow> create(const NewAnalysis& analysis, const AnalysisLimits& limits) override;
  Result<AnalysisRow> find(AnalysisKind kind, const std::string& id) override;
  Result<AnalysisPage> list(AnalysisKind kind, std::size_t limit, const std::string& cursor) override;
  Result<std::string> image(const std::string& id) override;
  Status remove(AnalysisKind kind, const std::string& id) override;
  Result<std::optional<AnalysisRow>> take_queued() override;
  Status succeed(std::int64_t analysis_key, const std::string& result_json) override;
  Status fail(std::int64_t analysis_key, const std::string& failure_code, const std::string& detail) override;
  Status put_back(std::int64_t analysis_key) override;
  Status recover() override;

 private:
  Status finish(std::int64_t analysis_key, AnalysisState state, const std::string& failure_code,
                const std::string& detail, const std::string& result_json);

  Writer& writer_;       // synchronises itself
  ReaderPool& readers_;  // synchronises itself
  const std::int64_t cursor_salt_;
};

}  // namespace colony::server
