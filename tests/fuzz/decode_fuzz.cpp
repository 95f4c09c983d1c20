// decode_fuzz: any bytes to one of the decoders. One source, three programs: COLONY_FUZZ_FORMAT is kPng, kTiff or kJpeg.
// Finds:   crashes, sanitizer reports, memory beyond the limits, calls that do not end (libFuzzer's own limits: see run).
// Promise checked: an answer is an error with a message, or exactly the samples that its sides and channels say.
#include <cstdlib>
#include <string_view>

#include "engine/analysis/decode_parts.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace colony;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  DecodeLimits limits;  // small, so that a run is many images, not few large ones
  limits.side_max_px = 2048;
  limits.pixels_max = 1 << 18;
  limits.samples_bytes_max = 4 << 20;
  Result<DecodedImage> result = [&] {
    switch (ImageFormat::COLONY_FUZZ_FORMAT) {
      case ImageFormat::kPng:
        return decode_parts::decode_png(bytes, limits);
      case ImageFormat::kTiff:
        return decode_parts::decode_tiff(bytes, limits);
      default:
        return decode_parts::decode_jpeg(bytes, limits);
    }
  }();
  if (!result) {
    if (result.error().message.empty()) std::abort();
    return 0;
  }
  const DecodedImage& image = *result;
  const bool bounded = image.width_px >= 1 && image.height_px >= 1 && image.width_px <= limits.side_max_px &&
                       image.height_px <= limits.side_max_px && image.pixel_count() <= limits.pixels_max;
  const bool whole = image.samples.size() == static_cast<std::size_t>(image.pixel_count() * image.channel_count);
  if (!bounded || !whole || image.channel_count < 1 || image.channel_count > limits.channels_max) std::abort();
  if (image.model == ColourModel::kRgb && image.channel_count != 3) std::abort();
  if (image.bits != 8 && image.bits != 16) std::abort();
  if (image.bits == 8) {
    for (const std::uint16_t sample : image.samples) {
      if (sample > 255) std::abort();
    }
  }
  return 0;
}
