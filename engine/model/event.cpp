#include "engine/model/event.hpp"

#include <cmath>
#include <utility>

#include "engine/base/check.hpp"

namespace colony {
namespace {

constexpr std::array<std::string_view, kEventKindCount> kKindNames = {"founded", "divided",  "inhibited", "settled",
                                                                      "moved",   "senesced", "finished"};
constexpr std::array<std::string_view, 3> kActivityNames = {"active", "passive", "senescent"};
constexpr std::array<std::string_view, 11> kReasonNames = {"cells",     "time",  "exhausted", "all_senescent",
                                                           "cancelled", "limit", "internal",  "engine_changed",
                                                           "identical", "different", "target_deleted"};

template <class Enum, std::size_t n>
std::optional<Enum> find_name(const std::array<std::string_view, n>& names, std::string_view name) {
  for (std::size_t i = 0; i < n; ++i) {
    if (names[i] == name) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

// Visits every double of an event, in the order of the canonical bytes.
template <class F>
void each_double(Vec3& v, F&& f) {
  for (int i = 0; i < 3; ++i) f(v[i]);
}
template <class F>
void each_double(std::optional<double>& v, F&& f) {
  if (v) f(*v);
}
template <class F>
void each_double(SlimOptional<double>& v, F&& f) {
  if (v) f(*v);
}
template <class F>
void each_double(Cell& cell, F&& f) {
  each_double(cell.centre_um, f);
  each_double(cell.nucleus_um, f);
  f(cell.nucleus_radius_um);
  each_double(cell.semiaxes_um, f);
  each_double(cell.rotation_rad, f);
  each_double(cell.noise_offset, f);
  f(cell.born_h);
  each_double(cell.due_h, f);
  each_double(cell.settle_due_h, f);
  each_double(cell.move_due_h, f);
  each_double(cell.free_share, f);
  f(cell.volume_um3);
  each_double(cell.deformed_volume_um3, f);
  if (cell.nearest_membrane_um) each_double(*cell.nearest_membrane_um, f);
}
template <class F>
void each_double(std::vector<Woken>& woken, F&& f) {
  for (Woken& one : woken) {
    f(one.free_share);
    f(one.due_h);
  }
}

struct Canonicalise {
  void operator()(double& value) const {
    CHECK(std::isfinite(value));
    value = value + 0.0;  // -0.0 becomes 0.0
  }
};

void add_cell(CanonicalBytes& out, const Cell& cell) {
  out.add_u32(cell.id.value);
  out.add_u32(cell.parent_id ? cell.parent_id->value : 0);
  out.add_u32(static_cast<std::uint32_t>(cell.generation));
  out.add_u32(cell.ordinal);
  out.add_u8(static_cast<std::uint8_t>(cell.activity));
  out.add_vec3(cell.centre_um);
  out.add_vec3(cell.nucleus_um);
  out.add_double(cell.nucleus_radius_um);
  out.add_vec3(cell.semiaxes_um);
  out.add_vec3(cell.rotation_rad);
  out.add_vec3(cell.noise_offset);
  out.add_double(cell.born_h);
  out.add_optional(cell.due_h);
  out.add_optional(cell.settle_due_h);
  out.add_optional(cell.move_due_h);
  out.add_optional(cell.free_share);
  out.add_u32(static_cast<std::uint32_t>(cell.try_count));
  out.add_double(cell.volume_um3);
  out.add_optional(cell.deformed_volume_um3);
  out.add_u8(cell.nearest_membrane_um ? 1 : 0);
  if (cell.nearest_membrane_um) out.add_vec3(*cell.nearest_membrane_um);
}

void add_woken(CanonicalBytes& out, const std::vector<Woken>& woken) {
  out.add_u32(static_cast<std::uint32_t>(woken.size()));
  for (const Woken& one : woken) {
    out.add_u32(one.cell_id.value);
    out.add_double(one.free_share);
    out.add_double(one.due_h);
  }
}

struct AddBody {
  CanonicalBytes& out;
  void operator()(const Founded& body) const { add_cell(out, body.cell); }
  void operator()(const Divided& body) const {
    for (const Cell& cell : body.cells) add_cell(out, cell);
    out.add_vec3(body.plane_point_um);
    out.add_vec3(body.plane_normal);
    out.add_vec3(body.direction);
    out.add_double(body.fitness);
    out.add_u32(body.evaluation_count);
    out.add_u8(body.corrected ? 1 : 0);
    add_woken(out, body.woken);
  }
  void operator()(const Inhibited& body) const {
    out.add_double(body.fitness);
    out.add_double(body.free_share);
    out.add_u32(static_cast<std::uint32_t>(body.try_count));
    out.add_u32(body.evaluation_count);
    out.add_u8(body.corrected ? 1 : 0);
    out.add_optional(body.due_h);
  }
  void operator()(const Settled& body) const {
    out.add_vec3(body.nucleus_um);
    out.add_vec3(body.nearest_membrane_um);
    out.add_double(body.deformed_volume_um3);
    out.add_optional(body.due_h);
  }
  void operator()(const Moved& body) const {
    add_cell(out, body.cell);
    add_woken(out, body.woken);
  }
  void operator()(const Senesced&) const {}
  void operator()(const Finished&) const {}
};

struct CanonicaliseBody {
  Canonicalise f;
  void operator()(Founded& body) const { each_double(body.cell, f); }
  void operator()(Divided& body) const {
    for (Cell& cell : body.cells) each_double(cell, f);
    each_double(body.plane_point_um, f);
    each_double(body.plane_normal, f);
    each_double(body.direction, f);
    f(body.fitness);
    each_double(body.woken, f);
  }
  void operator()(Inhibited& body) const {
    f(body.fitness);
    f(body.free_share);
    each_double(body.due_h, f);
  }
  void operator()(Settled& body) const {
    each_double(body.nucleus_um, f);
    each_double(body.nearest_membrane_um, f);
    f(body.deformed_volume_um3);
    each_double(body.due_h, f);
  }
  void operator()(Moved& body) const {
    each_double(body.cell, f);
    each_double(body.woken, f);
  }
  void operator()(Senesced&) const {}
  void operator()(Finished&) const {}
};

}  // namespace

std::string_view name_of(EventKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }
std::optional<EventKind> event_kind_from(std::string_view name) { return find_name<EventKind>(kKindNames, name); }
std::string_view name_of(Activity activity) { return kActivityNames[static_cast<std::size_t>(activity)]; }
std::string_view name_of(FinishReason reason) { return kReasonNames[static_cast<std::size_t>(reason)]; }
std::optional<FinishReason> finish_reason_from(std::string_view name) { return find_name<FinishReason>(kReasonNames, name); }

void canonicalise(Event& event) {
  Canonicalise{}(event.time_h);
  std::visit(CanonicaliseBody{}, event.body);
}

Digest digest_after(const Digest& previous, const Event& event) {
  if (event.kind() == EventKind::kFinished) return previous;
  CanonicalBytes out;
  out.add_u8(static_cast<std::uint8_t>(event.kind()));
  out.add_double(event.time_h);
  out.add_u32(event.cell_id ? event.cell_id->value : 0);
  std::visit(AddBody{out}, event.body);
  return chain(previous, std::move(out));
}

}  // namespace colony
