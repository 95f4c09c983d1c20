// decode: a picture file of a microscope, as bytes in memory, to samples. What the bytes are is read from their first ones, never from a name.
// Reads:   PNG of every colour type and depth; TIFF and BigTIFF of 8 or 16 bits, grey, palette, RGB or several channels, interleaved or planar, in
//          strips or tiles, uncompressed, LZW, deflate or PackBits, further pages of the same shape as further channels; JPEG, grey or colour.
// Shapes:  samples are row-major from the top row, the channels of a pixel beside each other, as stored (8-bit values stay 0..255).
// Limits:  the header is judged before memory is asked for: sides, pixels, channels, bytes, and whether a file this short can hold so many
//          samples at all. Peak memory: samples_bytes_max, and once more as much for a progressive JPEG; strips, tiles and chunks have their own bounds.
// Errors:  kMalformed: not such a file, cut off, damaged; kInvalid: a kind that is not read (the message names it); kLimit: a limit above.
// Threads: pure, any thread. The libraries' messages are caught with each call: no global handler is set.
// Not:     colour profiles, gamma, EXIF and TIFF orientation are not applied; `notes` says what else was left out.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/result.hpp"

namespace colony {

enum class ImageFormat { kPng, kTiff, kJpeg };

/// "image/png" and so on.
std::string_view media_type(ImageFormat format);

struct DecodeLimits {
  std::int64_t side_max_px = 50'000;
  std::int64_t pixels_max = 64LL << 20;
  std::int64_t channels_max = 16;
  std::int64_t samples_bytes_max = 512LL << 20;
};

enum class ColourModel {
  kGrey,      // one channel
  kRgb,       // three channels that are one colour
  kChannels,  // several channels, each an image of its own
};

struct DecodedImage {
  ImageFormat format = ImageFormat::kPng;
  ColourModel model = ColourModel::kGrey;
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::int64_t channel_count = 0;
  int bits = 8;  // 8 or 16: what the samples were stored with; fewer bits of a PNG are spread over 0..255
  std::optional<double> um_per_px_stated;  // PNG pHYs; TIFF resolution in cm, or in the micron of an ImageJ description
  std::optional<double> um_per_px_ome;     // by OME-XML: what a microscope was set to, not what a printer should do
  std::vector<std::uint16_t> samples;      // height x width x channel_count
  std::vector<std::string> notes;          // what was left out or changed in reading, in words

  std::int64_t pixel_count() const { return width_px * height_px; }
  std::uint16_t value_max() const { return bits == 8 ? 255 : 65535; }
};

/// What the first bytes say, or nothing.
std::optional<ImageFormat> sniff_image(std::string_view bytes);

/// Reads one image. `bytes` must stay until it returns.
Result<DecodedImage> decode_image(std::string_view bytes, const DecodeLimits& limits = {});

}  // namespace colony
