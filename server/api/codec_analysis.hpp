// codec_analysis: analyses and comparisons as JSON, and what a comparison is asked with.
// Errors:  kInvalid with every wrong field at once, each with its JSON Pointer.
// Threads: pure.
#pragma once

#include <optional>
#include <string>

#include "engine/base/result.hpp"
#include "server/api/json.hpp"
#include "server/store/analyses.hpp"

namespace colony::server::api {

/// What POST /v1/comparisons takes.
struct ComparisonSpec {
  std::string job_id, analysis_id, name;
  std::optional<double> at_h;
};
Result<ComparisonSpec> decode_comparison_spec(const Json& body);

/// The member `result` is left out of lists.
Json encode_analysis(const AnalysisRow& row, bool with_result);
/// {items, next}: each step that can be fetched, what it shows and where; none without a result.
Json encode_steps(const AnalysisRow& row);

/// Schemas by component name.
Json analysis_components();

}  // namespace colony::server::api
