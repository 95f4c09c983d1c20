// render: a colony from above, as an RGB raster in one of several styles.
// Method:  shaded, contours and labels show the visible surface (top_view.hpp), brightfield and phase what light meets on
//          its way through (paths.hpp, optics.hpp). Painted strip by strip, so that what is not kept costs the memory of
//          a strip.
// Units:   um, pixels; y up. The frame has a margin of 5 % of the extent on each side.
// Threads: as many as asked for; the picture is a function of colony, parameters and spec only.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/result.hpp"
#include "engine/base/stop.hpp"
#include "engine/model/colony.hpp"
#include "engine/picture/frame.hpp"
#include "engine/picture/parallel.hpp"

namespace colony {

enum class PictureStyle { kShaded, kContours, kBrightfield, kPhase, kLabels };
enum class ColourBy { kActivity, kGeneration, kAge, kVolume };
/// Which borders `contours` draws: those between cell and background (holes included), those between two cells, or all.
enum class ContourLines { kBoth, kColony, kCells };

inline constexpr std::int64_t kPictureSideMax_px = 4096;  // unless the spec says otherwise
inline constexpr std::int64_t kRasterSideMax_px = 20000;  // whatever the spec says

struct PictureSpec {
  PictureStyle style = PictureStyle::kShaded;
  ColourBy colour_by = ColourBy::kActivity;          // shaded only
  ContourLines contour_lines = ContourLines::kBoth;  // contours only
  /// Exactly one of the two is used: um_per_px if > 0, else width_px.
  double um_per_px = 0.0;
  std::int64_t width_px = 1024;
  /// And the legend of the colours. `labels` never has one: every pixel of it is an id.
  bool scale_bar = true;
  std::int64_t side_max_px = kPictureSideMax_px;  // 1..kRasterSideMax_px
};

/// 8-bit RGB, row-major from the top row; a strip holds rows from `first_row` on.
struct Picture {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;  // of the whole picture
  double um_per_px = 0.0;
  double left_um = 0.0;  // x of the left edge
  double top_um = 0.0;   // y of the top edge
  std::int64_t first_row = 0;
  std::vector<std::uint8_t> rgb;
};

/// The frame of a spec: all bodies and the margin; 100 um for a colony without cells.
/// Errors (kInvalid/kLimit, pointer = the query parameter): a scale out of range or one that makes a side longer than
/// side_max_px.
Result<Frame> frame_of(const Colony& colony, const PictureSpec& spec);

/// Errors: as frame_of; `labels` of a colony beyond kLabelColours cells (kLimit, style). Throws Stopped when asked to.
Result<Picture> render(const Colony& colony, const Params& params, const PictureSpec& spec, StopFlag stop = nullptr);
Result<Picture> render(const Colony& colony, const Params& params, const PictureSpec& spec, const Effort& effort);

/// The same picture as strips of rows from the top, each valid during its call. Memory: about 70 MB at 20,000 pixels.
Status render_strips(const Colony& colony, const Params& params, const PictureSpec& spec, const Effort& effort,
                     const std::function<void(const Picture& strip)>& take);

/// The same picture as PNG bytes, handed over piece by piece, in order. `shaded` is marked as sRGB; the others are not: brightfield and phase hold
/// shares of light, linear (255 is all of it), which no viewer may convert, contours and labels hold no colours but codes.
Status render_png(const Colony& colony, const Params& params, const PictureSpec& spec, const Effort& effort,
                  const std::function<void(std::string_view bytes)>& take);

/// PNG bytes of a picture, with its physical pixel size (pHYs). `is_srgb` as render_png decides it by the style.
std::string encode_png(const Picture& picture, bool is_srgb = true);

/// `labels`: colours with a channel of at least 128, so that none is lost on the black background, are numbered, and a cell has that of its id
/// times 9,072,779 modulo kLabelColours: neighbours by id differ, and each colour is one id. Number n of the colour (red the highest byte): its three
/// highest bits (red 4, green 2, blue 1) less 1, then the seven low bits each of red, green and blue. Back: n times 13,006,627, modulo the same;
/// any darker colour is background, id 0.
inline constexpr std::uint32_t kLabelColours = 7U << 21;
std::uint32_t label_colour(CellId id);
CellId label_of_colour(std::uint32_t rgb);

}  // namespace colony
