// glyphs: a tiny bitmap font, 5 x 7 with two rows below the line, for what legends and scale bars say.
// Method:  digits, the lower-case letters, space, full stop, minus, and the two signs of "µm³"; UTF-8.
// Errors:  CHECKs that every character has a glyph: the texts are our own.
// Threads: pure.
#pragma once

#include <string_view>

#include "engine/picture/pixels.hpp"

namespace colony {

inline constexpr std::int64_t kGlyphWidth_px = 5;
inline constexpr std::int64_t kGlyphAdvance_px = 6;
inline constexpr std::int64_t kGlyphAscent_px = 7;
inline constexpr std::int64_t kGlyphHeight_px = 9;  // with the part below the line

/// Width of `text` without the space after its last glyph, at scale 1.
std::int64_t text_width_px(std::string_view text);

/// Draws `text` with its upper left corner at (row, column), every dot `scale` pixels wide.
void draw_text(Picture& picture, std::int64_t row, std::int64_t column, std::string_view text, std::int64_t scale,
               Rgb colour);

}  // namespace colony
