// report_facts: members of an answer as rows of a page, for people: titles in words, numbers of four digits that count, units, lengths and areas in um where
//          the scale is known. A member that is null has no row. All pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/text.hpp"

namespace colony::client {

/// At most four digits that count: "12350", "204.9", "0.00022".
std::string rounded(double value);

/// "1 cell", "2 cells".
std::string counted_text(std::uint64_t count, const std::string& singular, const std::string& plural);

/// Of an `object_kind`: what its lines and the things themselves are called, as the server's sentences do. Any other kind is "objects".
struct KindNames {
  std::string one, many, walls, outline;
};
KindNames kind_names(const std::string& kind);

/// "consistent with scaling", "a crossover", ...; empty for no_figures and for what is not known.
std::string finding_text(const std::string& finding);

/// "<tr><th>title</th><td>value</td></tr>", escaped.
std::string table_row(const std::string& title, const std::string& value);

/// A number with the unit that the end of its member's name says, pixels in um where um_per_px is given: ("hole_px", 90, 0.5) is "22.5 um2".
std::string with_unit(const std::string& member, const Json& value, std::optional<double> um_per_px);

/// In words: "radius_mean_px" is "mean radius".
std::string title_of(const std::string& member);

/// Every leaf of an object as a row, `title` before its own.
void add_facts(const Json& value, const std::string& title, std::optional<double> um_per_px, std::string& rows);

}  // namespace colony::client
