#include "engine/analysis/image_analysis.hpp"

#include <algorithm>
#include <new>
#include <opencv2/core.hpp>
#include <tuple>

#include "engine/analysis/ome_xml.hpp"

namespace colony {
namespace {

Error wrong(const std::string& field, std::string message) {
  return {ErrorCode::kInvalid, field + ": " + message, {{field, std::move(message)}}};
}

/// The sample values below which 1 and above which 1 in a thousand lie: a hot pixel must not take the whole scale.
std::pair<int, int> window_of(const std::vector<std::uint16_t>& values) {
  std::vector<std::int64_t> counts(65536, 0);
  for (const std::uint16_t value : values) ++counts[value];
  const auto spare = static_cast<std::int64_t>(values.size()) / 1000;
  int low = 0, high = 65535;
  for (std::int64_t seen = counts[0]; seen <= spare; seen += counts[static_cast<std::size_t>(low)]) ++low;
  for (std::int64_t seen = counts[65535]; seen <= spare; seen += counts[static_cast<std::size_t>(high)]) --high;
  return {low, high};
}

/// The scale that is used, and in the notes what was not.
std::optional<double> scale_of(const DecodedImage& image, std::optional<double> given, ImageMetadata& metadata) {
  const std::optional<double> ome = image.um_per_px_ome, tags = image.um_per_px_stated;
  metadata.um_per_px_stated = ome ? ome : tags;
  if (given) {
    metadata.scale_source = ScaleSource::kGiven;
    if (metadata.um_per_px_stated && scales_differ(*given, *metadata.um_per_px_stated)) {
      metadata.notes.push_back("um_per_px is " + scale_text(*given) + " as asked for; the file says " +
                               scale_text(*metadata.um_per_px_stated));
    }
    return given;
  }
  if (!ome) return {};
  if (tags && scales_differ(*ome, *tags)) {
    metadata.notes.push_back("no scale was used: the file's OME metadata says " + scale_text(*ome) + " um a pixel, its resolution " +
                             scale_text(*tags) + ": give um_per_px");
    return {};
  }
  metadata.scale_source = ScaleSource::kOme;
  return ome;
}

}  // namespace

Result<GreyImage> grey_of(const DecodedImage& image, std::optional<std::int64_t> channel, ImageMetadata& metadata) {
  const std::int64_t channels = image.channel_count;
  if (channel && (*channel < 0 || *channel >= channels)) {
    return wrong("channel", "the image has " + std::to_string(channels) + " channels, numbered from 0");
  }
  if (!channel && image.model == ColourModel::kChannels) {
    return wrong("channel", "the image has " + std::to_string(channels) + " channels: say which, from 0");
  }
  if (!channel && image.model == ColourModel::kGrey) channel = 0;
  metadata.channel = channel;

  std::vector<std::uint16_t> values(static_cast<std::size_t>(image.pixel_count()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::uint16_t* pixel = image.samples.data() + i * static_cast<std::size_t>(channels);
    values[i] = channel
                    ? pixel[*channel]
                    : static_cast<std::uint16_t>((299U * pixel[0] + 587U * pixel[1] + 114U * pixel[2] + 500U) / 1000U);
  }
  metadata.level_low = 0;
  metadata.level_high = 255;
  if (image.bits == 16) std::tie(metadata.level_low, metadata.level_high) = window_of(values);
  const int low = metadata.level_low, range = std::max(1, metadata.level_high - low);
  GreyImage grey(image.width_px, image.height_px);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const int above = std::clamp(values[i] - low, 0, range);
    grey.values[i] = static_cast<std::uint8_t>((above * 255 + range / 2) / range);
  }
  return grey;
}

Result<ImageAnalysis> analyse_image(std::string_view bytes, const AnalysisOptions& options, StopFlag stop) try {
  if (options.um_per_px &&
      !(*options.um_per_px >= kImageScaleMin_um_per_px && *options.um_per_px <= kImageScaleMax_um_per_px)) {
    return wrong("um_per_px", "must be between 0.001 and 10000");
  }
  throw_if_stopped(stop);
  DecodeLimits limits = options.limits;
  limits.side_max_px = std::min(limits.side_max_px, kImageSideMax_px);
  Result<DecodedImage> decoded = decode_image(bytes, limits);
  if (!decoded) return decoded.error();
  throw_if_stopped(stop);
  ImageAnalysis result;
  ImageMetadata& metadata = result.metadata;
  metadata.format = decoded->format;
  metadata.model = decoded->model;
  metadata.width_px = decoded->width_px;
  metadata.height_px = decoded->height_px;
  metadata.channel_count = decoded->channel_count;
  metadata.bits = decoded->bits;
  metadata.notes = std::move(decoded->notes);
  result.um_per_px = scale_of(*decoded, options.um_per_px, metadata);
  Result<GreyImage> grey = grey_of(*decoded, options.channel, metadata);
  if (!grey) return grey.error();
  decoded->samples = {};  // not needed beside the steps
  grey->um_per_px = result.um_per_px;

  Result<Segmentation> segmentation = segment(*grey, options.segment, stop);
  if (!segmentation) return segmentation.error();
  result.segmentation = std::move(*segmentation);
  const Segmentation& found = result.segmentation;
  if (!options.segment.keep_only.empty()) return result;  // one step was asked for: there need be no objects
  result.object_count = static_cast<std::int64_t>(found.areas_px.size());
  result.foreground_share = static_cast<double>(found.foreground_px) / static_cast<double>(found.field_px);
  result.area_mean_px = static_cast<double>(found.foreground_px) / static_cast<double>(result.object_count);
  std::vector<std::int64_t> areas = found.areas_px;
  const auto middle = areas.begin() + static_cast<std::ptrdiff_t>((areas.size() - 1) / 2);
  std::nth_element(areas.begin(), middle, areas.end());
  result.area_median_px = static_cast<double>(*middle);
  if (result.um_per_px) {
    const double um2_per_px = *result.um_per_px * *result.um_per_px;
    constexpr double kUm2PerMm2 = 1e6;
    result.area_mean_um2 = result.area_mean_px * um2_per_px;
    result.foreground_um2 = static_cast<double>(found.foreground_px) * um2_per_px;
    result.density_per_mm2 =
        static_cast<double>(result.object_count) * kUm2PerMm2 / (static_cast<double>(found.field_px) * um2_per_px);
  }
  return result;
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kLimit, "not enough memory to analyse the image"};
} catch (const cv::Exception& failure) {
  if (failure.code == cv::Error::StsNoMem) return Error{ErrorCode::kLimit, "not enough memory to analyse the image"};
  return Error{ErrorCode::kInternal, "the segmentation failed: " + failure.err};
}

}  // namespace colony
