#include "server/store/event_rows.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/check.hpp"
#include "server/store/cell_index.hpp"

namespace colony::server {
namespace {

constexpr const char* kInsertPlacement =
    "INSERT INTO placement VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";
constexpr const char* kSelectPlacement =
    "SELECT cell_id, parent_id, generation, ordinal, activity, x_um, y_um, z_um, nucleus_x_um, nucleus_y_um, "
    "nucleus_z_um,"
    " nucleus_radius_um, a_um, b_um, c_um, w1_rad, w2_rad, w3_rad, noise_u, noise_v, noise_w, born_h, due_h, "
    "settle_due_h,"
    " move_due_h, free_share, try_count, volume_um3, deformed_volume_um3, nearest_membrane_x_um, nearest_membrane_y_um,"
    " nearest_membrane_z_um FROM placement WHERE job_key = ? AND seq = ? ORDER BY slot";
constexpr const char* kInsertEvent =
    "INSERT INTO event VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";
constexpr const char* kEventColumns =
    "SELECT seq, time_h, kind, cell_id, digest, plane_x_um, plane_y_um, plane_z_um, normal_x, normal_y, normal_z,"
    " direction_x, direction_y, direction_z, fitness, evaluation_count, corrected, free_share, try_count, nucleus_x_um,"
    " nucleus_y_um, nucleus_z_um, nearest_membrane_x_um, nearest_membrane_y_um, nearest_membrane_z_um,"
    " deformed_volume_um3, due_h, reason, cell_count FROM event WHERE job_key = ?1 AND seq > ?2";
constexpr const char* kInsertWoken = "INSERT INTO woken VALUES (?,?,?,?,?,?)";
constexpr const char* kSelectWoken =
    "SELECT cell_id, free_share, due_h FROM woken WHERE job_key = ? AND seq = ? ORDER BY slot";
constexpr const char* kInsertSeries = "INSERT INTO series VALUES (?,?,?,?,?,?,?,?,?,?,?)";
constexpr const char* kSelectSeries =
    "SELECT time_h, cell_count, active_count, passive_count, senescent_count, volume_mean_um3, volume_sd_um3, "
    "radius_um,"
    " area_um2, density_per_mm2 FROM series WHERE job_key = ? ORDER BY time_h";

// Column numbers of kEventColumns.
enum Column {
  kSeq,
  kTime,
  kKind,
  kCell,
  kDigest,
  kPlane,
  kNormal = kPlane + 3,
  kDirection = kNormal + 3,
  kFitness = kDirection + 3,
  kEvaluations,
  kCorrected,
  kFreeShare,
  kTries,
  kNucleus,
  kMembrane = kNucleus + 3,
  kVolume = kMembrane + 3,
  kDue,
  kReason,
  kCellCount
};

std::int64_t signed_of(std::uint64_t value) {
  CHECK(value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()));
  return static_cast<std::int64_t>(value);
}

void bind_exact(Statement& to, double value) {
  CHECK(std::isfinite(value) && !(value == 0.0 && std::signbit(value)));  // else SQLite stores NULL, or loses the sign
  to.bind(value);
}

void bind_exact(Statement& to, const std::optional<double>& value) {
  if (value) {
    bind_exact(to, *value);
  } else {
    to.bind_null();
  }
}

void bind_exact(Statement& to, const Vec3& value) {
  for (int i = 0; i < 3; ++i) bind_exact(to, value[i]);
}

// A statement begins with NULL for every parameter.
void bind_nulls(Statement& to, int count) { to.skip(count); }

Vec3 vector_at(const Statement& row, int column) {
  return {row.real(column), row.real(column + 1), row.real(column + 2)};
}

CellId cell_id_at(const Statement& row, int column) { return {static_cast<std::uint32_t>(row.integer(column))}; }

[[noreturn]] void corrupt(const std::string& what) { throw DbError(SQLITE_CORRUPT, "a stored event has " + what); }

Activity activity_from(const std::string& name) {
  for (const Activity activity : {Activity::kActive, Activity::kPassive, Activity::kSenescent}) {
    if (name_of(activity) == name) return activity;
  }
  corrupt("the unknown activity " + name);
}

void write_placement(Connection& connection, std::int64_t job_key, std::int64_t seq, int slot, const Cell& cell) {
  Statement& to = connection.prepared(kInsertPlacement);
  to.bind(job_key).bind(seq).bind(std::int64_t{slot}).bind(std::int64_t{cell.id.value});
  if (cell.parent_id) {
    to.bind(std::int64_t{cell.parent_id->value});
  } else {
    to.bind_null();
  }
  to.bind(std::int64_t{cell.generation}).bind(std::int64_t{cell.ordinal}).bind_lasting(name_of(cell.activity));
  bind_exact(to, cell.centre_um);
  bind_exact(to, cell.nucleus_um);
  bind_exact(to, cell.nucleus_radius_um);
  bind_exact(to, cell.semiaxes_um);
  bind_exact(to, cell.rotation_rad);
  bind_exact(to, cell.noise_offset);
  bind_exact(to, cell.born_h);
  bind_exact(to, cell.due_h);
  bind_exact(to, cell.settle_due_h);
  bind_exact(to, cell.move_due_h);
  bind_exact(to, cell.free_share);
  to.bind(std::int64_t{cell.try_count});
  bind_exact(to, cell.volume_um3);
  bind_exact(to, cell.deformed_volume_um3);
  if (cell.nearest_membrane_um) {
    bind_exact(to, *cell.nearest_membrane_um);
  } else {
    bind_nulls(to, 3);
  }
  to.run();
}

std::vector<Cell> read_placements(Connection& connection, std::int64_t job_key, std::int64_t seq) {
  std::vector<Cell> cells;
  Statement& row = connection.prepared(kSelectPlacement);
  row.bind(job_key).bind(seq);
  while (row.step()) {
    Cell& cell = cells.emplace_back();
    cell.id = cell_id_at(row, 0);
    if (!row.is_null(1)) cell.parent_id = cell_id_at(row, 1);
    cell.generation = static_cast<std::int32_t>(row.integer(2));
    cell.ordinal = static_cast<std::uint32_t>(row.integer(3));
    cell.activity = activity_from(row.text(4));
    cell.centre_um = vector_at(row, 5);
    cell.nucleus_um = vector_at(row, 8);
    cell.nucleus_radius_um = row.real(11);
    cell.semiaxes_um = vector_at(row, 12);
    cell.rotation_rad = vector_at(row, 15);
    cell.noise_offset = vector_at(row, 18);
    cell.born_h = row.real(21);
    cell.due_h = row.optional_real(22);
    cell.settle_due_h = row.optional_real(23);
    cell.move_due_h = row.optional_real(24);
    cell.free_share = row.optional_real(25);
    cell.try_count = static_cast<std::int32_t>(row.integer(26));
    cell.volume_um3 = row.real(27);
    cell.deformed_volume_um3 = row.optional_real(28);
    if (!row.is_null(29)) cell.nearest_membrane_um = vector_at(row, 29);
  }
  return cells;
}

void write_woken(Connection& connection, std::int64_t job_key, std::int64_t seq, const std::vector<Woken>& woken) {
  for (std::size_t slot = 0; slot < woken.size(); ++slot) {
    Statement& to = connection.prepared(kInsertWoken);
    to.bind(job_key).bind(seq).bind(static_cast<std::int64_t>(slot)).bind(std::int64_t{woken[slot].cell_id.value});
    bind_exact(to, woken[slot].free_share);
    bind_exact(to, woken[slot].due_h);
    to.run();
  }
}

std::vector<Woken> read_woken(Connection& connection, std::int64_t job_key, std::int64_t seq) {
  std::vector<Woken> woken;
  Statement& row = connection.prepared(kSelectWoken);
  row.bind(job_key).bind(seq);
  while (row.step()) woken.push_back({cell_id_at(row, 0), row.real(1), row.real(2)});
  return woken;
}

/// Binds the kind's own columns, from plane_x_um to cell_count, in the order of the table; NULL where a kind has none.
struct BindBody {
  Statement& to;
  void operator()(const Founded&) const { bind_nulls(to, 24); }
  void operator()(const Divided& divided) const {
    bind_exact(to, divided.plane_point_um);
    bind_exact(to, divided.plane_normal);
    bind_exact(to, divided.direction);
    bind_exact(to, divided.fitness);
    to.bind(std::int64_t{divided.evaluation_count}).bind(std::int64_t{divided.corrected ? 1 : 0});
    bind_nulls(to, 12);
  }
  void operator()(const Inhibited& inhibited) const {
    bind_nulls(to, 9);
    bind_exact(to, inhibited.fitness);
    to.bind(std::int64_t{inhibited.evaluation_count}).bind(std::int64_t{inhibited.corrected ? 1 : 0});
    bind_exact(to, inhibited.free_share);
    to.bind(std::int64_t{inhibited.try_count});
    bind_nulls(to, 7);
    bind_exact(to, inhibited.due_h);
    bind_nulls(to, 2);
  }
  void operator()(const Settled& settled) const {
    bind_nulls(to, 14);
    bind_exact(to, settled.nucleus_um);
    bind_exact(to, settled.nearest_membrane_um);
    bind_exact(to, settled.deformed_volume_um3);
    bind_exact(to, settled.due_h);
    bind_nulls(to, 2);
  }
  void operator()(const Moved&) const { bind_nulls(to, 24); }
  void operator()(const Senesced&) const { bind_nulls(to, 24); }
  void operator()(const Finished& finished) const {
    bind_nulls(to, 22);
    to.bind_lasting(name_of(finished.reason)).bind(signed_of(finished.cell_count));
  }
};

/// Everything of the row of `event`; cells and woken follow in complete().
Event event_at(const Statement& row) {
  Event event;
  event.seq = static_cast<std::uint64_t>(row.integer(kSeq));
  event.time_h = row.real(kTime);
  if (!row.is_null(kCell)) event.cell_id = cell_id_at(row, kCell);
  const auto digest = row.blob(kDigest);
  if (digest.size() != event.digest.bytes.size()) corrupt("a digest of another length");
  std::copy(digest.begin(), digest.end(), event.digest.bytes.begin());
  const std::string kind_name = row.text(kKind);
  const auto kind = event_kind_from(kind_name);
  if (!kind) corrupt("the unknown kind " + kind_name);
  switch (*kind) {
    case EventKind::kFounded:
      event.body = Founded{};
      break;
    case EventKind::kDivided: {
      Divided divided;
      divided.plane_point_um = vector_at(row, kPlane);
      divided.plane_normal = vector_at(row, kNormal);
      divided.direction = vector_at(row, kDirection);
      divided.fitness = row.real(kFitness);
      divided.evaluation_count = static_cast<std::uint32_t>(row.integer(kEvaluations));
      divided.corrected = row.integer(kCorrected) != 0;
      event.body = std::move(divided);
      break;
    }
    case EventKind::kInhibited:
      event.body = Inhibited{row.real(kFitness),
                             row.real(kFreeShare),
                             static_cast<std::int32_t>(row.integer(kTries)),
                             static_cast<std::uint32_t>(row.integer(kEvaluations)),
                             row.integer(kCorrected) != 0,
                             row.optional_real(kDue)};
      break;
    case EventKind::kSettled:
      event.body =
          Settled{vector_at(row, kNucleus), vector_at(row, kMembrane), row.real(kVolume), row.optional_real(kDue)};
      break;
    case EventKind::kMoved:
      event.body = Moved{};
      break;
    case EventKind::kSenesced:
      event.body = Senesced{};
      break;
    case EventKind::kFinished: {
      const std::string reason_name = row.text(kReason);
      const auto reason = finish_reason_from(reason_name);
      if (!reason) corrupt("the unknown reason " + reason_name);
      event.body = Finished{*reason, static_cast<std::uint64_t>(row.integer(kCellCount))};
      break;
    }
  }
  return event;
}

void complete(Connection& connection, std::int64_t job_key, Event& event) {
  const std::int64_t seq = signed_of(event.seq);
  const auto placements = [&](std::size_t count) {
    std::vector<Cell> cells = read_placements(connection, job_key, seq);
    if (cells.size() != count) corrupt("a wrong number of cells");
    return cells;
  };
  if (auto* founded = std::get_if<Founded>(&event.body)) {
    founded->cell = placements(1)[0];
  } else if (auto* divided = std::get_if<Divided>(&event.body)) {
    const std::vector<Cell> cells = placements(2);
    divided->cells = {cells[0], cells[1]};
    divided->woken = read_woken(connection, job_key, seq);
  } else if (auto* moved = std::get_if<Moved>(&event.body)) {
    moved->cell = placements(1)[0];
    moved->woken = read_woken(connection, job_key, seq);
  }
}

/// `select` ends in a condition over ?1, the job, and ?2, the seq before; `rest` may use ?3, `number`.
Statement filtered(Connection& connection, std::string select, const char* rest, std::int64_t job_key,
                   const EventFilter& filter, std::uint64_t number) {
  if (!filter.kinds.empty()) {
    select += " AND kind IN (";  // names of ours, never a client's text
    for (std::size_t i = 0; i < filter.kinds.size(); ++i)
      select += (i == 0 ? "'" : ", '") + std::string(name_of(filter.kinds[i])) + "'";
    select += ")";
  }
  if (filter.cell_id) select += std::string(" AND seq IN (") + kSeqsOfCell + ")";
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  Statement row = connection.prepare_once(select + rest);
  row.bind(job_key).bind(static_cast<std::int64_t>(std::min(filter.after, kMax)));
  row.bind(static_cast<std::int64_t>(std::min(number, kMax)));
  if (filter.cell_id) row.bind(std::int64_t{*filter.cell_id});
  return row;
}

}  // namespace

