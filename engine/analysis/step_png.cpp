#include <cstdlib>
#include <memory>

#include <spng.h>

#include "engine/analysis/image_analysis.hpp"
#include "engine/base/check.hpp"

namespace colony {
namespace {

struct FreeContext {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};
struct FreeBuffer {
  void operator()(void* buffer) const { std::free(buffer); }  // libspng's buffers come from malloc
};

// A picture is looked at once: half the time of level 6 for some bytes more.
constexpr int kCompressionLevel = 3;

}  // namespace

std::string encode_step_png(const StepImage& step, StopFlag stop) {
  CHECK(step.channel_count == 1 || step.channel_count == 3);
  CHECK(step.width_px >= 1 && step.height_px >= 1 && step.width_px <= kImageSideMax_px &&
        step.height_px <= kImageSideMax_px);
  CHECK(step.values.size() == static_cast<std::size_t>(step.width_px * step.height_px * step.channel_count));
  const std::unique_ptr<spng_ctx, FreeContext> context(spng_ctx_new(SPNG_CTX_ENCODER));
  CHECK(context != nullptr);
  CHECK(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1) == 0);
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(step.width_px);
  header.height = static_cast<std::uint32_t>(step.height_px);
  header.bit_depth = 8;
  header.color_type = step.channel_count == 1 ? SPNG_COLOR_TYPE_GRAYSCALE : SPNG_COLOR_TYPE_TRUECOLOR;
  CHECK(spng_set_ihdr(context.get(), &header) == 0);
  CHECK(spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, kCompressionLevel) == 0);
  CHECK(spng_encode_image(context.get(), nullptr, 0, SPNG_FMT_PNG, SPNG_ENCODE_PROGRESSIVE | SPNG_ENCODE_FINALIZE) == 0);
  const auto row_bytes = static_cast<std::size_t>(step.width_px * step.channel_count);
  for (std::size_t at = 0; at < step.values.size(); at += row_bytes) {
    throw_if_stopped(stop);
    const int status = spng_encode_row(context.get(), step.values.data() + at, row_bytes);
    CHECK(status == 0 || status == SPNG_EOI);
  }
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, FreeBuffer> bytes(spng_get_png_buffer(context.get(), &size, &status));
  CHECK(bytes != nullptr && status == 0);
  return std::string(static_cast<const char*>(bytes.get()), size);
}

}  // namespace colony
