// ome_xml: the size of a pixel that the OME-XML of a TIFF states.
// Method:  expat over the text; attributes PhysicalSizeX/Y and their units of the element Pixels, of every Image. Nothing else is looked at.
// Units:   um; pm, nm, um (the default of the format), mm, cm and m are turned into it.
// Limits:  1 MiB of text; a document type (and with it every entity of its own) is refused.
// Errors:  none: what cannot be used is a note in words.     Threads: pure.
// Source:  OME Data Model 2016-06.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace colony {

inline constexpr std::size_t kOmeTextMax_bytes = std::size_t{1} << 20;

/// Two statements of one scale: TIFF keeps it as a fraction or in single precision, people write three digits.
inline constexpr double kScaleTolerance = 0.01;
bool scales_differ(double a_um, double b_um);
/// Six digits, without a locale.
std::string scale_text(double um);

/// An ImageDescription that is OME-XML, by its first element.
bool is_ome_xml(std::string_view text);

struct OmeScale {
  std::optional<double> um_per_px;  // one size for both sides and all images; else a note says why there is none
  std::vector<std::string> notes;
};

OmeScale read_ome_scale(std::string_view text);

}  // namespace colony
