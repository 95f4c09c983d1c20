#include "server/api/event_text.hpp"

#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "engine/base/check.hpp"
#include "server/api/columns.hpp"

namespace colony::server::api {
namespace {

constexpr std::size_t kNumberBytesMax = 32;  // the shortest form of a double has 24

template <class Integer>
void append_integer(std::string& out, Integer value) {
  char text[kNumberBytesMax];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void append_double(std::string& out, double value) {
  CHECK(std::isfinite(value));
  char text[kNumberBytesMax];
  char* const end = std::to_chars(text, text + sizeof text, value).ptr;
  const auto size = static_cast<std::size_t>(end - text);
  out.append(text, size);
  if (std::memchr(text, '.', size) == nullptr && std::memchr(text, 'e', size) == nullptr) out += ".0";
}

/// A name of ours: it needs no escape.
void append_name(std::string& out, std::string_view name) { (((out += '"') += name) += '"'); }

void append(std::string& out, std::string_view key, double value) {
  out += key;
  append_double(out, value);
}
void append(std::string& out, std::string_view key, const std::optional<double>& value) {
  out += key;
  if (value) {
    append_double(out, *value);
  } else {
    out += "null";
  }
}
void append(std::string& out, std::string_view key, bool value) { (out += key) += value ? "true" : "false"; }
void append(std::string& out, std::string_view key, std::int64_t value) {
  out += key;
  append_integer(out, value);
}
void append(std::string& out, std::string_view key, const Vec3& value) {
  out += key;
  out += '[';
  append_double(out, value.x());
  append(out, ",", value.y());
  append(out, ",", value.z());
  out += ']';
}

void append_woken(std::string& out, const std::vector<Woken>& woken) {
  out += ",\"woken\":[";
  for (std::size_t i = 0; i < woken.size(); ++i) {
    if (i > 0) out += ',';
    append(out, "{\"cell_id\":", std::int64_t{woken[i].cell_id.value});
    append(out, ",\"free_share\":", woken[i].free_share);
    append(out, ",\"due_h\":", woken[i].due_h);
    out += '}';
  }
  out += ']';
}

struct AppendField {
  std::string& out;
  void operator()(std::monostate) const { out += "null"; }
  void operator()(std::int64_t value) const { append_integer(out, value); }
  void operator()(double value) const { append_double(out, value); }
  void operator()(bool value) const { out += value ? "true" : "false"; }
  void operator()(const std::string& name) const { append_name(out, name); }
};

struct AppendBody {
  std::string& out;
  void operator()(const Founded& body) const {
    out += ",\"cell\":";
    append_cell_text(out, body.cell);
  }
  void operator()(const Divided& body) const {
    out += ",\"cells\":[";
    append_cell_text(out, body.cells[0]);
    out += ',';
    append_cell_text(out, body.cells[1]);
    append(out, "],\"plane\":{\"point_um\":", body.plane_point_um);
    append(out, ",\"normal\":", body.plane_normal);
    append(out, "},\"direction\":", body.direction);
    append(out, ",\"fitness\":", body.fitness);
    append(out, ",\"evaluation_count\":", std::int64_t{body.evaluation_count});
    append(out, ",\"corrected\":", body.corrected);
    append_woken(out, body.woken);
  }
  void operator()(const Inhibited& body) const {
    append(out, ",\"fitness\":", body.fitness);
    append(out, ",\"free_share\":", body.free_share);
    append(out, ",\"try_count\":", std::int64_t{body.try_count});
    append(out, ",\"evaluation_count\":", std::int64_t{body.evaluation_count});
    append(out, ",\"corrected\":", body.corrected);
    append(out, ",\"due_h\":", body.due_h);
  }
  void operator()(const Settled& body) const {
    append(out, ",\"nucleus_um\":", body.nucleus_um);
    append(out, ",\"nearest_membrane_um\":", body.nearest_membrane_um);
    append(out, ",\"deformed_volume_um3\":", body.deformed_volume_um3);
    append(out, ",\"due_h\":", body.due_h);
  }
  void operator()(const Moved& body) const {
    out += ",\"cell\":";
    append_cell_text(out, body.cell);
    append_woken(out, body.woken);
  }
  void operator()(const Senesced&) const {}
  void operator()(const Finished& body) const {
    out += ",\"reason\":";
    append_name(out, name_of(body.reason));
    out += ",\"cell_count\":";
    append_integer(out, body.cell_count);
  }
};

template <class Row>
void append_row(std::string& out, std::span<const Column<Row>> columns, const Row& row) {
  char separator = '{';
  for (const Column<Row>& column : columns) {
    out += separator;
    append_name(out, column.name);
    out += ':';
    std::visit(AppendField{out}, column.get(row));
    separator = ',';
  }
  out += '}';
}

}  // namespace

void append_cell_text(std::string& out, const Cell& cell) { append_row(out, cell_columns(), cell); }

void append_series_text(std::string& out, const SeriesRow& row) { append_row(out, series_columns(), row); }

void append_event_text(std::string& out, const Event& event) {
  out += "{\"seq\":";
  append_integer(out, event.seq);
  append(out, ",\"time_h\":", event.time_h);
  out += ",\"kind\":";
  append_name(out, name_of(event.kind()));
  out += ",\"cell_id\":";
  if (event.cell_id) {
    append_integer(out, event.cell_id->value);
  } else {
    out += "null";
  }
  out += ",\"digest\":";
  append_name(out, event.digest.hex());
  std::visit(AppendBody{out}, event.body);
  out += '}';
}

}  // namespace colony::server::api
