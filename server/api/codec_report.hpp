// codec_report: measurements as JSON: the one form for colonies, photographs and comparisons, and its schema.
// Names:   fractal.walls.d0 {value, se, r2, range_px}; lengths in px, beside them in um where the image has a scale (else null).
// Threads: pure.
#pragma once

#include "engine/analysis/growth_phases.hpp"
#include "engine/analysis/image_analysis.hpp"
#include "engine/analysis/packing.hpp"
#include "engine/analysis/report.hpp"
#include "engine/analysis/threshold_sweep.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

Json encode_line(const MeasuredLine& line);
/// Lines, controls, shapes, neighbours, rings, and the words that say what follows.
Json encode_report(const LabelReport& report);
Json encode_packing(const Result<PackingStatistics>& packing);
Json encode_growth(const Result<GrowthPhases>& growth);
/// With where their discs lie.
Json encode_controls(const std::vector<ControlReport>& controls);
Json encode_findings(const LineFindings& findings);
Json encode_threshold_sweep(const ThresholdSweep& sweep);
/// What the file was, and where the scale came from.
Json encode_metadata(const ImageAnalysis& analysis);
Json encode_segmentation(const ImageAnalysis& analysis);

/// Schemas of the above, by component name.
Json report_components();

}  // namespace colony::server::api
