// analyse: a picture that somebody sent, from its bytes to what is measured on it: the steps between decoding and JSON.
// Promise: a result and its step images are functions of the bytes, the options and the program: steps are made again when asked for.
// Objects: contours gives ink, whose enclosed areas are cells, and whose walls are the ink itself; phase gives regions of cells; nuclei gives nuclei
//          where it was asked for, else objects: no histogram knows what a stain shows, and in a dish they are colonies.
// Errors:  those of analyse_image. Throws Stopped.     Threads: pure; the thread count cannot matter.
#pragma once

#include <string>
#include <string_view>

#include "engine/analysis/image_analysis.hpp"
#include "engine/analysis/report.hpp"
#include "engine/analysis/threshold_sweep.hpp"
#include "engine/picture/parallel.hpp"
#include "server/api/json.hpp"

namespace colony::server::api {

/// What a client can choose.
struct ImageOptions {
  std::optional<double> um_per_px;
  std::optional<std::int64_t> channel;
  Pipeline pipeline = Pipeline::kAuto;
  Foreground foreground = Foreground::kAuto;
  std::optional<int> threshold;
  bool clahe = false;
  bool split = true;
  std::optional<std::int64_t> area_min_px, hole_max_px, background_reach_px;
  std::int64_t window_radius_px = SegmentOptions().window_radius_px;
};

Json encode_image_options(const ImageOptions& options);
/// Of a stored text; CHECKs.
ImageOptions decode_image_options(const std::string& json);

/// The lines of a picture, whatever its kind.
struct PictureMeasurement {
  ImageAnalysis analysis;
  LabelImage cells;         // objects, or what ink encloses
  BinaryImage walls;        // what was counted as walls
  BinaryImage outline;
  LineReport lines;
  std::vector<ControlReport> controls;
  LineFindings findings;
  ThresholdSweep sweep;
  std::optional<LabelReport> report;  // none for ink, or where `reason` says why
  std::string reason;
  std::vector<std::string> verdict;
  ObjectKind objects = ObjectKind::kObjects;
  std::uint64_t object_count = 0;
  double object_area_mean_px = 0.0;   // 0 without objects
  double object_cover = 0.0;          // of their hull
};

enum class Sweep { kMake, kLeaveOut };  // eight more segmentations and twice as many countings
Result<PictureMeasurement> measure_picture(std::string_view bytes, const ImageOptions& options, const Effort& effort,
                                           Sweep sweep = Sweep::kMake);
Json encode_picture_result(const PictureMeasurement& measurement);

/// The objects of a picture, as label image: what a table of them is made from. Neither lines nor sweep are counted.
Result<LabelImage> objects_of_picture(std::string_view bytes, const ImageOptions& options, const Effort& effort);

/// One step as PNG; kNotFound with the names there are.
Result<std::string> step_png(std::string_view bytes, const ImageOptions& options, const std::string& name,
                             const Effort& effort);

/// The parts that ink encloses, 4-connected, from 1 by their first pixel in reading order; ink and outside are 0.
LabelImage enclosed_areas(const BinaryImage& ink, const BinaryImage& outside);

}  // namespace colony::server::api
