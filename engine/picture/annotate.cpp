#include "engine/picture/annotate.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "engine/picture/glyphs.hpp"

namespace colony {
namespace {

constexpr double kBarShareMax = 0.2;  // of the picture's width
// Letters of 10 x 14 pixels wherever the longest legend has room for them; it takes 400 then.
constexpr std::int64_t kReadableWidth_px = 480;
constexpr std::int64_t kWidthPerTextScale_px = 400;

/// Pixels a dot of the font, and the unit of every distance here.
std::int64_t unit_px(const Picture& picture) {
  return picture.width_px < kReadableWidth_px ? 1 : std::max<std::int64_t>(2, picture.width_px / kWidthPerTextScale_px);
}

void draw_haloed_text(Picture& picture, std::int64_t row, std::int64_t column, std::string_view text, Ink ink) {
  const std::int64_t unit = unit_px(picture);
  for (std::int64_t dy = -1; dy <= 1; ++dy) {
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      draw_text(picture, row + dy * unit, column + dx * unit, text, unit, ink.halo);
  }
  draw_text(picture, row, column, text, unit, ink.text);
}

void draw_haloed_rectangle(Picture& picture, std::int64_t row, std::int64_t column, std::int64_t height,
                           std::int64_t width, Rgb colour, Rgb halo) {
  const std::int64_t unit = unit_px(picture);
  fill_rectangle(picture, row - unit, column - unit, height + 2 * unit, width + 2 * unit, halo);
  fill_rectangle(picture, row, column, height, width, colour);
}

struct RoundLength {
  double um = 0.0;
  std::string label;
};

/// mantissa x 10^exponent um. Tens are multiplied or divided once, so the value is the double nearest to its label.
RoundLength round_length(int mantissa, int exponent) {
  double power = 1.0;
  for (int i = 0; i < (exponent < 0 ? -exponent : exponent); ++i) power *= 10.0;
  if (exponent >= 3) {
    return {mantissa * power,
            std::to_string(mantissa) + std::string(static_cast<std::size_t>(exponent - 3), '0') + " mm"};
  }
  if (exponent >= 0) {
    return {mantissa * power, std::to_string(mantissa) + std::string(static_cast<std::size_t>(exponent), '0') + " µm"};
  }
  return {mantissa / power,
          "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + std::to_string(mantissa) + " µm"};
}

}  // namespace

ScaleBar scale_bar_of(const Picture& picture) {
  constexpr std::array<int, 3> kMantissas = {1, 2, 5};
  constexpr int kExponentMin = -4, kExponentMax = 9;  // wider than any picture can be
  const double length_max_um = kBarShareMax * static_cast<double>(picture.width_px) * picture.um_per_px;
  RoundLength best = round_length(1, kExponentMin);
  for (int exponent = kExponentMin; exponent <= kExponentMax; ++exponent) {
    for (const int mantissa : kMantissas) {
      RoundLength length = round_length(mantissa, exponent);
      if (length.um <= length_max_um) best = std::move(length);
    }
  }
  const std::int64_t unit = unit_px(picture);
  ScaleBar bar;
  bar.length_um = best.um;
  bar.length_px = std::max<std::int64_t>(1, floor_to_int(best.um / picture.um_per_px + 0.5));
  bar.label = best.label;
  bar.thickness_px = 2 * unit;
  bar.row = picture.height_px - 7 * unit;
  bar.column = 6 * unit;
  return bar;
}

void draw_scale_bar(Picture& picture, Ink ink) {
  const ScaleBar bar = scale_bar_of(picture);
  draw_haloed_rectangle(picture, bar.row, bar.column, bar.thickness_px, bar.length_px, ink.text, ink.halo);
  draw_haloed_text(picture, bar.row - (kGlyphHeight_px + 1) * unit_px(picture), bar.column, bar.label, ink);
}

void draw_legend(Picture& picture, const Colony& colony, const ColourScale& scale, Ink ink) {
  const std::int64_t unit = unit_px(picture);
  const std::int64_t row = 6 * unit;
  const std::int64_t swatch_px = kGlyphAscent_px * unit;
  std::int64_t column = 6 * unit;
  const auto write = [&](std::string_view text) {
    draw_haloed_text(picture, row, column, text, ink);
    column += (text_width_px(text) + kGlyphAdvance_px) * unit;
  };
  if (scale.title.empty()) {
    for (const Activity activity : {Activity::kActive, Activity::kPassive, Activity::kSenescent}) {
      if (colony.count(activity) == 0) continue;
      draw_haloed_rectangle(picture, row, column, swatch_px, swatch_px, activity_colour(activity), ink.halo);
      column += swatch_px + 4 * unit;
      write(name_of(activity));
      column += 2 * unit;
    }
    return;
  }
  write(scale.title);
  write(scale.low_text);
  const std::int64_t length_px = 50 * unit;
  draw_haloed_rectangle(picture, row, column, swatch_px, length_px, {}, ink.halo);
  for (std::int64_t i = 0; i < length_px; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(length_px - 1);
    fill_rectangle(picture, row, column + i, swatch_px, 1, map_colour(share));
  }
  column += length_px + kGlyphAdvance_px * unit;
  write(scale.high_text);
}

}  // namespace colony
