#include "server/api/columns.hpp"

#include <charconv>

namespace colony::server::api {
namespace {

Field real(const std::optional<double>& value) { return value ? Field(*value) : Field(); }

template <class Body, class F>
Field of(const Event& event, F&& get) {
  const Body* body = std::get_if<Body>(&event.body);
  return body != nullptr ? get(*body) : Field();
}

// What divided and inhibited have in common.
template <class F>
Field of_search(const Event& event, F&& get) {
  if (const auto* divided = std::get_if<Divided>(&event.body)) return get(*divided);
  if (const auto* inhibited = std::get_if<Inhibited>(&event.body)) return get(*inhibited);
  return {};
}

// The new state that the event gives its subject (0) or a daughter (1).
const Cell* state_in(const Event& event, int which) {
  if (const auto* divided = std::get_if<Divided>(&event.body)) return &divided->cells[static_cast<std::size_t>(which)];
  if (which != 0) return nullptr;
  if (const auto* founded = std::get_if<Founded>(&event.body)) return &founded->cell;
  if (const auto* moved = std::get_if<Moved>(&event.body)) return &moved->cell;
  return nullptr;
}
template <class F>
Field of_cell(const Event& event, int which, F&& get) {
  const Cell* cell = state_in(event, which);
  return cell != nullptr ? Field(get(*cell)) : Field();
}

Field daughter_id(const Event& event) {
  const Cell* cell = state_in(event, 1);
  return cell != nullptr ? Field(static_cast<std::int64_t>(cell->id.value)) : Field();
}

Field due_of(const Event& event) {
  if (const auto* inhibited = std::get_if<Inhibited>(&event.body)) return real(inhibited->due_h);
  if (const auto* settled = std::get_if<Settled>(&event.body)) return real(settled->due_h);
  return {};
}

Field woken_count(const Event& event) {
  if (const auto* divided = std::get_if<Divided>(&event.body)) return static_cast<std::int64_t>(divided->woken.size());
  if (const auto* moved = std::get_if<Moved>(&event.body)) return static_cast<std::int64_t>(moved->woken.size());
  return {};
}

constexpr Column<Cell> kCellColumns[] = {
    {"cell_id", FieldType::kInteger, false, "identity; never reused",
     [](const Cell& c) -> Field { return static_cast<std::int64_t>(c.id.value); }},
    {"parent_id", FieldType::kInteger, true, "null for a founder",
     [](const Cell& c) -> Field {
       return c.parent_id ? Field(static_cast<std::int64_t>(c.parent_id->value)) : Field();
     }},
    {"generation", FieldType::kInteger, false, "divisions down its lineage",
     [](const Cell& c) -> Field { return static_cast<std::int64_t>(c.generation); }},
    {"ordinal", FieldType::kInteger, false, "events of which it was the subject",
     [](const Cell& c) -> Field { return static_cast<std::int64_t>(c.ordinal); }},
    {"activity", FieldType::kString, false, "active, passive or senescent",
     [](const Cell& c) -> Field { return std::string(name_of(c.activity)); }},
    {"x_um", FieldType::kNumber, false, "centre", [](const Cell& c) -> Field { return c.centre_um.x(); }},
    {"y_um", FieldType::kNumber, false, "centre", [](const Cell& c) -> Field { return c.centre_um.y(); }},
    {"z_um", FieldType::kNumber, false, "centre", [](const Cell& c) -> Field { return c.centre_um.z(); }},
    {"nucleus_x_um", FieldType::kNumber, false, "nucleus centre",
     [](const Cell& c) -> Field { return c.nucleus_um.x(); }},
    {"nucleus_y_um", FieldType::kNumber, false, "nucleus centre",
     [](const Cell& c) -> Field { return c.nucleus_um.y(); }},
    {"nucleus_z_um", FieldType::kNumber, false, "nucleus centre",
     [](const Cell& c) -> Field { return c.nucleus_um.z(); }},
    {"nucleus_radius_um", FieldType::kNumber, false, "horizontal radius of the nucleus",
     [](const Cell& c) -> Field { return c.nucleus_radius_um; }},
    {"a_um", FieldType::kNumber, false, "semiaxis", [](const Cell& c) -> Field { return c.semiaxes_um.x(); }},
    {"b_um", FieldType::kNumber, false, "semiaxis", [](const Cell& c) -> Field { return c.semiaxes_um.y(); }},
    {"c_um", FieldType::kNumber, false, "semiaxis", [](const Cell& c) -> Field { return c.semiaxes_um.z(); }},
    {"w1_rad", FieldType::kNumber, false, "rotation vector", [](const Cell& c) -> Field { return c.rotation_rad.x(); }},
    {"w2_rad", FieldType::kNumber, false, "rotation vector", [](const Cell& c) -> Field { return c.rotation_rad.y(); }},
    {"w3_rad", FieldType::kNumber, false, "rotation vector", [](const Cell& c) -> Field { return c.rotation_rad.z(); }},
    {"noise_u", FieldType::kNumber, false, "noise offset", [](const Cell& c) -> Field { return c.noise_offset.x(); }},
    {"noise_v", FieldType::kNumber, false, "noise offset", [](const Cell& c) -> Field { return c.noise_offset.y(); }},
    {"noise_w", FieldType::kNumber, false, "noise offset", [](const Cell& c) -> Field { return c.noise_offset.z(); }},
    {"born_h", FieldType::kNumber, false, "time of the last splitting",
     [](const Cell& c) -> Field { return c.born_h; }},
    {"due_h", FieldType::kNumber, true, "next division attempt; null while asleep or senescent",
     [](const Cell& c) -> Field { return real(c.due_h); }},
    {"settle_due_h", FieldType::kNumber, true, "null once the nucleus has settled",
     [](const Cell& c) -> Field { return real(c.settle_due_h); }},
    {"move_due_h", FieldType::kNumber, true, "null without motility",
     [](const Cell& c) -> Field { return real(c.move_due_h); }},
    {"free_share", FieldType::kNumber, true, "of the surroundings, at the last failed search",
     [](const Cell& c) -> Field { return real(c.free_share); }},
    {"try_count", FieldType::kInteger, false, "failed searches since the last change nearby",
     [](const Cell& c) -> Field { return static_cast<std::int64_t>(c.try_count); }},
    {"volume_um3", FieldType::kNumber, false, "noise-free ellipsoid above the dish, analytic",
     [](const Cell& c) -> Field { return c.volume_um3; }},
    {"deformed_volume_um3", FieldType::kNumber, true, "estimate at settling; null before",
     [](const Cell& c) -> Field { return real(c.deformed_volume_um3); }},
    {"nearest_membrane_x_um", FieldType::kNumber, true, "membrane point nearest to the nucleus; null before settling",
     [](const Cell& c) -> Field { return c.nearest_membrane_um ? Field(c.nearest_membrane_um->x()) : Field(); }},
    {"nearest_membrane_y_um", FieldType::kNumber, true, "membrane point nearest to the nucleus; null before settling",
     [](const Cell& c) -> Field { return c.nearest_membrane_um ? Field(c.nearest_membrane_um->y()) : Field(); }},
    {"nearest_membrane_z_um", FieldType::kNumber, true, "membrane point nearest to the nucleus; null before settling",
     [](const Cell& c) -> Field { return c.nearest_membrane_um ? Field(c.nearest_membrane_um->z()) : Field(); }},
};

constexpr Column<SeriesRow> kSeriesColumns[] = {
    {"time_h", FieldType::kNumber, false, "model time", [](const SeriesRow& r) -> Field { return r.time_h; }},
    {"cell_count", FieldType::kInteger, false, "cells",
     [](const SeriesRow& r) -> Field { return static_cast<std::int64_t>(r.cell_count); }},
    {"active_count", FieldType::kInteger, false, "active cells",
     [](const SeriesRow& r) -> Field { return static_cast<std::int64_t>(r.active_count); }},
    {"passive_count", FieldType::kInteger, false, "passive cells",
     [](const SeriesRow& r) -> Field { return static_cast<std::int64_t>(r.passive_count); }},
    {"senescent_count", FieldType::kInteger, false, "senescent cells",
     [](const SeriesRow& r) -> Field { return static_cast<std::int64_t>(r.senescent_count); }},
    {"volume_mean_um3", FieldType::kNumber, false, "mean cell volume",
     [](const SeriesRow& r) -> Field { return r.volume_mean_um3; }},
    {"volume_sd_um3", FieldType::kNumber, false, "its standard deviation over the cells",
     [](const SeriesRow& r) -> Field { return r.volume_sd_um3; }},
    {"radius_um", FieldType::kNumber, false, "sqrt(area / pi)",
     [](const SeriesRow& r) -> Field { return r.radius_um; }},
    {"area_um2", FieldType::kNumber, false, "union of the cells' projections",
     [](const SeriesRow& r) -> Field { return r.area_um2; }},
    {"density_per_mm2", FieldType::kNumber, false, "cells / area",
     [](const SeriesRow& r) -> Field { return r.density_per_mm2; }},
};

constexpr Column<Event> kEventColumns[] = {
    {"seq", FieldType::kInteger, false, "from 1, dense",
     [](const Event& e) -> Field { return static_cast<std::int64_t>(e.seq); }},
    {"time_h", FieldType::kNumber, false, "model time", [](const Event& e) -> Field { return e.time_h; }},
    {"kind", FieldType::kString, false, "kind of the event",
     [](const Event& e) -> Field { return std::string(name_of(e.kind())); }},
    {"cell_id", FieldType::kInteger, true, "the subject; empty for finished",
     [](const Event& e) -> Field { return e.cell_id ? Field(static_cast<std::int64_t>(e.cell_id->value)) : Field(); }},
    {"digest", FieldType::kString, false, "of the chain up to and with this event",
     [](const Event& e) -> Field { return e.digest.hex(); }},
    {"x_um", FieldType::kNumber, true, "centre of the subject's new state (founded, divided, moved)",
     [](const Event& e) -> Field { return of_cell(e, 0, [](const Cell& c) { return c.centre_um.x(); }); }},
    {"y_um", FieldType::kNumber, true, "centre of the subject's new state (founded, divided, moved)",
     [](const Event& e) -> Field { return of_cell(e, 0, [](const Cell& c) { return c.centre_um.y(); }); }},
    {"z_um", FieldType::kNumber, true, "centre of the subject's new state (founded, divided, moved)",
     [](const Event& e) -> Field { return of_cell(e, 0, [](const Cell& c) { return c.centre_um.z(); }); }},
    {"volume_um3", FieldType::kNumber, true, "volume of that state",
     [](const Event& e) -> Field { return of_cell(e, 0, [](const Cell& c) { return c.volume_um3; }); }},
    {"daughter_cell_id", FieldType::kInteger, true, "divided: the new cell",
     [](const Event& e) -> Field { return daughter_id(e); }},
    {"daughter_x_um", FieldType::kNumber, true, "divided: centre of the new cell",
     [](const Event& e) -> Field { return of_cell(e, 1, [](const Cell& c) { return c.centre_um.x(); }); }},
    {"daughter_y_um", FieldType::kNumber, true, "divided: centre of the new cell",
     [](const Event& e) -> Field { return of_cell(e, 1, [](const Cell& c) { return c.centre_um.y(); }); }},
    {"daughter_z_um", FieldType::kNumber, true, "divided: centre of the new cell",
     [](const Event& e) -> Field { return of_cell(e, 1, [](const Cell& c) { return c.centre_um.z(); }); }},
    {"daughter_volume_um3", FieldType::kNumber, true, "divided: volume of the new cell",
     [](const Event& e) -> Field { return of_cell(e, 1, [](const Cell& c) { return c.volume_um3; }); }},
    {"plane_x_um", FieldType::kNumber, true, "divided: point of the splitting plane",
     [](const Event& e) -> Field {
       return of<Divided>(e, [](const Divided& b) { return Field(b.plane_point_um.x()); });
     }},
    {"plane_y_um", FieldType::kNumber, true, "divided: point of the splitting plane",
     [](const Event& e) -> Field {
       return of<Divided>(e, [](const Divided& b) { return Field(b.plane_point_um.y()); });
     }},
    {"plane_z_um", FieldType::kNumber, true, "divided: point of the splitting plane",
     [](const Event& e) -> Field {
       return of<Divided>(e, [](const Divided& b) { return Field(b.plane_point_um.z()); });
     }},
    {"normal_x", FieldType::kNumber, true, "divided: normal of the splitting plane",
     [](const Event& e) -> Field {
       return of<Divided>(e, [](const Divided& b) { return Field(b.plane_normal.x()); });
     }},
    {"normal_y", FieldType::kNumber, true, "divided: normal of the splitting plane",
     [](const Event& e) -> Field {
       return of<Divided>(e, [](const Divided& b) { return Field(b.plane_normal.y()); });
     }},
    {"normal_z", FieldType::kNumber, true, "divided: normal of the splitting plane",
     [](const Event& e) -> Field {
       return of<Divided>(e, [](const Divided& b) { return Field(b.plane_normal.z()); });
     }},
    {"direction_x", FieldType::kNumber, true, "divided: direction of splitting",
     [](const Event& e) -> Field { return of<Divided>(e, [](const Divided& b) { return Field(b.direction.x()); }); }},
    {"direction_y", FieldType::kNumber, true, "divided: direction of splitting",
     [](const Event& e) -> Field { return of<Divided>(e, [](const Divided& b) { return Field(b.direction.y()); }); }},
    {"direction_z", FieldType::kNumber, true, "divided: direction of splitting",
     [](const Event& e) -> Field { return of<Divided>(e, [](const Divided& b) { return Field(b.direction.z()); }); }},
    {"fitness", FieldType::kNumber, true, "divided, inhibited: of the best candidate",
     [](const Event& e) -> Field { return of_search(e, [](const auto& b) { return Field(b.fitness); }); }},
    {"evaluation_count", FieldType::kInteger, true, "divided, inhibited: candidate pairs scored",
     [](const Event& e) -> Field {
       return of_search(e, [](const auto& b) { return Field(static_cast<std::int64_t>(b.evaluation_count)); });
     }},
    {"corrected", FieldType::kBoolean, true, "divided, inhibited: the corrector ran",
     [](const Event& e) -> Field { return of_search(e, [](const auto& b) { return Field(b.corrected); }); }},
    {"free_share", FieldType::kNumber, true, "inhibited: of the surroundings",
     [](const Event& e) -> Field { return of<Inhibited>(e, [](const Inhibited& b) { return Field(b.free_share); }); }},
    {"try_count", FieldType::kInteger, true, "inhibited: failed searches since the last change nearby",
     [](const Event& e) -> Field {
       return of<Inhibited>(e, [](const Inhibited& b) { return Field(static_cast<std::int64_t>(b.try_count)); });
     }},
    {"due_h", FieldType::kNumber, true, "inhibited, settled: next division attempt",
     [](const Event& e) -> Field { return due_of(e); }},
    {"nucleus_x_um", FieldType::kNumber, true, "settled: nucleus centre",
     [](const Event& e) -> Field { return of<Settled>(e, [](const Settled& b) { return Field(b.nucleus_um.x()); }); }},
    {"nucleus_y_um", FieldType::kNumber, true, "settled: nucleus centre",
     [](const Event& e) -> Field { return of<Settled>(e, [](const Settled& b) { return Field(b.nucleus_um.y()); }); }},
    {"nucleus_z_um", FieldType::kNumber, true, "settled: nucleus centre",
     [](const Event& e) -> Field { return of<Settled>(e, [](const Settled& b) { return Field(b.nucleus_um.z()); }); }},
    {"nearest_membrane_x_um", FieldType::kNumber, true, "settled: nearest membrane point",
     [](const Event& e) -> Field {
       return of<Settled>(e, [](const Settled& b) { return Field(b.nearest_membrane_um.x()); });
     }},
    {"nearest_membrane_y_um", FieldType::kNumber, true, "settled: nearest membrane point",
     [](const Event& e) -> Field {
       return of<Settled>(e, [](const Settled& b) { return Field(b.nearest_membrane_um.y()); });
     }},
    {"nearest_membrane_z_um", FieldType::kNumber, true, "settled: nearest membrane point",
     [](const Event& e) -> Field {
       return of<Settled>(e, [](const Settled& b) { return Field(b.nearest_membrane_um.z()); });
     }},
    {"deformed_volume_um3", FieldType::kNumber, true, "settled: estimate",
     [](const Event& e) -> Field {
       return of<Settled>(e, [](const Settled& b) { return Field(b.deformed_volume_um3); });
     }},
    {"woken_count", FieldType::kInteger, true, "divided, moved: sleeping cells woken",
     [](const Event& e) -> Field { return woken_count(e); }},
    {"reason", FieldType::kString, true, "finished: why",
     [](const Event& e) -> Field {
       return of<Finished>(e, [](const Finished& b) { return Field(std::string(name_of(b.reason))); });
     }},
    {"cell_count", FieldType::kInteger, true, "finished: cells",
     [](const Event& e) -> Field {
       return of<Finished>(e, [](const Finished& b) { return Field(static_cast<std::int64_t>(b.cell_count)); });
     }},
};

}  // namespace

std::span<const Column<Cell>> cell_columns() { return kCellColumns; }
std::span<const Column<SeriesRow>> series_columns() { return kSeriesColumns; }
std::span<const Column<Event>> event_columns() { return kEventColumns; }

void append_csv_field(std::string& out, const Field& field) {
  if (const auto* integer = std::get_if<std::int64_t>(&field)) {
    out += std::to_string(*integer);
  } else if (const auto* number = std::get_if<double>(&field)) {
    char text[32];
    out.append(text, std::to_chars(text, text + sizeof text, *number).ptr);
  } else if (const auto* boolean = std::get_if<bool>(&field)) {
    out += *boolean ? "true" : "false";
  } else if (const auto* string = std::get_if<std::string>(&field)) {
    if (string->find_first_of(",\"\r\n") == std::string::npos) {
      out += *string;
      return;
    }
    out += '"';
    for (const char c : *string) {
      if (c == '"') out += '"';
      out += c;
    }
    out += '"';
  }
}

}  // namespace colony::server::api
