#include <cstdlib>
#include <memory>

#include <spng.h>

#include "engine/base/check.hpp"
#include "engine/picture/render.hpp"

namespace colony {
namespace {

struct FreeContext {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};
struct FreeBuffer {
  void operator()(void* buffer) const { std::free(buffer); }  // libspng's buffers come from malloc
};

constexpr std::uint8_t kPerceptualIntent = 0;
constexpr std::uint8_t kUnitMetre = 1;
constexpr double kPixelsPerMetreMax = 2147483647.0;  // PNG's largest integer
constexpr double kUmPerMetre = 1e6;

}  // namespace

std::string encode_png(const Picture& picture) {
  CHECK(picture.width_px > 0 && picture.width_px <= kPictureSideMax_px);
  CHECK(picture.height_px > 0 && picture.height_px <= kPictureSideMax_px);
  CHECK(picture.rgb.size() == static_cast<std::size_t>(3 * picture.width_px * picture.height_px));
  CHECK(picture.um_per_px > 0.0);
  const std::unique_ptr<spng_ctx, FreeContext> context(spng_ctx_new(SPNG_CTX_ENCODER));
  CHECK(context != nullptr);
  CHECK(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1) == 0);

  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(picture.width_px);
  header.height = static_cast<std::uint32_t>(picture.height_px);
  header.bit_depth = 8;
  header.color_type = SPNG_COLOR_TYPE_TRUECOLOR;
  CHECK(spng_set_ihdr(context.get(), &header) == 0);
  CHECK(spng_set_srgb(context.get(), kPerceptualIntent) == 0);

  // A pixel below half a nanometre or above a metre cannot be said in whole pixels per metre: then the chunk is left
  // out.
  const double per_metre = kUmPerMetre / picture.um_per_px + 0.5;
  if (per_metre >= 1.0 && per_metre < kPixelsPerMetreMax) {
    spng_phys physical{};
    physical.ppu_x = static_cast<std::uint32_t>(per_metre);
    physical.ppu_y = physical.ppu_x;
    physical.unit_specifier = kUnitMetre;
    CHECK(spng_set_phys(context.get(), &physical) == 0);
  }

  CHECK(spng_encode_image(context.get(), picture.rgb.data(), picture.rgb.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE) ==
        0);
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, FreeBuffer> bytes(spng_get_png_buffer(context.get(), &size, &status));
  CHECK(bytes != nullptr && status == 0);
  return std::string(static_cast<const char*>(bytes.get()), size);
}

}  // namespace colony
