#include "engine/analysis/segment.hpp"

#include <algorithm>

#include "engine/analysis/filters.hpp"
#include "engine/analysis/split.hpp"

namespace colony {
namespace {

constexpr std::int64_t kSweepStep = 4;
constexpr std::int64_t kSweepSide = 4;  // levels on each side of the threshold
constexpr std::int64_t kAreaMedianPart = 8;
constexpr std::int64_t kBackgroundReachMin_px = 15;
constexpr std::int64_t kSmallestPiece_px =
    5;                                    // not asked when the median piece is: single hot pixels would be the median
constexpr std::int64_t kHoleWindows = 4;  // phase
// A local deviation below one grey level is no more than rounding: there the picture is clipped or empty (the black about a dish), and says nothing about
// where noise ends and cells begin. In the signal that is level 36; Otsu looks above.
constexpr int kOneLevelOfDeviation = 37;

Error wrong(const std::string& field, std::string message) {
  return {ErrorCode::kInvalid, field + ": " + message, {{field, std::move(message)}}};
}

Status check_options(const GreyImage& image, const SegmentOptions& options) {
  if (Status status = check_image(image, "image"); !status) return status;
  const auto range = [](const std::string& field, std::int64_t value, std::int64_t low, std::int64_t high) -> Status {
    if (value >= low && value <= high) return Ok{};
    return wrong(field, "must be between " + std::to_string(low) + " and " + std::to_string(high));
  };
  const std::int64_t all = kImageSideMax_px * kImageSideMax_px;
  for (const Status& status :
       {range("threshold", options.threshold.value_or(0), 0, 254),
        range("background_reach_px", options.background_reach_px.value_or(3), 3, kImageSideMax_px),
        range("window_radius_px", options.window_radius_px, 1, 50),
        range("area_min_px", options.area_min_px.value_or(1), 1, all),
        range("hole_max_px", options.hole_max_px.value_or(0), 0, all)}) {
    if (!status) return status;
  }
  return Ok{};
}

/// The grey level below which `per_thousand` of the pixels lie.
int level_at(const std::array<std::int64_t, 256>& counts, std::int64_t pixel_count, std::int64_t per_thousand) {
  std::int64_t seen = 0;
  for (int v = 0; v < 256; ++v) {
    seen += counts[static_cast<std::size_t>(v)];
    if (seen * 1000 > pixel_count * per_thousand) return v;
  }
  return 255;
}

struct Look {
  int dark = 0, middle = 0, light = 0;  // levels at 1, 50 and 99 %
  std::int64_t level_count = 0;
};

Look look_at(const GreyImage& image) {
  const auto counts = histogram(image);
  const auto pixels = static_cast<std::int64_t>(image.values.size());
  return {level_at(counts, pixels, 10), level_at(counts, pixels, 500), level_at(counts, pixels, 990),
          std::count_if(counts.begin(), counts.end(), [](std::int64_t count) { return count > 0; })};
}

/// Lines: two levels, and the rarer one vanishes where a disc of radius 2 must fit.
bool is_drawing(const GreyImage& image, const Look& look) {
  if (look.level_count != 2) return false;
  const GreyImage light = above(image, otsu(image));
  const auto counts = histogram(light);
  const BinaryImage ink = counts[255] <= counts[0] ? light : inverted(light);
  const std::int64_t before = histogram(ink)[255], after = histogram(opened(ink, 2))[255];
  return 10 * after < before;
}

struct Choice {
  Pipeline pipeline = Pipeline::kAuto;
  std::string reason;
};

/// Fluorescence and stains leave the background at one end of the histogram, phase contrast in its middle.
Choice choose_pipeline(const GreyImage& image, const Look& look) {
  if (is_drawing(image, look)) return {Pipeline::kContours, "chosen: two levels, and the rarer one is thin lines: a drawing"};
  const int up = look.light - look.middle, down = look.middle - look.dark;
  const std::string levels = " (grey levels at 1, 50 and 99 % of the pixels: " + std::to_string(look.dark) + ", " +
                             std::to_string(look.middle) + ", " + std::to_string(look.light) + ")";
  if (std::max(up, down) > 3 * std::min(up, down)) {
    return {Pipeline::kNuclei, "chosen: most pixels are an even ground at one end of the histogram, as with a stain" + levels +
                                   ". Whether it stains nuclei no histogram tells: of actin, membranes and other stains the objects are "
                                   "no cells, and pipeline=phase finds regions of cells instead"};
  }
  return {Pipeline::kPhase, "chosen: the ground lies in the middle of the histogram, darker and lighter things on both sides, as with phase "
                            "contrast" + levels + ". It finds regions of cells; pipeline=nuclei finds single stained objects"};
}

std::string foreground_reason(const Look& look, bool is_dark) {
  return std::string("chosen: the ") + (is_dark ? "dark" : "light") + " end of the histogram lies further from its middle than the other (" +
         std::to_string(look.dark) + ", " + std::to_string(look.middle) + ", " + std::to_string(look.light) + ")";
}

std::int64_t count_above(const BinaryImage& mask) {
  return static_cast<std::int64_t>(mask.values.size()) - histogram(mask)[0];
}

/// What a dish's wall encloses, or nothing: a piece that spans six tenths of both sides, fills less than a quarter of its box and encloses a third.
std::optional<BinaryImage> dish_inside(const BinaryImage& mask) {
  const Pieces found = pieces_of(mask);
  for (std::size_t i = 0; i < found.pieces.size(); ++i) {
    const Piece& piece = found.pieces[i];
    const std::int64_t box_px = piece.width * piece.height;
    if (10 * piece.width < 6 * mask.width_px || 10 * piece.height < 6 * mask.height_px || 4 * piece.area_px > box_px)
      continue;
    BinaryImage wall(mask.width_px, mask.height_px, mask.um_per_px);
    for (std::size_t k = 0; k < wall.values.size(); ++k) wall.values[k] = found.labels.values[k] == i + 1 ? 255 : 0;
    BinaryImage inside = holes_filled(wall, static_cast<std::int64_t>(wall.values.size()));
    for (std::size_t k = 0; k < wall.values.size(); ++k)
      inside.values[k] = inside.values[k] != 0 && wall.values[k] == 0 ? 255 : 0;
    // The field is the largest enclosed part: a wall has pockets of its own.
    const Pieces parts = pieces_of(inside);
    const auto largest = std::max_element(parts.pieces.begin(), parts.pieces.end(),
                                          [](const Piece& a, const Piece& b) { return a.area_px < b.area_px; });
    if (largest == parts.pieces.end() || 3 * largest->area_px < box_px) continue;
    const auto label = static_cast<std::uint32_t>(largest - parts.pieces.begin() + 1);
    for (std::size_t k = 0; k < inside.values.size(); ++k) inside.values[k] = parts.labels.values[k] == label ? 255 : 0;
    return inside;
  }
  return std::nullopt;
}

/// From the signal to objects, at one threshold; the sweep goes the same way.
struct Objects {
  BinaryImage raw, mask;
  std::optional<BinaryImage> field;
  Grey16Image distance;
  LabelImage labels;
  std::vector<std::int64_t> areas_px;
  std::int64_t area_min_px = 0;
};

std::int64_t median_area(const Pieces& found) {
  std::vector<std::int64_t> areas;
  for (const Piece& piece : found.pieces) {
    if (piece.area_px >= kSmallestPiece_px) areas.push_back(piece.area_px);
  }
  if (areas.empty()) return 0;
  const auto middle = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2);
  std::nth_element(areas.begin(), middle, areas.end());
  return *middle;
}

Objects objects_at(const GreyImage& signal, int threshold, Pipeline pipeline, const SegmentOptions& options) {
  const bool phase = pipeline == Pipeline::kPhase;
  const std::int64_t window = 2 * options.window_radius_px + 1;
  Objects result;
  result.raw = above(signal, threshold);
  BinaryImage mask = result.raw;
  result.field = dish_inside(mask);
  if (result.field) {
    const BinaryImage& inside = *result.field;
    for (std::size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = inside.values[i] != 0 ? mask.values[i] : 0;
  }
  Pieces found;
  if (phase) {
    result.area_min_px = options.area_min_px.value_or(window * window / 2);
    mask = eroded(holes_filled(mask, options.hole_max_px.value_or(kHoleWindows * window * window)),
                  options.window_radius_px);
    found = pieces_of(mask);
  } else {
    // A hole as large as an object is one between nuclei: filled, it would hide that they are several.
    const std::int64_t least = std::max(median_area(pieces_of(mask)) / kAreaMedianPart, kSmallestPiece_px);
    result.area_min_px = options.area_min_px.value_or(least);
    mask = holes_filled(mask, options.hole_max_px.value_or(least));
    found = pieces_of(mask);
  }
  if (!phase && options.split) {
    // Small pieces go before parting (dirt), and what parting cut off goes after it.
    const LabelImage large = renumbered(found.labels, result.area_min_px, nullptr);
    for (std::size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = large.values[i] != 0 ? 255 : 0;
    result.distance = distance_inside(mask);
    result.labels =
        renumbered(split_touching(result.distance, result.area_min_px), result.area_min_px, &result.areas_px);
  } else {
    result.labels = renumbered(found.labels, result.area_min_px, &result.areas_px);
  }
  for (std::size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = result.labels.values[i] != 0 ? 255 : 0;
  result.mask = std::move(mask);
  return result;
}

class Steps {
 public:
  Steps(const SegmentOptions& options, std::vector<StepImage>& steps) : options_(options), steps_(steps) {}
  /// The one step that was asked for is there: nothing else is.
  bool is_complete() const { return !options_.keep_only.empty() && !steps_.empty(); }
  bool wants(const std::string& name) const {
    return options_.keep_steps && (options_.keep_only.empty() || options_.keep_only == name);
  }
  void add(const std::string& name, const std::string& text, const GreyImage& image) {
    if (wants(name)) steps_.push_back({name, text, image.width_px, image.height_px, 1, image.values});
  }
  void add(StepImage step) {
    if (wants(step.name)) steps_.push_back(std::move(step));
  }

 private:
  const SegmentOptions& options_;
  std::vector<StepImage>& steps_;
};

GreyImage shown(const Grey16Image& distance) {
  GreyImage image(distance.width_px, distance.height_px, distance.um_per_px);
  const std::int64_t most =
      std::max<std::int64_t>(1, *std::max_element(distance.values.begin(), distance.values.end()));
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<std::uint8_t>(distance.values[i] * 255 / most);
  return image;
}

GreyImage evened(const GreyImage& image, const SegmentOptions& options, Steps& steps) {
  if (!options.clahe) return image;
  GreyImage even = clahe(image);
  steps.add("clahe", "local contrast evened (CLAHE, 8 x 8 tiles, clip limit 2)", even);
  return even;
}

/// What is thresholded: light where there is something. Where the steps are complete before, any image.
GreyImage signal_of(const GreyImage& image, const SegmentOptions& options, Segmentation& result, Steps& steps) {
  if (result.pipeline == Pipeline::kPhase) {
    GreyImage signal = local_deviation(evened(image, options, steps), options.window_radius_px);
    steps.add("signal", "local standard deviation, logarithmic: what is thresholded", signal);
    return signal;
  }
  const bool dark = result.foreground == Foreground::kDark;
  const GreyImage light = dark ? inverted(image) : image;
  if (dark) steps.add("inverted", "turned so that the foreground is light", light);
  if (steps.is_complete()) return light;
  result.background_reach_px = options.background_reach_px.value_or(
      std::max(std::min(image.width_px, image.height_px) / 4, kBackgroundReachMin_px));
  const GreyImage ground = background(light, result.background_reach_px);
  steps.add("background",
            "what the picture would be without its objects: opening with a square of " +
                std::to_string(result.background_reach_px) + " px, smoothed",
            ground);
  if (steps.is_complete()) return light;
  const GreyImage corrected = subtracted(light, ground);
  steps.add("corrected", "the picture less its background", corrected);
  if (steps.is_complete()) return light;
  GreyImage signal = square_root(smoothed(evened(corrected, options, steps)));
  steps.add("signal", "smoothed 3 x 3, square root: what is thresholded", signal);
  return signal;
}

/// Nine levels about the answer's own; `objects` makes those of the others.
template <class MakeObjects>
void sweep_levels(const SegmentOptions& options, StopFlag stop, Segmentation& result, const MakeObjects& make_objects) {
  if (!options.sweep || !options.keep_only.empty()) return;
  if (options.at_threshold) options.at_threshold({result.threshold, result.pipeline, result.mask, result.labels});
  for (std::int64_t k = -kSweepSide; k <= kSweepSide; ++k) {
    const std::int64_t at = result.threshold + k * kSweepStep;
    if (at < 0 || at > 254) continue;
    throw_if_stopped(stop);
    const Objects other = k == 0 ? Objects{} : make_objects(static_cast<int>(at));
    const std::vector<std::int64_t>& areas = k == 0 ? result.areas_px : other.areas_px;
    std::int64_t sum = 0;
    for (const std::int64_t area : areas) sum += area;
    result.sweep.push_back({static_cast<int>(at), sum, static_cast<std::int64_t>(areas.size())});
    if (k != 0 && options.at_threshold) options.at_threshold({static_cast<int>(at), result.pipeline, other.mask, other.labels});
  }
}

}  // namespace

StepImage overlay(const GreyImage& image, const LabelImage& labels) {
  CHECK(image.values.size() == labels.values.size());
  static constexpr std::uint8_t kColours[6][3] = {{255, 80, 80},  {80, 220, 80},   {90, 150, 255},
                                                  {255, 210, 60}, {255, 110, 255}, {70, 230, 230}};
  StepImage step{
      "overlay", "the picture with the outline of every object that was counted", image.width_px, image.height_px, 3,
      {}};
  step.values.resize(image.values.size() * 3);
  for (std::int64_t y = 0; y < image.height_px; ++y) {
    for (std::int64_t x = 0; x < image.width_px; ++x) {
      const std::size_t i = image.index(y, x);
      const std::uint32_t label = labels.values[i];
      const bool edge = label != 0 && (labels.at_or(y - 1, x, 0) != label || labels.at_or(y + 1, x, 0) != label ||
                                       labels.at_or(y, x - 1, 0) != label || labels.at_or(y, x + 1, 0) != label);
      for (std::size_t c = 0; c < 3; ++c) step.values[3 * i + c] = edge ? kColours[label % 6][c] : image.values[i];
    }
  }
  return step;
}

Result<Segmentation> segment(const GreyImage& image, const SegmentOptions& options, StopFlag stop) {
  if (Status status = check_options(image, options); !status) return status.error();
  const Look look = look_at(image);
  if (look.level_count < 2) {
    return wrong("image", "all its pixels are alike (level " + std::to_string(image.values[0]) +
                              "): there is nothing to tell apart");
  }
  Segmentation result;
  result.pipeline_given = options.pipeline != Pipeline::kAuto;
  result.foreground_given = options.foreground != Foreground::kAuto;
  const Choice choice = result.pipeline_given ? Choice{options.pipeline, "asked for"} : choose_pipeline(image, look);
  result.pipeline = choice.pipeline;
  result.pipeline_reason = choice.reason;
  result.foreground = options.foreground;
  result.foreground_reason = "asked for";
  Steps steps(options, result.steps);
  steps.add("grey", "the channel that is analysed, as 8 bits", image);
  if (steps.is_complete()) return result;
  result.field_px = static_cast<std::int64_t>(image.values.size());
  result.threshold_given = options.threshold.has_value();

  if (result.pipeline == Pipeline::kContours) {
    result.threshold = options.threshold.value_or(otsu(image));
    BinaryImage light = above(image, result.threshold);
    const std::int64_t light_px = count_above(light);
    if (!result.foreground_given) {
      result.foreground = 2 * light_px <= result.field_px ? Foreground::kLight : Foreground::kDark;
      result.foreground_reason = "chosen: the rarer of the two sides of the threshold is the ink";
    }
    const bool dark = result.foreground == Foreground::kDark;
    result.mask = dark ? inverted(light) : std::move(light);
    steps.add("threshold", "the ink: what is measured, as it is", result.mask);
    if (steps.is_complete()) return result;
    const Pieces found = pieces_of(result.mask);
    result.area_min_px = 1;
    result.labels = renumbered(found.labels, 1, &result.areas_px);
    sweep_levels(options, stop, result, [&](int level) {
      Objects objects;
      objects.mask = above(image, level);
      if (dark) objects.mask = inverted(objects.mask);
      objects.labels = renumbered(pieces_of(objects.mask).labels, 1, &objects.areas_px);
      return objects;
    });
  } else {
    if (result.pipeline == Pipeline::kPhase) {
      result.foreground = Foreground::kLight;
      result.foreground_reason = "phase looks at texture, which is neither light nor dark";
    } else if (!result.foreground_given) {
      const bool is_dark = look.light - look.middle < look.middle - look.dark;
      result.foreground = is_dark ? Foreground::kDark : Foreground::kLight;
      result.foreground_reason = foreground_reason(look, is_dark);
    }
    const GreyImage signal = signal_of(image, options, result, steps);
    if (steps.is_complete()) return result;
    // Where a window is constant the picture was clipped or empty: such pixels say nothing about where noise ends and cells begin.
    const int from = result.pipeline == Pipeline::kPhase ? kOneLevelOfDeviation : 0;
    const int level = options.threshold.value_or(otsu(signal, from));
    if (level < 0) return wrong("image", "after the background is taken away nothing is left in it");
    result.threshold = level;
    result.levels = hump_figures(signal, from);
    if (result.levels && is_one_hump(*result.levels)) result.doubt = hump_text(*result.levels);
    throw_if_stopped(stop);
    Objects objects = objects_at(signal, level, result.pipeline, options);
    steps.add("threshold", "above level " + std::to_string(level) + (result.threshold_given ? " (given)" : " (Otsu)"),
              objects.raw);
    if (objects.field) {
      result.dish_found = true;
      result.field_px = count_above(*objects.field);
      steps.add("dish", "what the dish's wall encloses: nothing else is looked at", *objects.field);
    }
    steps.add("cleaned", "holes filled, pieces below " + std::to_string(objects.area_min_px) + " px away",
              objects.mask);
    if (!objects.distance.values.empty() && steps.wants("distance")) {
      steps.add("distance", "distance to the background, by which touching objects are parted",
                shown(objects.distance));
    }
    if (steps.is_complete()) return result;
    result.area_min_px = objects.area_min_px;
    result.mask = std::move(objects.mask);
    result.labels = std::move(objects.labels);
    result.areas_px = std::move(objects.areas_px);
    sweep_levels(options, stop, result, [&](int at) { return objects_at(signal, at, result.pipeline, options); });
  }
  for (const std::int64_t area : result.areas_px) result.foreground_px += area;
  // A threshold that nobody gave is not what is wrong.
  const std::string field = result.threshold_given ? "threshold" : "image";
  if (result.foreground_px == 0) {
    return wrong(field, "nothing is left in the foreground at level " + std::to_string(result.threshold) +
                                  ": give another threshold, foreground or pipeline");
  }
  if (result.foreground_px == result.field_px) {
    return wrong(field, "everything is foreground at level " + std::to_string(result.threshold) +
                                  ": give another threshold, foreground or pipeline");
  }
  if (steps.wants("overlay")) steps.add(overlay(image, result.labels));
  return result;
}

}  // namespace colony
