#include "engine/analysis/report.hpp"

#include <cmath>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/reason.hpp"
#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {

MeasuredLine measure_line(const Result<BinaryImage>& line, const BoxOptions& boxes, StopFlag stop) {
  if (!line) return {{}, reason_of(line.error())};
  Result<BoxDimensions> dimensions = box_dimensions(*line, boxes, stop);
  if (!dimensions) return {{}, reason_of(dimensions.error())};
  return {std::move(*dimensions), {}};
}

std::string_view name_of(ObjectKind kind) {
  constexpr std::string_view kNames[] = {"cells", "nuclei", "regions", "objects"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view singular_of(ObjectKind kind) {
  constexpr std::string_view kNames[] = {"cell", "nucleus", "region", "object"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view name_of(Placement placement) {
  constexpr std::string_view kNames[] = {"same_places", "touching", "spread"};
  return kNames[static_cast<std::size_t>(placement)];
}

LineNames line_names(ObjectKind kind) {
  if (kind == ObjectKind::kCells) return {"cell walls", "colony outline"};
  return {"outlines of the " + std::string(name_of(kind)), "outer outline"};
}

LineFindings judge_lines(const LineReport& lines, const std::vector<ControlReport>& controls, ObjectKind kind) {
  std::vector<NamedLine> walls, outlines;
  for (const ControlReport& control : controls) {
    walls.push_back({control.name, &control.lines.walls});
    outlines.push_back({control.name, &control.lines.outline});
  }
  const LineNames names = line_names(kind);
  return {judge_line(names.walls, lines.walls, walls), judge_line(names.outline, lines.outline, outlines)};
}

std::vector<std::string> sentences_of(const LineFindings& findings) {
  std::vector<std::string> sentences = findings.walls.sentences;
  sentences.insert(sentences.end(), findings.outline.sentences.begin(), findings.outline.sentences.end());
  return sentences;
}

void set_object_count(std::uint64_t count, LineReport& lines, std::vector<ControlReport>& controls) {
  lines.walls.object_count = lines.outline.object_count = count;
  for (ControlReport& control : controls) control.lines.walls.object_count = control.lines.outline.object_count = count;
}

LineReport analyse_lines(const LabelImage& labels, std::int64_t gap_px, const BoxOptions& boxes, StopFlag stop) {
  LineReport report;
  report.walls = measure_line(cell_walls(labels), boxes, stop);
  report.outline = measure_line(colony_outline(labels, gap_px), boxes, stop);
  return report;
}

LineReport analyse_lines_like(const LineReport& like, const LabelImage& labels, const BoxOptions& boxes, StopFlag stop) {
  const auto count = [&](const Result<BinaryImage>& line, const MeasuredLine& beside) {
    BoxOptions same = boxes;
    if (line && beside.dimensions) {
      same.sides_px.clear();
      for (const BoxCount& box : beside.dimensions->counts) same.sides_px.push_back(box.side_px);
      same.part = foreground_box(*line);  // the grid begins where it always does: the same set has the same counts
    }
    return measure_line(line, same, stop);
  };
  return {count(cell_walls(labels), like.walls), count(colony_outline(labels), like.outline)};
}

MeasuredLine up_to(const MeasuredLine& line, std::int64_t side_max_px) {
  if (!line.dimensions) return line;
  const BoxDimensions& all = *line.dimensions;
  std::vector<BoxCount> counts;
  for (const BoxCount& count : all.counts) {
    if (count.side_px <= side_max_px) counts.push_back(count);
  }
  if (counts.size() < kSidesMin) {
    return {{}, "boxes up to " + std::to_string(side_max_px) + " px leave " + std::to_string(counts.size()) + " sides; at least " +
                    std::to_string(kSidesMin) + " are needed", line.object_count};
  }
  BoxDimensions part = fit_dimensions(std::move(counts));
  part.part = all.part;
  part.foreground_px = all.foreground_px;
  return {std::move(part), {}, line.object_count};
}

MatchedControls matched_controls(const LabelImage& labels, const LineReport& lines, Seed seed, const BoxOptions& boxes, StopFlag stop) {
  const std::vector<LabelArea> areas = label_areas(labels);
  const Hull hull = hull_of(labels);
  MatchedControls out;
  std::uint64_t covered = 0;
  for (const LabelArea& area : areas) covered += area.area_px;
  if (hull.area_px > 0) out.cover = static_cast<double>(covered) / static_cast<double>(hull.area_px);
  const bool is_tiled = out.cover >= kTilingCover;
  const auto add = [&](const char* name, const Result<LabelImage>& control) {
    const MeasuredLine none{{}, control ? std::string() : reason_of(control.error())};
    out.reports.push_back({name, control ? analyse_lines_like(lines, *control, boxes, stop) : LineReport{none, none},
                           is_tiled ? Placement::kTouching : Placement::kSpread});
  };
  add("hexagonal", is_tiled ? hexagonal_control(areas, labels.um_per_px) : hexagonal_control(areas, hull, labels.um_per_px));
  add("random_discs", is_tiled ? random_disc_control(areas, seed, labels.um_per_px) : random_disc_control(areas, hull, seed, labels.um_per_px));
  return out;
}

std::vector<std::string> control_sentences(ObjectKind kind, double cover, std::uint64_t object_count) {
  const std::string names(name_of(kind));
  if (kind != ObjectKind::kRegions && object_count < kObjectsMin) {
    return {"Controls of fewer than " + std::to_string(kObjectsMin) + " " + names + " show nothing: they are as few discs."};
  }
  const std::string share = "The " + names + " cover " + decimals(cover) + " of their convex hull";
  if (cover >= kTilingCover) {
    return {share + ": they tile it, so the controls hexagonal and random_discs are as many discs of their size packed together."};
  }
  return {share + ": they stand apart, so the controls hexagonal and random_discs are as many discs of their size spread over this hull, in the same "
                  "frame and counted with the same boxes.",
          "What is counted as walls are the outlines of single " + names + ", hardly ever a border that two " +
              (kind == ObjectKind::kCells ? "cells" : "of them") + " share."};
}

namespace {

std::string counted(std::uint64_t count, ObjectKind kind) {
  return std::to_string(count) + " " + std::string(count == 1 ? singular_of(kind) : name_of(kind));
}

/// Counts what is seen, and takes what is mostly hidden out of the means.
void mark_hidden(const LabelInput& input, LabelReport& report) {
  report.visible_count = report.shapes.size();
  report.cell_count = input.whole ? input.whole->size() : report.visible_count;
  std::size_t at = 0;
  for (Shape& shape : report.shapes) {
    if (input.whole) {
      while (at < input.whole->size() && (*input.whole)[at].label < shape.label) ++at;
      CHECK(at < input.whole->size() && (*input.whole)[at].label == shape.label);
      if (static_cast<double>(shape.area_px) < kSeenShareMin * static_cast<double>((*input.whole)[at].area_px)) {
        ++report.partly_hidden_count;
        shape.is_measured = false;
      }
    }
    report.measured_count += shape.is_measured ? 1 : 0;
  }
}

/// Sides are those of cells of a sheet: empty, or why these are not.
std::string sides_reason(const LabelReport& report) {
  if (report.objects != ObjectKind::kCells) return "the table is of cells, and these are " + std::string(name_of(report.objects));
  if (report.visible_count < kObjectsMin) return "fewer than " + std::to_string(kObjectsMin) + " cells are seen";
  const std::uint64_t hidden = report.cell_count - report.visible_count;
  if (hidden == 0 && static_cast<double>(report.partly_hidden_count) <= kSheetHiddenMax * static_cast<double>(report.visible_count)) return {};
  return "the table is of a sheet, in which every cell is seen: of " + counted(report.cell_count, report.objects) + " here " + (hidden == 0 ? std::string("none") : std::to_string(hidden)) +
         (hidden <= 1 ? " is" : " are") + " hidden, and " + std::to_string(report.partly_hidden_count) + (report.partly_hidden_count == 1 ? " is" : " are") + " by more than half";
}

}  // namespace

std::vector<std::string> hidden_sentences(const LabelReport& report) {
  std::vector<std::string> sentences;
  const std::uint64_t hidden = report.cell_count - report.visible_count;
  if (hidden > 0) {
    sentences.push_back("Of the colony's " + counted(report.cell_count, report.objects) + ", " + std::to_string(hidden) + (hidden == 1 ? " is" : " are") +
                        " hidden under others: the figures of the picture are about the " + std::to_string(report.visible_count) + " that are seen from above.");
  }
  if (report.partly_hidden_count > 0) {
    sentences.push_back("Of " + counted(report.partly_hidden_count, report.objects) + " less than half is seen: what is left of them is in no mean of size and shape.");
  }
  return sentences;
}

Result<LabelReport> analyse_labels(const LabelInput& input, StopFlag stop) {
  CHECK(input.labels != nullptr);
  if (const Status status = check_box_options(input.boxes); !status) return status.error();
  const LabelImage& labels = *input.labels;
  LabelReport report;
  report.um_per_px = labels.um_per_px;
  report.objects = input.objects;
  Result<std::vector<Shape>> shapes = cell_shapes(labels, stop);
  if (!shapes) return shapes.error();
  report.shapes = std::move(*shapes);
  mark_hidden(input, report);
  Result<Contacts> contacts = find_contacts(labels, input.gap_px, stop);
  if (!contacts) return contacts.error();
  report.contacts = std::move(*contacts);
  const Result<ColonyShape> colony = colony_shape(labels, input.gap_px, stop);
  if (!colony) return colony.error();
  report.colony = *colony;
  Result<std::vector<Ring>> rings = radial_profile(labels, report.shapes, input.active, input.ring_count, stop);
  if (!rings) return rings.error();
  report.rings = std::move(*rings);
  report.sides = side_statistics(report.contacts);
  report.apart = apart_cells(report.shapes, report.contacts);
  if (input.siblings) report.siblings = sibling_straightness(report.contacts, *input.siblings);
  report.cell_area_mean_px = static_cast<double>(report.colony.covered_px) / static_cast<double>(report.visible_count);
  report.px_per_cell_diameter = 2.0 * std::sqrt(report.cell_area_mean_px / maths::kPi);
  Result<ClosedSides> closed = closed_sides(labels, report.cell_area_mean_px, input.gap_px, stop);
  if (!closed) return closed.error();
  report.closed_sides = std::move(*closed);

  report.lines = analyse_lines(labels, input.gap_px, input.boxes, stop);
  if (input.without_noise != nullptr) {
    report.controls.push_back({"without_noise", analyse_lines_like(report.lines, *input.without_noise, input.boxes, stop), Placement::kSamePlaces});
  }
  MatchedControls matched = matched_controls(labels, report.lines, input.control_seed, input.boxes, stop);
  for (ControlReport& control : matched.reports) report.controls.push_back(std::move(control));
  report.object_cover = matched.cover;
  if (input.objects != ObjectKind::kRegions) set_object_count(report.visible_count, report.lines, report.controls);

  report.findings = judge_lines(report.lines, report.controls, input.objects);
  report.verdict = hidden_sentences(report);
  for (std::string& sentence : sentences_of(report.findings)) report.verdict.push_back(std::move(sentence));
  report.sides_reason = sides_reason(report);
  if (report.sides_reason.empty()) {
    for (std::string& sentence : judge_sides(report.sides, report.closed_sides)) report.verdict.push_back(std::move(sentence));
  } else if (input.objects == ObjectKind::kCells) {
    report.verdict.push_back("The sides of the cells are not held against Gibson's table: " + report.sides_reason + ".");
  }
  for (std::string& sentence : control_sentences(input.objects, matched.cover, report.visible_count)) report.verdict.push_back(std::move(sentence));
  return report;
}

}  // namespace colony
