// render: a top view of the deformed cells as an RGB raster.
// Method:  for every pixel the column z >= 0 is searched for the highest point of any f~ >= 0; at contacts the exact face f_i = f_j.
// Units:   um, pixels; y up. The frame has a margin of 5 % of the extent on each side.
// Threads: pure; the picture is a function of its arguments only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/base/stop.hpp"
#include "engine/model/colony.hpp"

namespace colony {

enum class PictureStyle { kShaded, kContours };
enum class ColourBy { kActivity, kGeneration, kAge, kVolume };

struct PictureSpec {
  PictureStyle style = PictureStyle::kShaded;
  ColourBy colour_by = ColourBy::kActivity;
  /// Exactly one of the two is used: um_per_px if > 0, else width_px.
  double um_per_px = 0.0;
  std::int64_t width_px = 1024;
  bool scale_bar = true;    // and the legend of the colours
};

inline constexpr std::int64_t kPictureSideMax_px = 4096;  // about 15 s of one core for a full frame

/// 8-bit RGB, row-major from the top row.
struct Picture {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  double um_per_px = 0.0;
  double left_um = 0.0;     // x of the left edge
  double top_um = 0.0;      // y of the top edge
  std::vector<std::uint8_t> rgb;
};

/// Errors (kInvalid/kLimit, pointer = the query parameter): a scale that makes a side longer than kPictureSideMax_px.
/// A colony without cells gives an empty background of 100 um.
/// Throws Stopped when asked to.
Result<Picture> render(const Colony& colony, const Params& params, const PictureSpec& spec, StopFlag stop = nullptr);

/// PNG bytes of a picture, with its physical pixel size (pHYs).
std::string encode_png(const Picture& picture);

}  // namespace colony
