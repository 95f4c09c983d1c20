#include <memory>

#include <spng.h>

#include "engine/analysis/decode_parts.hpp"
#include "engine/base/check.hpp"

namespace colony::decode_parts {
namespace {

struct FreeContext {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};

constexpr std::int64_t kDeflateExpansionMax = 1032;  // 258 bytes from 2 bits
constexpr std::size_t kChunkMax_bytes = 1 << 20;     // text and colour profiles, which nobody reads
constexpr std::size_t kChunksMax_bytes = 4 << 20;
constexpr std::uint8_t kUnitMetre = 1;
constexpr double kUmPerMetre = 1e6;

Error failed(int code) { return malformed(std::string("damaged or cut-off PNG: ") + spng_strerror(code)); }

struct Layout {
  int format = 0;
  int channels = 0;
  int bits = 8;
};

/// Whether chunk acTL stands before the pixels: an animation, of which a decoder that does not know it sees the first picture.
bool is_animated(std::string_view bytes) {
  constexpr std::size_t kSignature_bytes = 8, kAroundData_bytes = 12;
  for (std::size_t at = kSignature_bytes; at + kAroundData_bytes <= bytes.size();) {
    const std::string_view type = bytes.substr(at + 4, 4);
    if (type == "acTL") return true;
    if (type == "IDAT") return false;
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
    at += kAroundData_bytes + length;
  }
  return false;
}

/// The format in which libspng hands the pixels over: palettes and few bits spread to 8 bits, 16 bits kept, transparency as a channel.
Layout layout_of(const spng_ihdr& header, bool has_trns) {
  const bool wide = header.bit_depth == 16;
  const int bits = wide ? 16 : 8;
  switch (header.color_type) {
    case SPNG_COLOR_TYPE_GRAYSCALE:
      if (has_trns) return {wide ? SPNG_FMT_GA16 : SPNG_FMT_GA8, 2, bits};
      return {wide ? SPNG_FMT_PNG : SPNG_FMT_G8, 1, bits};
    case SPNG_COLOR_TYPE_GRAYSCALE_ALPHA:
      return {SPNG_FMT_PNG, 2, bits};
    case SPNG_COLOR_TYPE_TRUECOLOR:
      if (has_trns) return {wide ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8, 4, bits};
      return {SPNG_FMT_PNG, 3, bits};
    case SPNG_COLOR_TYPE_INDEXED:
      return {has_trns ? SPNG_FMT_RGBA8 : SPNG_FMT_RGB8, has_trns ? 4 : 3, 8};
    default:
      return {SPNG_FMT_PNG, 4, bits};
  }
}

}  // namespace

Result<DecodedImage> decode_png(std::string_view bytes, const DecodeLimits& limits) {
  const std::unique_ptr<spng_ctx, FreeContext> context(spng_ctx_new(0));
  if (context == nullptr) return Error{ErrorCode::kLimit, "not enough memory to read the image"};
  CHECK(spng_set_chunk_limits(context.get(), kChunkMax_bytes, kChunksMax_bytes) == 0);
  int code = spng_set_png_buffer(context.get(), bytes.data(), bytes.size());
  if (code != 0) return failed(code);
  spng_ihdr header{};
  // No image limits are set in libspng: it would refuse with "exceeds user limits", check_claim names them.
  if ((code = spng_get_ihdr(context.get(), &header)) != 0) return failed(code);
  const std::int64_t stored_channels[] = {1, 0, 3, 1, 2, 0, 4};
  Claim claim{header.width, header.height, stored_channels[header.color_type], header.bit_depth, kDeflateExpansionMax};
  if (Status status = check_claim(claim, bytes.size(), limits); !status) return status.error();

  spng_trns transparency{};
  code = spng_get_trns(context.get(), &transparency);  // reads everything before the pixels
  if (code != 0 && code != SPNG_ECHUNKAVAIL) return failed(code);
  const Layout layout = layout_of(header, code == 0);
  claim.channel_count = layout.channels;
  claim.bits = layout.bits;
  claim.expansion_max = 0;
  if (Status status = check_claim(claim, bytes.size(), limits); !status) return status.error();

  DecodedImage image;
  image.format = ImageFormat::kPng;
  image.width_px = header.width;
  image.height_px = header.height;
  image.channel_count = layout.channels;
  image.bits = layout.bits;
  const int flags = code == 0 ? SPNG_DECODE_TRNS : 0;
  std::size_t size = 0;
  if ((code = spng_decoded_image_size(context.get(), layout.format, &size)) != 0) return failed(code);
  const auto sample_count = static_cast<std::size_t>(image.pixel_count() * image.channel_count);
  CHECK(size == sample_count * static_cast<std::size_t>(image.bits / 8));
  // 8-bit samples are read into the second half of the buffer and widened from the front: no second copy of the image.
  image.samples.resize(sample_count);
  auto* raw = reinterpret_cast<std::uint8_t*>(image.samples.data()) + (image.bits == 8 ? sample_count : 0);
  if ((code = spng_decode_image(context.get(), raw, size, layout.format, flags)) != 0) return failed(code);
  if (image.bits == 8) {
    for (std::size_t i = 0; i < sample_count; ++i) {
      const std::uint8_t value = raw[i];
      image.samples[i] = value;
    }
  }

  if (is_animated(bytes)) image.notes.emplace_back("of the animation (APNG) only the first picture was read");
  image.model = layout.channels <= 2 ? ColourModel::kGrey : ColourModel::kRgb;
  if (layout.channels == 2 || layout.channels == 4) blend_alpha(image, false);
  spng_phys physical{};
  if (spng_get_phys(context.get(), &physical) == 0 && physical.unit_specifier == kUnitMetre &&
      physical.ppu_x == physical.ppu_y && physical.ppu_x > 0) {
    image.um_per_px_stated = kUmPerMetre / physical.ppu_x;
  }
  return image;
}

}  // namespace colony::decode_parts
