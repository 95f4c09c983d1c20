#include "server/api/shape_table.hpp"

#include <utility>

#include "engine/analysis/neighbours.hpp"

namespace colony::server::api {
namespace {

using Row = ShapeRow;

template <class Get>
Field of(const Row& row, Get&& get) {
  return row.shape ? Field(get(*row.shape)) : Field();
}

template <class Get>
Field scaled(const Row& row, int power, Get&& get) {
  if (!row.shape || !row.um_per_px) return {};
  const double scale = power == 2 ? *row.um_per_px * *row.um_per_px : *row.um_per_px;
  return get(*row.shape) * scale;
}

Field id_of(const Row& row) { return static_cast<std::int64_t>(row.id); }
Field real(const std::optional<double>& value) { return value ? Field(*value) : Field(); }

constexpr Column<Row> kTail[] = {
    {"area_px", FieldType::kInteger, false, "pixels; 0: not seen from above, and then the rest is null",
     [](const Row& r) -> Field { return r.shape ? static_cast<std::int64_t>(r.shape->area_px) : std::int64_t{0}; }},
    {"area_um2", FieldType::kNumber, true, "null without a scale",
     [](const Row& r) -> Field { return scaled(r, 2, [](const Shape& s) { return static_cast<double>(s.area_px); }); }},
    {"perimeter_px", FieldType::kNumber, true, "Crofton's formula, four directions",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.perimeter_px; }); }},
    {"perimeter_um", FieldType::kNumber, true, "null without a scale",
     [](const Row& r) -> Field { return scaled(r, 1, [](const Shape& s) { return s.perimeter_px; }); }},
    {"circularity", FieldType::kNumber, true, "4 pi area / perimeter^2: 1 for a disc",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.circularity; }); }},
    {"solidity", FieldType::kNumber, true, "area / area of the convex hull",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.solidity; }); }},
    {"eccentricity", FieldType::kNumber, true, "of the second moments: 0 for a disc",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.eccentricity; }); }},
    {"neighbour_count", FieldType::kInteger, true, "cells with a common border of two pixel edges or more",
     [](const Row& r) -> Field { return r.shape ? Field(static_cast<std::int64_t>(r.neighbour_count)) : Field(); }},
    {"is_interior", FieldType::kBoolean, true, "beside neither outside nor frame: its neighbours are all there",
     [](const Row& r) -> Field { return r.shape ? Field(r.is_interior) : Field(); }},
    {"at_frame", FieldType::kBoolean, true, "may be cut by the picture's edge",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.at_frame; }); }},
    {"centre_x_px", FieldType::kNumber, true, "centre of mass, from the left edge of the picture",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.centre_x_px; }); }},
    {"centre_y_px", FieldType::kNumber, true, "from its upper edge, downwards",
     [](const Row& r) -> Field { return of(r, [](const Shape& s) { return s.centre_y_px; }); }},
};

constexpr Column<Row> kPlace[] = {
    {"centre_x_um", FieldType::kNumber, true, "the same in the dish", [](const Row& r) -> Field { return real(r.x_um); }},
    {"centre_y_um", FieldType::kNumber, true, "the same in the dish, upwards", [](const Row& r) -> Field { return real(r.y_um); }},
};

std::vector<Column<Row>> joined(const Column<Row>& id, bool has_place) {
  std::vector<Column<Row>> columns{id};
  columns.insert(columns.end(), std::begin(kTail), std::end(kTail));
  if (has_place) columns.insert(columns.end(), std::begin(kPlace), std::end(kPlace));
  return columns;
}

}  // namespace

std::span<const Column<ShapeRow>> cell_shape_columns() {
  static const std::vector<Column<Row>> columns = joined({"cell_id", FieldType::kInteger, false, "as everywhere", &id_of}, true);
  return columns;
}

std::span<const Column<ShapeRow>> object_shape_columns() {
  static const std::vector<Column<Row>> columns =
      joined({"object_id", FieldType::kInteger, false, "number of the object, from 1, by its first pixel", &id_of}, false);
  return columns;
}

Result<std::vector<ShapeRow>> shape_rows(const LabelImage& labels) {
  Result<std::vector<Shape>> shapes = cell_shapes(labels);
  if (!shapes) return shapes.error();
  const Result<Contacts> contacts = find_contacts(labels);
  if (!contacts) return contacts.error();
  std::vector<ShapeRow> rows;
  for (std::size_t i = 0; i < shapes->size(); ++i) {
    const CellContacts& around = contacts->cells[i];  // both by rising label
    CHECK(around.label == (*shapes)[i].label);
    rows.push_back({around.label, (*shapes)[i], around.neighbour_count, around.interior, labels.um_per_px, {}, {}});
  }
  return rows;
}

Result<std::vector<ShapeRow>> shape_rows(const LabelImage& labels, const Colony& colony, double left_um, double top_um) {
  Result<std::vector<ShapeRow>> seen = shape_rows(labels);
  if (!seen) return seen.error();
  const double um_per_px = labels.um_per_px.value_or(0.0);
  std::vector<ShapeRow> rows;
  std::size_t next = 0;
  for (const Cell& cell : colony.cells()) {  // by rising id
    if (next < seen->size() && (*seen)[next].id == cell.id.value) {
      ShapeRow& row = (*seen)[next++];
      row.x_um = left_um + row.shape->centre_x_px * um_per_px;
      row.y_um = top_um - row.shape->centre_y_px * um_per_px;
      rows.push_back(std::move(row));
    } else {
      rows.push_back({cell.id.value, {}, 0, false, labels.um_per_px, {}, {}});
    }
  }
  CHECK(next == seen->size());
  return rows;
}

std::string shape_csv(std::span<const Column<ShapeRow>> columns, const std::vector<ShapeRow>& rows) {
  std::string out;
  append_csv_header(out, columns);
  for (const ShapeRow& row : rows) append_csv_row(out, columns, row);
  return out;
}

}  // namespace colony::server::api
