#include "engine/sim/decide.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"
#include "engine/growth/splitting.hpp"
#include "engine/growth/surroundings.hpp"
#include "engine/model/cycle.hpp"
#include "engine/random/sobol.hpp"
#include "engine/sim/decide_move.hpp"
#include "engine/space/overlap.hpp"

namespace colony {
namespace {

std::array<std::uint32_t, 3> seeds_for(Seed seed, const Cell& cell, Purpose purpose, std::uint32_t lane) {
  Stream stream(seed, cell.id, cell.ordinal, purpose, lane);
  return {stream.next_u32(), stream.next_u32(), stream.next_u32()};
}

// All cells whose boxes meet that of `id`, but itself, into workspace.near.
const std::vector<const Body*>& neighbours_of(const Colony& colony, CellId id, Workspace& workspace) {
  colony.cells_meeting(colony.body(id).box(), workspace.ids);
  workspace.near.clear();
  for (const CellId other : workspace.ids) {
    if (other != id) workspace.near.push_back(&colony.body(other));
  }
  return workspace.near;
}

bool is_isolated(const Colony& colony, Seed seed, const Cell& cell, Workspace& workspace) {
  const std::vector<const Body*>& neighbours = neighbours_of(colony, cell.id, workspace);
  if (neighbours.empty()) return true;
  const std::array<std::uint32_t, 3> seeds = seeds_for(seed, cell, Purpose::kIsolation, 0);
  // Most cells touch somebody, and the first points of the set show it.
  for (const std::uint32_t n : {kIsolationPrefix, kIsolationPoints}) {
    scrambled_sobol(n, seeds, workspace.points);
    for (const Body* other : neighbours) {
      if (touches(colony.body(cell.id), *other, workspace.points, workspace.overlap)) return false;
    }
  }
  return true;
}

// Uniform on the circle of horizontal directions; with several layers, on the sphere.
Vec3 random_direction(Seed seed, const Cell& cell, Layers layers) {
  Stream stream(seed, cell.id, cell.ordinal, Purpose::kSplitDirection);
  const auto [s, c] = maths::sincos(2.0 * maths::kPi * stream.uniform());
  if (layers == Layers::kMono) return {c, s, 0.0};
  const double z = 2.0 * stream.uniform() - 1.0;  // Archimedes
  const double across = std::sqrt(1.0 - z * z);
  return {across * c, across * s, z};
}

Vec3 splitting_direction(const Colony& colony, Layers layers, Seed seed, const Cell& cell, Workspace& workspace) {
  CHECK(cell.nearest_membrane_um.has_value());  // settling comes before every division: validate() sees to it
  if (is_isolated(colony, seed, cell, workspace)) return random_direction(seed, cell, layers);
  const Vec3 &c = cell.nucleus_um, &m = *cell.nearest_membrane_um;
  std::optional<Vec3> normal;
  if (layers == Layers::kMono) {
    normal = splitting_normal(c, m);
  } else {
    Stream stream(seed, cell.id, cell.ordinal, Purpose::kSplitPerpendicular);
    normal = splitting_normal(c, m, 2.0 * maths::kPi * stream.uniform());
  }
  return normal ? *normal : random_direction(seed, cell, layers);
}

Vec3 draw_noise_offset(const Params& params, Seed seed, const Cell& parent, std::uint32_t lane) {
  Stream stream(seed, parent.id, parent.ordinal, Purpose::kNoiseOffset, lane);
  const double period = noise_period(params.noise);
  Vec3 offset;
  for (int i = 0; i < 3; ++i) offset[i] = period * stream.uniform();
  return offset;
}

// A cell as it is right after a division.
Cell newborn(const BodyGeometry& body, const Cell& parent, double time_h, double cycle_h, double settle_h) {
  Cell cell;
  cell.generation = parent.generation + 1;
  cell.activity = Activity::kActive;
  cell.centre_um = body.centre_um;
  cell.nucleus_um = centroid_above_dish_um(body);
  cell.nucleus_radius_um = parent.nucleus_radius_um;
  cell.semiaxes_um = body.semiaxes_um;
  cell.rotation_rad = body.rotation_rad;
  cell.noise_offset = body.noise_offset;
  cell.born_h = time_h;
  cell.due_h = time_h + cycle_h;
  cell.settle_due_h = time_h + settle_h;
  cell.volume_um3 = volume_above_dish_um3(body);
  return cell;
}

Inhibited inhibited(const Colony& colony, const Params& params, Seed seed, const Cell& cell, double time_h,
                    const SearchResult& found, kernel::CountWork& work) {
  Inhibited event;
  event.fitness = found.fitness;
  event.evaluation_count = found.evaluation_count;
  event.corrected = found.corrected;
  event.try_count = cell.try_count + 1;
  // On the points of the ordinal the cell will have from this event on: those that later estimates will use.
  event.free_share = free_share(colony, params, seed, cell, cell.ordinal + 1, {}, &work);
  const bool unlucky = event.free_share > params.wake.free_min && event.try_count <= params.wake.tries_max;
  if (unlucky) {
    Stream stream(seed, cell.id, cell.ordinal, Purpose::kRetry);
    event.due_h = time_h + draw_cycle_h(params.cycle, stream);
  }
  return event;
}

}  // namespace

SearchTask search_task(const Colony& colony, const Params& params, Seed seed, CellId id, Workspace& workspace) {
  const Cell& parent = colony.cell(id);
  SearchTask task;
  task.seed = seed;
  task.cell_id = id;
  task.ordinal = parent.ordinal;
  task.frame.pivot_um = parent.nucleus_um;
  task.frame.direction = splitting_direction(colony, params.layers, seed, parent, workspace);
  for (std::uint32_t lane = 0; lane < 2; ++lane) {
    task.frame.noise_offsets[lane] = draw_noise_offset(params, seed, parent, lane);
  }
  return task;
}

Decision decide_division(const Colony& colony, const Params& params, Seed seed, CellId id, double time_h, Workspace& workspace,
                         StopFlag stop) {
  const Cell& parent = colony.cell(id);
  if (params.division.generation_limit && parent.generation >= *params.division.generation_limit) return {Senesced{}, {}};

  kernel::CountWork& counted = workspace.overlap.work;
  counted = {};
  const SearchTask task = search_task(colony, params, seed, id, workspace);
  const SearchResult found = find_space(colony, params, task, workspace, stop);
  // The dish's wall is hard also where inhibition is off, and nobody floats.
  if (found.crosses_wall || !found.supported || (params.division.inhibition && !(found.fitness >= params.contact.fitness_min))) {
    Inhibited event = inhibited(colony, params, seed, parent, time_h, found, counted);
    return {event, {counted, 1, found.evaluation_count}};
  }

  Divided event;
  const std::array<double, 2> cycles = draw_sibling_cycles_h(params.cycle, seed, id, parent.ordinal);
  for (std::size_t k = 0; k < 2; ++k) {
    event.cells[k] = newborn(found.pair.bodies[k], parent, time_h, cycles[k], params.division.settle_h);
  }
  event.cells[0].id = parent.id;
  event.cells[0].parent_id = parent.parent_id;
  event.cells[0].ordinal = parent.ordinal + 1;
  event.cells[1].parent_id = parent.id;
  if (params.motility.rate_per_h > 0.0) {
    // The cell that keeps the id keeps its own next move, so that no event takes anything out of a window.
    event.cells[0].move_due_h = parent.move_due_h;
    Stream delays(seed, id, parent.ordinal, Purpose::kMoveDelay, 1);
    event.cells[1].move_due_h = time_h + draw_move_delay_h(params.motility, delays);
  }
  event.plane_point_um = parent.nucleus_um;
  event.plane_normal = task.frame.direction;
  event.direction = found.pair.direction;
  event.fitness = found.fitness;
  event.evaluation_count = found.evaluation_count;
  event.corrected = found.corrected;
  const std::array<Body, 2> bodies = {Body(found.pair.bodies[0], params.noise), Body(found.pair.bodies[1], params.noise)};
  event.woken = wake_sleepers(colony, params, seed, time_h, {id, bodies}, &counted);
  return {std::move(event), {counted, 1, found.evaluation_count}};
}

Decision decide_settling(const Colony& colony, const Params& params, Seed seed, CellId id, Workspace& workspace) {
  workspace.overlap.work = {};
  const Cell& cell = colony.cell(id);
  const Body& body = colony.body(id);
  const std::vector<const Body*>& neighbours = neighbours_of(colony, id, workspace);
  const ContactRule rule = params.contact.rule;
  // One set for both, placed in the body's box and in the slab.
  tiled_sobol(kSettlePoints, seeds_for(seed, cell, Purpose::kSettlePoints, 0), workspace.points);
  const MassEstimate mass = deformed_mass(body, neighbours, rule, workspace.points, workspace.overlap);
  Settled event;
  // A cell pressed to nothing has no centre of mass: its nucleus stays where it was.
  event.nucleus_um = mass.hit_count > 0 ? mass.centre_um : cell.nucleus_um;
  event.deformed_volume_um3 = mass.volume_um3;
  event.due_h = cell.due_h;
  // Inside everywhere in the slab cannot happen for a body within its own box; then the centre stands for m: no plane is fixed.
  event.nearest_membrane_um =
      nearest_membrane_um(body, neighbours, rule, event.nucleus_um, workspace.points, workspace.overlap, params.layers)
          .value_or(event.nucleus_um);
  return {event, {workspace.overlap.work, 0, 0, 0}};
}

}  // namespace colony
