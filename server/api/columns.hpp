// columns: the flat columns of cells, events and the growth curve; one table each drives JSON, CSV and OpenAPI.
// Threads: pure.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "engine/analysis/series.hpp"
#include "engine/model/cell.hpp"
#include "engine/model/event.hpp"

namespace colony::server::api {

/// A field of a flat row; monostate is null in JSON and empty in CSV.
using Field = std::variant<std::monostate, std::int64_t, double, bool, std::string>;

enum class FieldType { kInteger, kNumber, kBoolean, kString };

template <class Row>
struct Column {
  std::string_view name;
  FieldType type;
  bool nullable;
  std::string_view text;
  Field (*get)(const Row&);
};

std::span<const Column<Cell>> cell_columns();
std::span<const Column<SeriesRow>> series_columns();
/// The CSV form of an event: its own numbers and where its subject and a daughter are; complete states are in the JSON
/// form.
std::span<const Column<Event>> event_columns();

/// A header line or one line of fields, RFC 4180 (CRLF); numbers in the shortest form that round-trips.
void append_csv_field(std::string& out, const Field& field);
template <class Row>
void append_csv_header(std::string& out, std::span<const Column<Row>> columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i > 0) out += ',';
    out += columns[i].name;
  }
  out += "\r\n";
}
template <class Row>
void append_csv_row(std::string& out, std::span<const Column<Row>> columns, const Row& row) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i > 0) out += ',';
    append_csv_field(out, columns[i].get(row));
  }
  out += "\r\n";
}

}  // namespace colony::server::api
