// measure: a colony as an image with labels, and everything that is measured on it.
// Method:  the visible cell of every pixel, seen from above, in the frame of a picture; the same without noise as its first control.
// Errors:  those of frame_of and analyse_labels, naming the query parameter. Throws Stopped.
// Threads: pure; as many threads as asked for, which cannot matter.
#pragma once

#include "engine/analysis/report.hpp"
#include "engine/picture/render.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

/// A measured picture needs pixels, but labels and controls are many bytes a pixel.
inline constexpr std::int64_t kMeasuredSideMax_px = 4096;
inline constexpr std::int64_t kMeasuredWidthDefault_px = 2048;

struct LabelledColony {
  LabelImage labels;
  LabelImage without_noise;
  double left_um = 0.0, top_um = 0.0;
};

/// Of `spec` only the scale and the side limit count.
Result<LabelledColony> label_colony(const Colony& colony, const PictureSpec& spec, const Effort& effort);

/// `objects`: what the labels are; nuclei have no control without noise, since they have none.
Result<LabelReport> measure_colony(const ColonyAt& at, const LabelledColony& image, const Effort& effort, ObjectKind objects = ObjectKind::kCells);

}  // namespace colony::server::api
