#include "engine/analysis/report.hpp"

#include <cmath>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/controls.hpp"
#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {

MeasuredLine measure_line(const Result<BinaryImage>& line, const BoxOptions& boxes, StopFlag stop) {
  if (!line) return {{}, line.error().message};
  Result<BoxDimensions> dimensions = box_dimensions(*line, boxes, stop);
  if (!dimensions) return {{}, dimensions.error().message};
  return {std::move(*dimensions), {}};
}

LineFindings judge_lines(const LineReport& lines, const std::vector<ControlReport>& controls) {
  std::vector<NamedLine> walls, outlines;
  for (const ControlReport& control : controls) {
    walls.push_back({control.name, &control.lines.walls});
    outlines.push_back({control.name, &control.lines.outline});
  }
  return {judge_line("cell walls", lines.walls, walls), judge_line("colony outline", lines.outline, outlines)};
}

std::vector<std::string> sentences_of(const LineFindings& findings) {
  std::vector<std::string> sentences = findings.walls.sentences;
  sentences.insert(sentences.end(), findings.outline.sentences.begin(), findings.outline.sentences.end());
  return sentences;
}

LineReport analyse_lines(const LabelImage& labels, std::int64_t gap_px, const BoxOptions& boxes, StopFlag stop) {
  LineReport report;
  report.walls = measure_line(cell_walls(labels), boxes, stop);
  report.outline = measure_line(colony_outline(labels, gap_px), boxes, stop);
  return report;
}

Result<LabelReport> analyse_labels(const LabelInput& input, StopFlag stop) {
  CHECK(input.labels != nullptr);
  if (const Status status = check_box_options(input.boxes); !status) return status.error();
  const LabelImage& labels = *input.labels;
  LabelReport report;
  report.um_per_px = labels.um_per_px;
  Result<std::vector<Shape>> shapes = cell_shapes(labels);
  if (!shapes) return shapes.error();
  report.shapes = std::move(*shapes);
  Result<Contacts> contacts = find_contacts(labels, input.gap_px);
  if (!contacts) return contacts.error();
  report.contacts = std::move(*contacts);
  const Result<ColonyShape> colony = colony_shape(labels, input.gap_px);
  if (!colony) return colony.error();
  report.colony = *colony;
  Result<std::vector<Ring>> rings = radial_profile(labels, report.shapes, input.active, input.ring_count);
  if (!rings) return rings.error();
  report.rings = std::move(*rings);
  report.sides = side_statistics(report.contacts);
  report.apart = apart_cells(report.shapes, report.contacts);
  if (input.siblings) report.siblings = sibling_straightness(report.contacts, *input.siblings);
  report.cell_count = report.shapes.size();
  report.cell_area_mean_px = static_cast<double>(report.colony.covered_px) / static_cast<double>(report.cell_count);
  report.px_per_cell_diameter = 2.0 * std::sqrt(report.cell_area_mean_px / maths::kPi);

  report.lines = analyse_lines(labels, input.gap_px, input.boxes, stop);
  if (input.without_noise != nullptr) {
    report.controls.push_back({"without_noise", analyse_lines(*input.without_noise, 0, input.boxes, stop)});
  }
  const std::vector<LabelArea> areas = label_areas(labels);
  const auto add_control = [&](const std::string& name, const Result<LabelImage>& control) {
    if (control) {
      report.controls.push_back({name, analyse_lines(*control, 0, input.boxes, stop)});
    } else {
      report.controls.push_back({name, {{{}, control.error().message}, {{}, control.error().message}}});
    }
  };
  add_control("hexagonal", hexagonal_control(areas, labels.um_per_px));
  add_control("random_discs", random_disc_control(areas, input.control_seed, labels.um_per_px));

  report.findings = judge_lines(report.lines, report.controls);
  report.verdict = sentences_of(report.findings);
  return report;
}

}  // namespace colony
