#include <cstdlib>
#include <exception>
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

std::unique_ptr<spng_ctx, FreeContext> png_context(const Picture& picture) {
  CHECK(picture.width_px > 0 && picture.width_px <= kRasterSideMax_px);
  CHECK(picture.height_px > 0 && picture.height_px <= kRasterSideMax_px);
  CHECK(picture.um_per_px > 0.0);
  std::unique_ptr<spng_ctx, FreeContext> context(spng_ctx_new(SPNG_CTX_ENCODER));
  CHECK(context != nullptr);
  return context;
}

/// Where the bytes go must have been said before. `is_srgb`: colours for the eye; the values of a measured picture are none, and say nothing of a
/// transfer function.
void set_header(spng_ctx* context, const Picture& picture, bool is_srgb) {
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(picture.width_px);
  header.height = static_cast<std::uint32_t>(picture.height_px);
  header.bit_depth = 8;
  header.color_type = SPNG_COLOR_TYPE_TRUECOLOR;
  CHECK(spng_set_ihdr(context, &header) == 0);
  if (is_srgb) CHECK(spng_set_srgb(context, kPerceptualIntent) == 0);

  // A pixel below half a nanometre or above a metre cannot be said in whole pixels per metre: then the chunk is left
  // out.
  const double per_metre = kUmPerMetre / picture.um_per_px + 0.5;
  if (per_metre >= 1.0 && per_metre < kPixelsPerMetreMax) {
    spng_phys physical{};
    physical.ppu_x = static_cast<std::uint32_t>(per_metre);
    physical.ppu_y = physical.ppu_x;
    physical.unit_specifier = kUnitMetre;
    CHECK(spng_set_phys(context, &physical) == 0);
  }
}

using Take = std::function<void(std::string_view)>;

// What `take` throws may not pass through the C library: it is kept and thrown when that has returned.
struct Hand {
  const Take& take;
  std::exception_ptr thrown;
};
int hand_over(spng_ctx*, void* user, void* bytes, std::size_t size) {
  Hand& hand = *static_cast<Hand*>(user);
  try {
    hand.take(std::string_view(static_cast<const char*>(bytes), size));
    return 0;
  } catch (...) {
    hand.thrown = std::current_exception();
    return SPNG_IO_ERROR;
  }
}

}  // namespace

std::string encode_png(const Picture& picture, bool is_srgb) {
  CHECK(picture.rgb.size() == static_cast<std::size_t>(3 * picture.width_px * picture.height_px));
  const auto context = png_context(picture);
  CHECK(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1) == 0);
  set_header(context.get(), picture, is_srgb);
  CHECK(spng_encode_image(context.get(), picture.rgb.data(), picture.rgb.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE) ==
        0);
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, FreeBuffer> bytes(spng_get_png_buffer(context.get(), &size, &status));
  CHECK(bytes != nullptr && status == 0);
  return std::string(static_cast<const char*>(bytes.get()), size);
}

Status render_png(const Colony& colony, const Params& params, const PictureSpec& spec, const Effort& effort,
                  const Take& take) {
  std::unique_ptr<spng_ctx, FreeContext> context;
  Hand hand{take, nullptr};
  return render_strips(colony, params, spec, effort, [&](const Picture& strip) {
    if (!context) {
      context = png_context(strip);
      CHECK(spng_set_png_stream(context.get(), hand_over, &hand) == 0);
      set_header(context.get(), strip, spec.style == PictureStyle::kShaded);
      const int status =
          spng_encode_image(context.get(), nullptr, 0, SPNG_FMT_PNG, SPNG_ENCODE_PROGRESSIVE | SPNG_ENCODE_FINALIZE);
      if (hand.thrown) std::rethrow_exception(hand.thrown);
      CHECK(status == 0);
    }
    const auto row_bytes = static_cast<std::size_t>(3 * strip.width_px);
    for (std::size_t at = 0; at < strip.rgb.size(); at += row_bytes) {
      const int status = spng_encode_row(context.get(), strip.rgb.data() + at, row_bytes);
      if (hand.thrown) std::rethrow_exception(hand.thrown);
      CHECK(status == 0 || status == SPNG_EOI);
    }
  });
}

}  // namespace colony
