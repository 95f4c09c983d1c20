// image_analysis: a picture file of a microscope to what was counted in it.
// Method:  decode.hpp, then one channel as 8 bits, then segment.hpp.
// Units:   um where um_per_px is given or OME metadata states it, else pixels. A scale that a file states in any other way is reported, never used
//          unasked: it is often a printer's. Statements that contradict each other are not used either: a note says so, and um_per_px decides.
// Limits:  DecodeLimits for the file; both sides at most kImageSideMax_px. Peak memory: the samples, then about 50 bytes a pixel with every step kept:
//          1.7 GB for the 32 Mi pixels that are taken unless the caller says otherwise.
// Errors:  those of decode_image and segment; kInvalid (fields `channel`, `um_per_px`).     Threads: pure, any thread.
#pragma once

#include <string_view>

#include "engine/analysis/decode.hpp"
#include "engine/analysis/segment.hpp"

namespace colony {

struct AnalysisOptions {
  std::optional<double> um_per_px = {};  // kImageScaleMin..Max_um_per_px
  std::optional<std::int64_t> channel =
      {};  // from 0; none: grey as it is, RGB as luma; an image of several channels needs one
  SegmentOptions segment = {};
  DecodeLimits limits = {.pixels_max = 32LL << 20};
};

enum class ScaleSource { kNone, kGiven, kOme };

struct ImageMetadata {
  ImageFormat format = ImageFormat::kPng;
  ColourModel model = ColourModel::kGrey;
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::int64_t channel_count = 0;
  int bits = 8;
  std::optional<double> um_per_px_stated;  // by the file; by its OME metadata, if that says anything
  ScaleSource scale_source = ScaleSource::kNone;  // of ImageAnalysis::um_per_px
  std::optional<std::int64_t> channel;     // none: luma
  int level_low = 0, level_high = 255;     // sample values that became grey 0 and 255
  std::vector<std::string> notes;
};

struct ImageAnalysis {
  ImageMetadata metadata;
  std::optional<double> um_per_px;  // metadata.scale_source says from where
  Segmentation segmentation;
  std::int64_t object_count = 0;
  double foreground_share = 0.0;  // of field_px
  double area_mean_px = 0.0;
  double area_median_px = 0.0;  // the lower one of two middle ones
  std::optional<double> area_mean_um2;
  std::optional<double> foreground_um2;
  std::optional<double> density_per_mm2;  // objects in the field
};

/// What a click on "analyse" does, and what each of its steps looked like. `bytes` must stay until it returns. Throws Stopped when asked to.
/// With segment.keep_only: the metadata and that step alone.
Result<ImageAnalysis> analyse_image(std::string_view bytes, const AnalysisOptions& options, StopFlag stop = nullptr);

/// One channel (or the luma of RGB, by integer weights 299, 587, 114) as 8 bits. 8-bit samples stay as they are; 16-bit samples are stretched from their
/// 0.1 % to their 99.9 % level, which `metadata` then names.
Result<GreyImage> grey_of(const DecodedImage& image, std::optional<std::int64_t> channel, ImageMetadata& metadata);

/// A step as an 8-bit PNG, grey or colour. The bytes are the same for one zlib. Throws Stopped when asked to, between rows: 32 Mpx take seconds.
std::string encode_step_png(const StepImage& step, StopFlag stop = nullptr);

}  // namespace colony
