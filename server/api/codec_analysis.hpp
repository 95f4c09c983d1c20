// codec_analysis: analyses and comparisons as JSON, and what a comparison is asked with.
// Errors:  kInvalid with every wrong field at once, each with its JSON Pointer.
// Threads: pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "engine/base/result.hpp"
#include "server/api/compare.hpp"
#include "server/api/json.hpp"
#include "server/store/analyses.hpp"

namespace colony::server::api {

/// What POST /v1/comparisons takes.
struct ComparisonSpec {
  std::string job_id, analysis_id, name;
  std::optional<double> at_h;
  MatchRequest match;
};
Result<ComparisonSpec> decode_comparison_spec(const Json& body);

/// As stored with a comparison, and back; what an older program stored has its matching, by area. CHECKs.
Json encode_match_request(const MatchRequest& match);
MatchRequest decode_match_request(const std::string& options_json);

/// The member `result` is left out of lists. `base_path`: what the links begin with.
Json encode_analysis(const AnalysisRow& row, bool with_result, std::string_view base_path);
/// {items, next}: each step that can be fetched, what it shows and where; none without a result.
Json encode_steps(const AnalysisRow& row, std::string_view base_path);

/// Schemas by component name.
Json analysis_components();

}  // namespace colony::server::api
