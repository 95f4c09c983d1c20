#include <cstring>
#include <memory>
#include <turbojpeg.h>
#include <type_traits>

#include "engine/analysis/decode_parts.hpp"

namespace colony::decode_parts {
namespace {

struct CloseHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};

}  // namespace

Result<DecodedImage> decode_jpeg(std::string_view bytes, const DecodeLimits& limits) {
  const std::unique_ptr<void, CloseHandle> handle(tjInitDecompress());
  if (handle == nullptr) return Error{ErrorCode::kLimit, "not enough memory to read the image"};
  const auto failed = [&] {
    return malformed(std::string("damaged or cut-off JPEG: ") + tjGetErrorStr2(handle.get()));
  };
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(handle.get(), data, bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return failed();
  if (width < 1 || height < 1) return malformed("damaged or cut-off JPEG: it ends before it states its size");
  if (colours == TJCS_CMYK || colours == TJCS_YCCK)
    return not_read("a JPEG in CMYK is not read: save it in grey or RGB");
  const bool grey = colours == TJCS_GRAY;
  // The format sets no bound to its compression: an empty block takes a bit or less.
  const Claim claim{width, height, grey ? 1 : 3, 8, 0};
  if (Status status = check_claim(claim, bytes.size(), limits); !status) return status.error();

  DecodedImage image;
  image.format = ImageFormat::kJpeg;
  image.model = grey ? ColourModel::kGrey : ColourModel::kRgb;
  image.width_px = width;
  image.height_px = height;
  image.channel_count = claim.channel_count;
  const auto sample_count = static_cast<std::size_t>(image.pixel_count() * image.channel_count);
  image.samples.resize(sample_count);
  auto* raw = reinterpret_cast<std::uint8_t*>(image.samples.data()) + sample_count;  // as in decode_png
  // Stopped on a warning: libjpeg would paint what is missing grey, and grey would be measured. The accurate transform is integer arithmetic, the
  // same on every CPU. Scans are limited: a small file could ask for thousands of passes.
  const int flags = TJFLAG_STOPONWARNING | TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS;
  if (tjDecompress2(handle.get(), data, bytes.size(), raw, width, 0, height, grey ? TJPF_GRAY : TJPF_RGB, flags) != 0)
    return failed();
  for (std::size_t i = 0; i < sample_count; ++i) {
    const std::uint8_t value = raw[i];
    image.samples[i] = value;
  }
  image.notes.emplace_back("JPEG is lossy: edges carry its block noise");
  return image;
}

}  // namespace colony::decode_parts