void write_event(Connection& connection, std::int64_t job_key, const Event& event) {
  const std::int64_t seq = signed_of(event.seq);
  Statement& to = connection.prepared(kInsertEvent);
  to.bind(job_key).bind(seq);
  bind_exact(to, event.time_h);
  to.bind_lasting(name_of(event.kind()));
  if (event.cell_id) {
    to.bind(std::int64_t{event.cell_id->value});
  } else {
    to.bind_null();
  }
  to.bind_lasting_blob(event.digest.bytes);
  std::visit(BindBody{to}, event.body);
  to.run();
  if (const auto* founded = std::get_if<Founded>(&event.body)) {
    write_placement(connection, job_key, seq, 0, founded->cell);
  } else if (const auto* divided = std::get_if<Divided>(&event.body)) {
    for (int slot = 0; slot < 2; ++slot) {
      write_placement(connection, job_key, seq, slot, divided->cells[static_cast<std::size_t>(slot)]);
    }
    write_woken(connection, job_key, seq, divided->woken);
  } else if (const auto* moved = std::get_if<Moved>(&event.body)) {
    write_placement(connection, job_key, seq, 0, moved->cell);
    write_woken(connection, job_key, seq, moved->woken);
  }
}

std::size_t row_count(const Event& event) {
  if (const auto* divided = std::get_if<Divided>(&event.body)) return 3 + divided->woken.size();
  if (const auto* moved = std::get_if<Moved>(&event.body)) return 2 + moved->woken.size();
  return std::holds_alternative<Founded>(event.body) ? 2 : 1;
}

