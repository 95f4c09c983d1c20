// text: turning values into what a person reads in a terminal. All pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace colony::client {

/// Keeps the order of keys, so that a job spec reads as it was written.
using Json = nlohmann::ordered_json;

/// Control characters (C0, DEL, C1) become '?': names and messages come from other people, and a terminal obeys what it
/// is sent.
std::string printable(std::string_view text);

/// `decimals` digits after the point, without "-0".
std::string fixed(double value, int decimals);

/// A JSON value in a table cell: strings without quotes, null as "-", other numbers than integers with `decimals`
/// digits.
std::string cell_text(const Json& value, int decimals = 2);

/// The member `name` as cell_text; "-" if the object has none.
std::string member_text(const Json& object, const char* name, int decimals = 2);

/// "48 s", "12 min", "3 h 20 min".
std::string duration_text(double seconds);

/// Indented JSON with arrays of numbers on one line, so that intervals and positions stay readable.
std::string pretty(const Json& value);

/// Columns and rows with equal widths; numbers to the right. No trailing spaces.
std::string table_text(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);

/// One sign for each value, 0 the lowest; `width` columns at most (each shows the last value that falls into it).
std::string sparkline(const std::vector<double>& values, std::size_t width, bool utf8);

/// The whole text as an integer or a number, else nullopt. Decimal only: "010" is ten, "0x10" and "1e999" are nothing.
std::optional<std::int64_t> to_integer(std::string_view text);
std::optional<double> to_number(std::string_view text);

}  // namespace colony::client
