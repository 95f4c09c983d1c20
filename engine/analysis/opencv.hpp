// opencv: how OpenCV is called from here. For analysis/ and its tests only.
// Promise: OpenCV is set once to one thread and to its baseline code: no run-time choice of SSE4, AVX2 or AVX-512 kernels, so floating-point steps are
//          the same bits on every x86-64 CPU for one build of OpenCV. Another version of OpenCV may round differently; integer steps may not.
//          Both settings are process-wide in OpenCV; they are set to the same value always, before the first call.
// Threads: any; the setting is made once.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "engine/analysis/image.hpp"

namespace colony {

/// Call before any other use of OpenCV in a function.
void settle_opencv();

/// The raster's own memory as a matrix; valid as long as the raster is neither moved nor resized.
inline cv::Mat view(GreyImage& image) {
  return {static_cast<int>(image.height_px), static_cast<int>(image.width_px), CV_8UC1, image.values.data()};
}
/// For reading only: OpenCV has no const matrix.
inline cv::Mat view(const GreyImage& image) {
  return {static_cast<int>(image.height_px), static_cast<int>(image.width_px), CV_8UC1,
          const_cast<std::uint8_t*>(image.values.data())};
}

}  // namespace colony
