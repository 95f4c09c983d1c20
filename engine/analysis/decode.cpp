#include "engine/analysis/decode.hpp"

#include <algorithm>
#include <new>

#include "engine/analysis/decode_parts.hpp"

namespace colony {
namespace {

using std::string_view_literals::operator""sv;

bool looks_like_text(std::string_view bytes) {
  const std::string_view head = bytes.substr(0, 64);
  return std::all_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte >= 32 && byte != 127) || byte == '\n' || byte == '\r' || byte == '\t';
  });
}

std::string size_text(const decode_parts::Claim& claim) {
  return std::to_string(claim.width_px) + " x " + std::to_string(claim.height_px) + " pixels";
}

}  // namespace

std::string_view media_type(ImageFormat format) {
  switch (format) {
    case ImageFormat::kPng:
      return "image/png";
    case ImageFormat::kTiff:
      return "image/tiff";
    case ImageFormat::kJpeg:
      return "image/jpeg";
  }
  return "";
}

std::optional<ImageFormat> sniff_image(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n"sv)) return ImageFormat::kPng;
  for (const std::string_view magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv}) {
    if (bytes.starts_with(magic)) return ImageFormat::kTiff;
  }
  if (bytes.starts_with("\xff\xd8\xff"sv)) return ImageFormat::kJpeg;
  return std::nullopt;
}

Result<DecodedImage> decode_image(std::string_view bytes, const DecodeLimits& limits) try {
  const auto format = sniff_image(bytes);
  if (!format) {
    if (bytes.empty()) return decode_parts::malformed("the image is empty");
    return decode_parts::malformed(looks_like_text(bytes)
                                       ? "not a PNG, TIFF or JPEG image: it begins like a text"
                                       : "not a PNG, TIFF or JPEG image: it begins like none of them");
  }
  switch (*format) {
    case ImageFormat::kPng:
      return decode_parts::decode_png(bytes, limits);
    case ImageFormat::kTiff:
      return decode_parts::decode_tiff(bytes, limits);
    case ImageFormat::kJpeg:
      return decode_parts::decode_jpeg(bytes, limits);
  }
  return decode_parts::malformed("unknown format");
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kLimit, "not enough memory to read the image"};
}

namespace decode_parts {

Error malformed(std::string message) { return {ErrorCode::kMalformed, std::move(message)}; }
Error not_read(std::string message) { return {ErrorCode::kInvalid, std::move(message)}; }

Status check_claim(const Claim& claim, std::size_t file_bytes, const DecodeLimits& limits) {
  const auto limit = [](std::string message) { return Error{ErrorCode::kLimit, std::move(message)}; };
  if (claim.width_px < 1 || claim.height_px < 1) return malformed("the image has no pixels");
  if (claim.width_px > limits.side_max_px || claim.height_px > limits.side_max_px) {
    return limit("the image states " + size_text(claim) + "; a side may have at most " +
                 std::to_string(limits.side_max_px));
  }
  // Sides are below 2^31 from here on, so their product fits.
  const std::int64_t pixels = claim.width_px * claim.height_px;
  if (pixels > limits.pixels_max) {
    return limit("the image states " + size_text(claim) + "; at most " + std::to_string(limits.pixels_max) +
                 " pixels are read");
  }
  if (claim.channel_count < 1) return malformed("the image has no channels");
  if (claim.channel_count > limits.channels_max) {
    return limit("the image states " + std::to_string(claim.channel_count) + " channels; at most " +
                 std::to_string(limits.channels_max) + " are read");
  }
  const std::int64_t samples = pixels * claim.channel_count;
  if (samples > limits.samples_bytes_max / static_cast<std::int64_t>(sizeof(std::uint16_t))) {
    return limit("the image states " + size_text(claim) + " of " + std::to_string(claim.channel_count) +
                 " channels; its samples may take at most " + std::to_string(limits.samples_bytes_max) + " bytes");
  }
  const std::int64_t stated_bytes = samples * claim.bits / 8;
  if (claim.expansion_max > 0 &&
      stated_bytes > static_cast<std::int64_t>(file_bytes) * claim.expansion_max + kClaimSlack_bytes) {
    return malformed("the image states " + size_text(claim) + ", more than its " + std::to_string(file_bytes) +
                     " bytes can hold: it is cut off or damaged");
  }
  return Ok{};
}

void blend_alpha(DecodedImage& image, bool premultiplied) {
  const std::uint32_t white = image.value_max();
  const auto pixels = static_cast<std::size_t>(image.pixel_count());
  const auto stride = static_cast<std::size_t>(image.channel_count);
  const std::size_t kept = stride - 1;
  bool opaque = true;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const std::uint32_t alpha = image.samples[pixel * stride + kept];
    opaque = opaque && alpha == white;
    for (std::size_t channel = 0; channel < kept; ++channel) {
      const std::uint32_t value = image.samples[pixel * stride + channel];
      // Both products are below 2^32. A premultiplied colour above its own alpha is damaged: the sum is held to white.
      const std::uint32_t mixed = premultiplied ? std::min(value + white - alpha, white)
                                                : (value * alpha + white * (white - alpha) + white / 2) / white;
      image.samples[pixel * kept + channel] = static_cast<std::uint16_t>(mixed);
    }
  }
  image.samples.resize(pixels * kept);
  image.channel_count -= 1;
  if (!opaque) image.notes.emplace_back("transparent pixels were blended over white");
}

}  // namespace decode_parts
}  // namespace colony
