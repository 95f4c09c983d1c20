// decode_parts: what the three decoders share. For decode*.cpp and its tests only.
// Threads: pure.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "engine/analysis/decode.hpp"

namespace colony::decode_parts {

/// What a header claims, before anything was allocated for it.
struct Claim {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::int64_t channel_count = 0;
  std::int64_t bits = 0;
  /// The most bytes of samples that one byte of the file can become; 0: not bounded by the format.
  std::int64_t expansion_max = 0;
};

/// A few bytes more than any ratio would allow: headers make the smallest files larger than their pixels.
inline constexpr std::int64_t kClaimSlack_bytes = 64 << 10;

/// kLimit, or kMalformed where `file_bytes` cannot hold what is claimed.
Status check_claim(const Claim& claim, std::size_t file_bytes, const DecodeLimits& limits);

Error malformed(std::string message);
Error not_read(std::string message);

/// The last channel is transparency: blends the others over white and takes it away, with a note, if any pixel is not opaque. `premultiplied`: the
/// colours already hold their share.
void blend_alpha(DecodedImage& image, bool premultiplied);

Result<DecodedImage> decode_png(std::string_view bytes, const DecodeLimits& limits);
Result<DecodedImage> decode_tiff(std::string_view bytes, const DecodeLimits& limits);
Result<DecodedImage> decode_jpeg(std::string_view bytes, const DecodeLimits& limits);

}  // namespace colony::decode_parts
