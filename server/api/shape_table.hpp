// shape_table: the objects of a label image a line each, as CSV or JSON: cells of a colony as they are seen from above, objects of a picture.
// Columns: one table for both; the identity is `cell_id` or `object_id`, and a place in um is that of the dish, which a picture does not have.
// Units:   pixels, and um where the image has a scale (else null).
// Errors:  those of cell_shapes and find_contacts.     Threads: pure.
#pragma once

#include <vector>

#include "engine/analysis/morphology.hpp"
#include "engine/model/colony.hpp"
#include "server/api/columns.hpp"

namespace colony::server::api {

struct ShapeRow {
  std::uint32_t id = 0;
  std::optional<Shape> shape;            // none: the cell cannot be seen from above
  std::uint32_t neighbour_count = 0;
  bool is_interior = false;
  std::optional<double> um_per_px;
  std::optional<double> x_um, y_um;      // of the dish
};

std::span<const Column<ShapeRow>> cell_shape_columns();
std::span<const Column<ShapeRow>> object_shape_columns();

/// By rising label.
Result<std::vector<ShapeRow>> shape_rows(const LabelImage& labels);
/// One for every cell of the colony, seen or not; left_um and top_um are those of the image's upper left corner.
Result<std::vector<ShapeRow>> shape_rows(const LabelImage& labels, const Colony& colony, double left_um, double top_um);

std::string shape_csv(std::span<const Column<ShapeRow>> columns, const std::vector<ShapeRow>& rows);

}  // namespace colony::server::api
