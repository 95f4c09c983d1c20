#include "server/api/measure.hpp"

#include <cmath>
#include <utility>

#include "engine/analysis/controls.hpp"
#include "engine/analysis/packing.hpp"
#include "engine/base/maths.hpp"
#include "engine/picture/top_view.hpp"

namespace colony::server::api {

Result<LabelledColony> label_colony(const Colony& colony, const PictureSpec& spec, const Effort& effort) {
  const Result<Frame> frame = frame_of(colony, spec);
  if (!frame) return frame.error();
  TopView view = top_view(colony, *frame, {0, frame->height_px}, effort);
  LabelledColony out;
  out.labels.width_px = frame->width_px;
  out.labels.height_px = frame->height_px;
  out.labels.um_per_px = frame->um_per_px;
  out.labels.values = std::move(view.owner);
  out.left_um = frame->left_um;
  out.top_um = frame->top_um;
  view = {};  // its heights are not needed beside the control
  Result<LabelImage> smooth = noise_free_control(colony, frame->width_px, frame->height_px, frame->um_per_px,
                                                 frame->left_um, frame->top_um, effort.stop);
  if (!smooth) return smooth.error();
  out.without_noise = std::move(*smooth);
  throw_if_stopped(effort.stop);
  return out;
}

namespace {

/// What each cell would cover alone, from above: its smooth body's shadow, or its nucleus.
std::vector<LabelArea> whole_areas(const Colony& colony, double um_per_px, ObjectKind objects) {
  std::vector<LabelArea> areas;
  for (const Cell& cell : colony.cells()) {
    const Vec3 form = colony.body(cell.id).footprint_form();
    const double area_um2 = objects == ObjectKind::kNuclei ? maths::kPi * cell.nucleus_radius_um * cell.nucleus_radius_um
                                                           : maths::kPi / std::sqrt(form.x() * form.z() - form.y() * form.y());
    areas.push_back({cell.id.value, static_cast<std::uint64_t>(area_um2 / (um_per_px * um_per_px))});
  }
  return areas;
}

}  // namespace

Result<LabelReport> measure_colony(const ColonyAt& at, const LabelledColony& image, const Effort& effort, ObjectKind objects) {
  LabelInput input;
  input.labels = &image.labels;
  input.objects = objects;
  if (objects == ObjectKind::kCells) input.without_noise = &image.without_noise;
  input.whole = whole_areas(*at.colony, *image.labels.um_per_px, objects);
  input.siblings = sibling_pairs(*at.colony);
  input.active = active_labels(*at.colony);
  input.control_seed = at.spec->seed;
  input.boxes.threads = effort.threads;
  return analyse_labels(input, effort.stop);
}

}  // namespace colony::server::api
