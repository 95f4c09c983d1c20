#include "engine/picture/glyphs.hpp"

#include <array>

#include "engine/base/check.hpp"

namespace colony {
namespace {

struct Glyph {
  unsigned code;                                            // Unicode
  std::array<std::uint8_t, kGlyphHeight_px> rows;           // five bits a row, the highest is the left dot
};

constexpr Glyph kGlyphs[] = {
    {0x30, {0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110, 0b00000, 0b00000}},  // 0
    {0x31, {0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000}},  // 1
    {0x32, {0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111, 0b00000, 0b00000}},  // 2
    {0x33, {0b11110, 0b00001, 0b00001, 0b01110, 0b00001, 0b00001, 0b11110, 0b00000, 0b00000}},  // 3
    {0x34, {0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010, 0b00000, 0b00000}},  // 4
    {0x35, {0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110, 0b00000, 0b00000}},  // 5
    {0x36, {0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000}},  // 6
    {0x37, {0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000, 0b00000, 0b00000}},  // 7
    {0x38, {0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000}},  // 8
    {0x39, {0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100, 0b00000, 0b00000}},  // 9
    {0x61, {0b00000, 0b00000, 0b01110, 0b00001, 0b01111, 0b10001, 0b01111, 0b00000, 0b00000}},  // a
    {0x62, {0b10000, 0b10000, 0b11110, 0b10001, 0b10001, 0b10001, 0b11110, 0b00000, 0b00000}},  // b
    {0x63, {0b00000, 0b00000, 0b01110, 0b10000, 0b10000, 0b10001, 0b01110, 0b00000, 0b00000}},  // c
    {0x64, {0b00001, 0b00001, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111, 0b00000, 0b00000}},  // d
    {0x65, {0b00000, 0b00000, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110, 0b00000, 0b00000}},  // e
    {0x66, {0b00110, 0b01001, 0b01000, 0b11100, 0b01000, 0b01000, 0b01000, 0b00000, 0b00000}},  // f
    {0x67, {0b00000, 0b00000, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111, 0b00001, 0b01110}},  // g
    {0x68, {0b10000, 0b10000, 0b10110, 0b11001, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000}},  // h
    {0x69, {0b00100, 0b00000, 0b01100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000}},  // i
    {0x6a, {0b00010, 0b00000, 0b00110, 0b00010, 0b00010, 0b00010, 0b00010, 0b10010, 0b01100}},  // j
    {0x6b, {0b10000, 0b10000, 0b10010, 0b10100, 0b11000, 0b10100, 0b10010, 0b00000, 0b00000}},  // k
    {0x6c, {0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000}},  // l
    {0x6d, {0b00000, 0b00000, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101, 0b00000, 0b00000}},  // m
    {0x6e, {0b00000, 0b00000, 0b10110, 0b11001, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000}},  // n
    {0x6f, {0b00000, 0b00000, 0b01110, 0b10001, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000}},  // o
    {0x70, {0b00000, 0b00000, 0b11110, 0b10001, 0b10001, 0b10001, 0b11110, 0b10000, 0b10000}},  // p
    {0x71, {0b00000, 0b00000, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111, 0b00001, 0b00001}},  // q
    {0x72, {0b00000, 0b00000, 0b10110, 0b11001, 0b10000, 0b10000, 0b10000, 0b00000, 0b00000}},  // r
    {0x73, {0b00000, 0b00000, 0b01111, 0b10000, 0b01110, 0b00001, 0b11110, 0b00000, 0b00000}},  // s
    {0x74, {0b01000, 0b01000, 0b11100, 0b01000, 0b01000, 0b01001, 0b00110, 0b00000, 0b00000}},  // t
    {0x75, {0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10011, 0b01101, 0b00000, 0b00000}},  // u
    {0x76, {0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b01010, 0b00100, 0b00000, 0b00000}},  // v
    {0x77, {0b00000, 0b00000, 0b10001, 0b10001, 0b10101, 0b10101, 0b01010, 0b00000, 0b00000}},  // w
    {0x78, {0b00000, 0b00000, 0b10001, 0b01010, 0b00100, 0b01010, 0b10001, 0b00000, 0b00000}},  // x
    {0x79, {0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10001, 0b01111, 0b00001, 0b01110}},  // y
    {0x7a, {0b00000, 0b00000, 0b11111, 0b00010, 0b00100, 0b01000, 0b11111, 0b00000, 0b00000}},  // z
    {0x20, {0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000}},  // space
    {0x2e, {0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100, 0b00000, 0b00000}},  // .
    {0x2d, {0b00000, 0b00000, 0b00000, 0b11111, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000}},  // -
    {0xb5, {0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10011, 0b11101, 0b10000, 0b10000}},  // micro
    {0xb3, {0b01110, 0b00010, 0b00110, 0b00010, 0b01110, 0b00000, 0b00000, 0b00000, 0b00000}},  // superscript three
};

const Glyph& glyph_of(unsigned code) {
  for (const Glyph& glyph : kGlyphs) {
    if (glyph.code == code) return glyph;
  }
  CHECK(false);
  return kGlyphs[0];
}

/// Takes one character off the front: ASCII, or two bytes of UTF-8.
unsigned take_code(std::string_view& text) {
  const auto first = static_cast<unsigned char>(text.front());
  text.remove_prefix(1);
  if (first < 0x80) return first;
  CHECK((first & 0xe0u) == 0xc0u && !text.empty());
  const auto second = static_cast<unsigned char>(text.front());
  text.remove_prefix(1);
  return ((first & 0x1fu) << 6) | (second & 0x3fu);
}

}  // namespace

std::int64_t text_width_px(std::string_view text) {
  std::int64_t count = 0;
  for (; !text.empty(); ++count) take_code(text);
  return count == 0 ? 0 : count * kGlyphAdvance_px - (kGlyphAdvance_px - kGlyphWidth_px);
}

void draw_text(Picture& picture, std::int64_t row, std::int64_t column, std::string_view text, std::int64_t scale,
               Rgb colour) {
  while (!text.empty()) {
    const Glyph& glyph = glyph_of(take_code(text));
    for (std::int64_t y = 0; y < kGlyphHeight_px; ++y) {
      for (std::int64_t x = 0; x < kGlyphWidth_px; ++x) {
        if ((glyph.rows[static_cast<std::size_t>(y)] >> (kGlyphWidth_px - 1 - x) & 1) == 0) continue;
        fill_rectangle(picture, row + y * scale, column + x * scale, scale, scale, colour);
      }
    }
    column += kGlyphAdvance_px * scale;
  }
}

}  // namespace colony
