#include "engine/analysis/image.hpp"

namespace colony {
namespace {

Error wrong(ErrorCode code, const std::string& field, std::string message) {
  return {code, field + ": " + message, {{field, std::move(message)}}};
}

}  // namespace

Status check_image_shape(std::int64_t width_px, std::int64_t height_px, std::size_t value_count,
                         std::optional<double> um_per_px, const std::string& name) {
  const std::string size = std::to_string(width_px) + " x " + std::to_string(height_px) + " pixels";
  if (width_px < 1 || height_px < 1) return wrong(ErrorCode::kInvalid, name, "has no pixels (" + size + ")");
  if (width_px > kImageSideMax_px || height_px > kImageSideMax_px) {
    return wrong(ErrorCode::kLimit, name,
                 size + "; a side may have at most " + std::to_string(kImageSideMax_px) + " pixels");
  }
  if (value_count != static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {
    return wrong(ErrorCode::kInvalid, name, size + " but " + std::to_string(value_count) + " values");
  }
  // Written so that NaN is refused.
  if (um_per_px && !(*um_per_px >= kImageScaleMin_um_per_px && *um_per_px <= kImageScaleMax_um_per_px)) {
    return wrong(ErrorCode::kInvalid, name, "um per pixel must be between 0.001 and 10000");
  }
  return Ok{};
}

}  // namespace colony
