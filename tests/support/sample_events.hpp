// sample_events: histories that the store accepts, without growing a colony. The cells are no colony; the digests are no chain.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/model/event.hpp"
#include "server/store/store.hpp"

namespace colony::tests {

/// A cell whose every number differs from every other, with doubles that lose digits easily.
inline Cell sample_cell(std::uint32_t id) {
  double n = id;
  const auto next = [&n] { return n = n * 1.0000001 + 1.0 / 3.0; };
  const auto next3 = [&] { return Vec3(next(), -next(), next()); };
  Cell cell;
  cell.id = {id};
  if (id > 1) cell.parent_id = CellId{id - 1};
  cell.generation = static_cast<std::int32_t>(id % 40);
  cell.ordinal = id + 7;
  cell.activity = static_cast<Activity>(id % 3);
  cell.centre_um = next3();
  cell.nucleus_um = next3();
  cell.nucleus_radius_um = next();
  cell.semiaxes_um = next3();
  cell.rotation_rad = next3();
  cell.noise_offset = next3();
  cell.born_h = next();
  if (id % 2 == 0) cell.due_h = next();
  if (id % 3 == 0) cell.settle_due_h = next();
  if (id % 5 == 0) cell.move_due_h = next();
  if (id % 2 == 1) cell.free_share = next();
  cell.try_count = static_cast<std::int32_t>(id % 4);
  cell.volume_um3 = next();
  if (id % 3 == 1) cell.deformed_volume_um3 = next();
  if (id % 2 == 1) cell.nearest_membrane_um = next3();
  return cell;
}

inline Event sample_event(std::uint64_t seq, EventBody body) {
  Event event;
  event.seq = seq;
  event.time_h = static_cast<double>(seq) / 3.0;
  if (!std::holds_alternative<Finished>(body)) event.cell_id = CellId{static_cast<std::uint32_t>(seq % 11 + 1)};
  event.body = std::move(body);
  for (std::size_t i = 0; i < 16; ++i) event.digest.bytes[i] = static_cast<std::uint8_t>(seq * 31 + i * 17);
  return event;
}

/// One event of every kind, `finished` last, with and without each optional, and doubles at the ends of their range.
inline std::vector<Event> events_of_every_kind() {
  using Limits = std::numeric_limits<double>;
  std::vector<EventBody> bodies;
  for (const std::uint32_t id : {1U, 2U, 3U, 4U, 5U, 6U, 7U, 4'294'967'295U})
    bodies.push_back(Founded{sample_cell(id)});
  Cell extreme = sample_cell(8);
  extreme.centre_um = {Limits::denorm_min(), -Limits::denorm_min(), Limits::min()};
  extreme.nucleus_um = {Limits::max(), Limits::lowest(), 1e308};
  extreme.semiaxes_um = {0.1 + 0.2, 4503599627370497.5, 9007199254740993.0};
  extreme.rotation_rad = {0.0, 1.0, -1.0};
  extreme.noise_offset = {5e-324, 2.2250738585072011e-308, 1.7976931348623157e308};
  extreme.due_h = 0.30000000000000004;
  bodies.push_back(Founded{extreme});
  Divided divided;
  divided.cells[0] = sample_cell(9);
  divided.cells[1] = sample_cell(10);
  divided.plane_point_um = {1.0 / 3.0, 2.0 / 3.0, 1e-17};
  divided.plane_normal = {0.6, -0.8, 0.0};
  divided.direction = {-0.8, 0.6, 5e-324};
  divided.fitness = 0.87654321012345678;
  divided.evaluation_count = 4'294'967'295U;
  divided.corrected = true;
  divided.woken = {{CellId{3}, 0.1, 17.25}, {CellId{4}, 1e-300, 1e300}};
  bodies.push_back(divided);
  divided.woken.clear();
  divided.corrected = false;
  bodies.push_back(divided);
  bodies.push_back(Inhibited{0.1, 0.2, 3, 17, true, 33.333333333333336});
  bodies.push_back(Inhibited{0.3, 0.4, 0, 0, false, std::nullopt});
  bodies.push_back(Settled{{1.5, -2.5, 3.5}, {4.25, 5.125, -6.0625}, 431.00000000000006, 12.5});
  bodies.push_back(Settled{{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}, 7.0, std::nullopt});
  bodies.push_back(Moved{sample_cell(12), {{CellId{1}, 0.5, 2.0}}});
  bodies.push_back(Moved{sample_cell(13), {}});
  bodies.push_back(Senesced{});
  bodies.push_back(Finished{FinishReason::kExhausted, 123456789012ULL});
  std::vector<Event> events;
  for (EventBody& body : bodies) events.push_back(sample_event(events.size() + 1, std::move(body)));
  return events;
}

/// `count` small events, seq first, first + 1, ...
inline server::EventBatch sample_batch(std::int64_t job_key, std::uint64_t first, std::uint64_t count) {
  server::EventBatch batch;
  batch.job_key = job_key;
  std::array<Cell, 2> pair;
  pair[0] = sample_cell(1);
  pair[1] = sample_cell(2);
  for (std::uint64_t seq = first; seq < first + count; ++seq) {
    Divided divided;
    divided.cells = pair;
    divided.woken = {{CellId{5}, 0.5, 1.0}};
    batch.events.push_back(sample_event(seq, seq % 4 == 1 ? EventBody(divided) : EventBody(Senesced{})));
  }
  batch.cell_count = first + count - 1;
  batch.active_count = 1;
  return batch;
}

}  // namespace colony::tests
