#include "engine/analysis/report.hpp"

#include <cmath>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/controls.hpp"
#include "engine/analysis/reason.hpp"
#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

MeasuredLine measure(const Result<BinaryImage>& line, const BoxOptions& boxes, StopFlag stop) {
  if (!line) return {{}, reason_of(line.error())};
  Result<BoxDimensions> dimensions = box_dimensions(*line, boxes, stop);
  if (!dimensions) return {{}, reason_of(dimensions.error())};
  return {std::move(*dimensions), {}};
}

/// Two decimals, without a locale.
std::string decimals(double value) {
  const auto hundredths = static_cast<std::int64_t>(std::abs(value) * 100.0 + 0.5);
  const std::string rest = std::to_string(hundredths % 100);
  return (value < 0.0 && hundredths > 0 ? "-" : "") + std::to_string(hundredths / 100) + (rest.size() < 2 ? ".0" : ".") + rest;
}

std::string described(const BoxDimensions& found) {
  return "D0 = " + decimals(found.capacity.value) + " (standard error of the line " + decimals(found.capacity.standard_error) +
         ", smallest cover " + decimals(found.smallest_cover.value) + ") for boxes of " + std::to_string(found.side_min_px) + " to " +
         std::to_string(found.side_max_px) + " px";
}

void judge_line(const std::string& name, const MeasuredLine& line, std::vector<std::string>& verdict) {
  if (!line.dimensions) {
    verdict.push_back("The " + name + " has no dimension here: " + line.reason + ".");
    return;
  }
  const BoxDimensions& found = *line.dimensions;
  if (found.crossover.found) {
    verdict.push_back("The " + name + ": crossover, not scaling. The local slope drifts by " + decimals(found.crossover.drift) +
                      " over the range, so the slope of the line, " + described(found) + ", is no dimension.");
  } else {
    verdict.push_back("The " + name + ": " + described(found) + ", without a drift of the local slopes. This does not prove self-similarity: " +
                      "the range is " + decimals(maths::log(static_cast<double>(found.side_max_px) / static_cast<double>(found.side_min_px)) /
                                                 maths::log(10.0)) + " decades.");
  }
}

/// A difference within twice the two standard errors, or within the bias that generic boxes have, is none.
void judge_control(const std::string& name, const MeasuredLine& line, const MeasuredLine& control, const std::string& control_name,
                   std::vector<std::string>& verdict) {
  if (!line.dimensions || !control.dimensions) return;
  constexpr double kBias = 0.05;
  const Dimension& a = line.dimensions->capacity;
  const Dimension& b = control.dimensions->capacity;
  const double error = std::sqrt(a.standard_error * a.standard_error + b.standard_error * b.standard_error);
  const double difference = a.value - b.value;
  const bool same = std::abs(difference) <= std::max(2.0 * error, kBias);
  verdict.push_back("The control " + control_name + " has " + decimals(b.value) + " for its " + name + ": " +
                    (same ? "no difference that box counting could show."
                          : "a difference of " + decimals(difference) + ", more than errors and bias."));
}

}  // namespace

LineReport analyse_lines(const LabelImage& labels, std::int64_t gap_px, const BoxOptions& boxes, StopFlag stop) {
  LineReport report;
  report.walls = measure(cell_walls(labels), boxes, stop);
  report.outline = measure(colony_outline(labels, gap_px), boxes, stop);
  return report;
}

