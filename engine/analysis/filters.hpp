// filters: the single steps of segmentation, each a function from raster to raster.
// Shapes:  every result has the shape and scale of its input. Beyond the frame pixels are mirrored (windows) or absent (components).
// Units:   pixels, grey levels 0..255. Distances in sixteenths of a pixel.
// Exact:   everything but `clahe` (single precision in OpenCV, see opencv.hpp) is integer arithmetic.
// Errors:  CHECKs the shapes; images come through check_image before.     Threads: pure, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/analysis/image.hpp"

namespace colony {

/// Pixels of each grey level.
std::array<std::int64_t, 256> histogram(const GreyImage& image);

/// 255 - v.
GreyImage inverted(const GreyImage& image);

/// What the image would be without light objects narrower than `reach_px`: a morphological opening with a square of that side, smoothed by a mean over
/// it. Computed on means of blocks where the side is above 64 (the background is smooth) and spread by linear interpolation.
GreyImage background(const GreyImage& image, std::int64_t reach_px);

/// image - background, not below 0.
GreyImage subtracted(const GreyImage& image, const GreyImage& background);

/// Contrast-limited adaptive histogram equalisation, 8 x 8 tiles, clip limit 2.
GreyImage clahe(const GreyImage& image);

/// A binomial 3 x 3 (1 2 1) mean, rounded.
GreyImage smoothed(const GreyImage& image);

/// round(sqrt(255 v)): photon noise grows with the square root, so dim and bright objects get edges alike.
GreyImage square_root(const GreyImage& image);

inline constexpr std::int64_t kWindowRadiusMax_px = 100;

/// The standard deviation in windows of (2 radius + 1)^2, on a logarithmic scale: round(255 log(1 + sd) / log(1 + 127.5)).
GreyImage local_deviation(const GreyImage& image, std::int64_t radius_px);

/// Otsu: the level t that parts the histogram of levels `from`..255 into two classes (v <= t, v > t) with the greatest variance between them; the middle
/// one where several do. Returns -1 if fewer than two levels occur.
int otsu(const GreyImage& image, int from = 0);

/// 255 where v > level, else 0.
BinaryImage above(const GreyImage& image, int level);

/// 255 where the disc of `radius_px` about a pixel lies in the foreground.
BinaryImage eroded(const BinaryImage& mask, std::int64_t radius_px);
BinaryImage opened(const BinaryImage& mask, std::int64_t radius_px);

/// Background pieces (4-connected) that do not touch the frame and have at most `hole_max_px` pixels become foreground.
BinaryImage holes_filled(const BinaryImage& mask, std::int64_t hole_max_px);

struct Piece {
  std::int64_t area_px = 0;
  std::int64_t left = 0, top = 0, width = 0, height = 0;
  bool touches_frame = false;
};
struct Pieces {
  LabelImage labels;  // 0 background, piece i has label i + 1; numbered by their first pixel in reading order
  std::vector<Piece> pieces;
};
/// Connected foreground (8-connected).
Pieces pieces_of(const BinaryImage& mask);

/// Sixteenths of a pixel to the nearest background pixel (chamfer 5 x 5, within 2 % of Euclid); the frame is no background.
Grey16Image distance_inside(const BinaryImage& mask);

}  // namespace colony
