// annotate: the scale bar (lower left) and the legend of the colours (upper left), drawn over a finished picture.
// Method:  the bar is the longest of 1, 2, 5 x 10^k um that is at most a fifth of the width; its length is rounded to
//          a pixel. Text and bar are drawn over a halo of the opposite lightness, to be legible over cells too.
// Units:   um, pixels.
// Threads: pure.
#pragma once

#include <string>

#include "engine/picture/colour.hpp"

namespace colony {

struct ScaleBar {
  double length_um = 0.0;
  std::int64_t length_px = 0;  // at least 1
  std::string label;           // "50 µm", "2 mm"
  std::int64_t row = 0;        // upper left pixel of the bar
  std::int64_t column = 0;
  std::int64_t thickness_px = 0;
};

struct Ink {
  Rgb text;
  Rgb halo;
};

/// Where the bar of this picture stands and what it says.
ScaleBar scale_bar_of(const Picture& picture);

void draw_scale_bar(Picture& picture, Ink ink);

/// The scale of the colour map, or the names of the activities present.
void draw_legend(Picture& picture, const Colony& colony, const ColourScale& scale, Ink ink);

}  // namespace colony
