// analyses: pictures that people sent, what was measured on them, and comparisons of such a measurement with a colony.
// Promise: as the store's: a call that returned success is on disk. Step images and figures are never stored: they are functions of the
//          image, the options and the program.
// Kinds:   `analysis` has an image; `comparison` has none, but names a job and an analysis (either may be deleted later: its result stays).
// States:  queued -> running -> succeeded | failed; a running one is put back when the server ends.
// Errors:  kNotFound, kLimit, kBusy, kStorage as named at each call; the data is then as before.
// Threads: every function from any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/result.hpp"

namespace colony::server {

enum class AnalysisKind { kAnalysis, kComparison };
std::string_view name_of(AnalysisKind kind);

enum class AnalysisState { kQueued, kRunning, kSucceeded, kFailed };
std::string_view name_of(AnalysisState state);

struct NewAnalysis {
  AnalysisKind kind = AnalysisKind::kAnalysis;
  std::string name;
  std::string options_json;  // complete: every option that counts
  std::string media_type;    // of the image; comparison: empty
  std::string image;         // as received; comparison: empty
  std::string job_id;        // of a comparison; analysis: empty
  std::string analysis_id;   // likewise
  std::string result_json;   // empty: to be made in the background
};

struct AnalysisRow {
  std::int64_t analysis_key = 0;
  std::string id;  // UUIDv7
  AnalysisKind kind = AnalysisKind::kAnalysis;
  std::string name;
  AnalysisState state = AnalysisState::kQueued;
  std::string failure_code;  // of the problem table ("malformed", ...); empty unless failed
  std::string detail;        // for people: why it failed
  std::string created_at, finished_at;
  std::string options_json;
  std::string media_type;
  std::uint64_t image_bytes = 0;
  std::string job_id, analysis_id;
  bool has_source = true;  // of a comparison: its analysis is still there
  std::string result_json;  // empty: none (yet); never in a list
  int try_count = 0;        // how often a worker took it
};

struct AnalysisPage {
  std::vector<AnalysisRow> items;  // newest first
  std::optional<std::string> next;
};

struct AnalysisLimits {
  std::uint64_t stored_image_bytes_max = 0;  // of all images together; beyond: kLimit
  std::size_t queued_max = 0;                // not yet done; beyond: kBusy
};

/// Taken so often without an end (the process died each time), it is given up.
inline constexpr int kAnalysisTriesMax = 3;

class AnalysisStore {
 public:
  virtual ~AnalysisStore() = default;
  virtual Result<AnalysisRow> create(const NewAnalysis& analysis, const AnalysisLimits& limits) = 0;
  virtual Result<AnalysisRow> find(AnalysisKind kind, const std::string& id) = 0;
  virtual Result<AnalysisPage> list(AnalysisKind kind, std::size_t limit, const std::string& cursor) = 0;
  /// The bytes as received.
  virtual Result<std::string> image(const std::string& id) = 0;
  /// In any state; what a worker finds out about it afterwards is dropped (its finish() is kNotFound).
  virtual Status remove(AnalysisKind kind, const std::string& id) = 0;

  // --- for the worker ---
  /// Oldest queued one -> running; nullopt if none is queued.
  virtual Result<std::optional<AnalysisRow>> take_queued() = 0;
  virtual Status succeed(std::int64_t analysis_key, const std::string& result_json) = 0;
  virtual Status fail(std::int64_t analysis_key, const std::string& failure_code, const std::string& detail) = 0;
  /// A running one -> queued, as if it had not been taken.
  virtual Status put_back(std::int64_t analysis_key) = 0;
  /// After a crash: running ones -> queued, those that were tried kAnalysisTriesMax times -> failed.
  virtual Status recover() = 0;
};

}  // namespace colony::server
