// colour: the colour of every cell, and the scale that explains it.
// Method:  activity has three fixed colours; the other quantities run over a map of rising lightness, from the least
//          to the greatest value in the colony (generation and age from 0).
// Units:   generations, h, um3.
// Threads: pure.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/picture/pixels.hpp"

namespace colony {

inline constexpr Rgb kActiveColour{0x5f, 0xc9, 0xa0};
inline constexpr Rgb kPassiveColour{0x6f, 0x3a, 0x8c};
inline constexpr Rgb kSenescentColour{0xc4, 0x90, 0x62};

Rgb activity_colour(Activity activity);

/// The map at share 0..1: dark violet, blue, teal, green, yellow; its lightness never falls.
Rgb map_colour(double share);

/// What a legend needs to say. No title: there is nothing to explain (the colours are those of activities).
struct ColourScale {
  std::string title;     // "generation", "age", "volume"
  std::string low_text;  // the value at share 0, with its unit
  std::string high_text;
};

struct CellColours {
  std::vector<Rgb> of_cell;  // by id.value - 1
  ColourScale scale;
};

CellColours colour_cells(const Colony& colony, ColourBy colour_by);

}  // namespace colony