Result<LabelReport> analyse_labels(const LabelInput& input, StopFlag stop) {
  CHECK(input.labels != nullptr);
  if (const Status status = check_box_options(input.boxes); !status) return status.error();
  const LabelImage& labels = *input.labels;
  LabelReport report;
  report.um_per_px = labels.um_per_px;
  Result<std::vector<Shape>> shapes = cell_shapes(labels, stop);
  if (!shapes) return shapes.error();
  report.shapes = std::move(*shapes);
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
  report.cell_count = report.shapes.size();
  report.cell_area_mean_px = static_cast<double>(report.colony.covered_px) / static_cast<double>(report.cell_count);
  report.px_per_cell_diameter = 2.0 * std::sqrt(report.cell_area_mean_px / maths::kPi);
  Result<ClosedSides> closed = closed_sides(labels, report.cell_area_mean_px, input.gap_px, stop);
  if (!closed) return closed.error();
  report.closed_sides = std::move(*closed);

  report.lines = analyse_lines(labels, input.gap_px, input.boxes, stop);
  if (input.without_noise != nullptr) {
    report.controls.push_back({"without_noise", analyse_lines(*input.without_noise, 0, input.boxes, stop)});
  }
  const std::vector<LabelArea> areas = label_areas(labels);
  const auto add_control = [&](const std::string& name, const Result<LabelImage>& control) {
    if (control) {
      report.controls.push_back({name, analyse_lines(*control, 0, input.boxes, stop)});
    } else {
      report.controls.push_back({name, {{{}, reason_of(control.error())}, {{}, reason_of(control.error())}}});
    }
  };
  add_control("hexagonal", hexagonal_control(areas, labels.um_per_px));
  add_control("random_discs", random_disc_control(areas, input.control_seed, labels.um_per_px));

  judge_line("cell walls", report.lines.walls, report.verdict);
  for (const ControlReport& control : report.controls) {
    judge_control("cell walls", report.lines.walls, control.lines.walls, control.name, report.verdict);
  }
  judge_line("colony outline", report.lines.outline, report.verdict);
  for (const ControlReport& control : report.controls) {
    judge_control("colony outline", report.lines.outline, control.lines.outline, control.name, report.verdict);
  }
  for (std::string& sentence : judge_sides(report.sides, report.closed_sides)) report.verdict.push_back(std::move(sentence));
  return report;
}

Result<ThresholdSweep> threshold_sweep(const GreyImage& image, const std::vector<int>& thresholds, bool dark_foreground,
                                       const BoxOptions& boxes, StopFlag stop) {
  if (const Status status = check_image(image, "image"); !status) return status.error();
  if (const Status status = check_box_options(boxes); !status) return status.error();
  const auto wrong = [](const std::string& message) {
    return Error{ErrorCode::kInvalid, "thresholds: " + message, {{"thresholds", message}}};
  };
  if (thresholds.empty() || thresholds.size() > 64) return wrong("between 1 and 64 of them");
  for (std::size_t i = 0; i < thresholds.size(); ++i) {
    if (thresholds[i] < 1 || thresholds[i] > 255) return wrong("must lie in 1..255");
    if (i > 0 && thresholds[i] <= thresholds[i - 1]) return wrong("must rise");
  }
  BoxOptions options = boxes;
  if (options.sides_px.empty()) {
    options.sides_px = geometric_sides(std::max(image.width_px, image.height_px), options);
    if (options.sides_px.size() < kSidesMin) {
      const std::string message = std::to_string(image.width_px) + " x " + std::to_string(image.height_px) +
                                  " pixels leave fewer than " + std::to_string(kSidesMin) + " box sides";
      return Error{ErrorCode::kInvalid, "image: " + message, {{"image", message}}};
    }
  }
  ThresholdSweep sweep;
  sweep.sides_px = options.sides_px;
  BinaryImage mask(image.width_px, image.height_px, image.um_per_px);
  for (const int threshold : thresholds) {
    ThresholdRow row;
    row.threshold = threshold;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < mask.values.size(); ++i) {
      const bool set = (image.values[i] < threshold) == dark_foreground;
      mask.values[i] = set ? 255 : 0;
      count += set ? 1 : 0;
    }
    row.foreground_share = static_cast<double>(count) / static_cast<double>(mask.values.size());
    if (count == mask.values.size()) {
      row.set.reason = row.boundary.reason = "the image is nothing but foreground: there is no structure to measure";
    } else {
      row.set = measure(mask, options, stop);
      row.boundary = measure(boundary_of(mask), options, stop);
    }
    sweep.rows.push_back(std::move(row));
  }
  return sweep;
}

}  // namespace colony