std::vector<Event> read_events(Connection& connection, std::int64_t job_key, const EventFilter& filter,
                               std::size_t limit) {
  Statement row = filtered(connection, std::string(kEventColumns), " ORDER BY seq LIMIT ?3", job_key, filter, limit);
  std::vector<Event> events;
  while (row.step()) {
    events.push_back(event_at(row));
    complete(connection, job_key, events.back());
  }
  return events;
}

std::optional<std::uint64_t> page_end(Connection& connection, std::int64_t job_key, const EventFilter& filter,
                                      std::size_t limit) {
  Statement row = filtered(connection, "SELECT seq FROM event WHERE job_key = ?1 AND seq > ?2",
                           " ORDER BY seq LIMIT 2 OFFSET ?3", job_key, filter, limit - 1);
  if (!row.step()) return std::nullopt;
  const auto end = static_cast<std::uint64_t>(row.integer(0));
  return row.step() ? std::optional(end) : std::nullopt;
}

void write_series(Connection& connection, std::int64_t job_key, const SeriesRow& row) {
  Statement& to = connection.prepared(kInsertSeries);
  to.bind(job_key);
  bind_exact(to, row.time_h);
  to.bind(signed_of(row.cell_count)).bind(signed_of(row.active_count));
  to.bind(signed_of(row.passive_count)).bind(signed_of(row.senescent_count));
  for (const double value :
       {row.volume_mean_um3, row.volume_sd_um3, row.radius_um, row.area_um2, row.density_per_mm2}) {
    bind_exact(to, value);
  }
  to.run();
}

std::vector<SeriesRow> read_series(Connection& connection, std::int64_t job_key) {
  std::vector<SeriesRow> rows;
  Statement& row = connection.prepared(kSelectSeries);
  row.bind(job_key);
  while (row.step()) {
    SeriesRow& series = rows.emplace_back();
    series.time_h = row.real(0);
    series.cell_count = static_cast<std::uint64_t>(row.integer(1));
    series.active_count = static_cast<std::uint64_t>(row.integer(2));
    series.passive_count = static_cast<std::uint64_t>(row.integer(3));
    series.senescent_count = static_cast<std::uint64_t>(row.integer(4));
    series.volume_mean_um3 = row.real(5);
    series.volume_sd_um3 = row.real(6);
    series.radius_um = row.real(7);
    series.area_um2 = row.real(8);
    series.density_per_mm2 = row.real(9);
  }
  return rows;
}

}  // namespace colony::server
