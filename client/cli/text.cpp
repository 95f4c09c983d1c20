#include "client/cli/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace colony::client {

std::string printable(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool c1 = c == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if (c1) ++i;
    out += c < 0x20 || c == 0x7F || c1 ? '?' : text[i];
  }
  return out;
}

std::string fixed(double value, int decimals) {
  std::array<char, 400> buffer{};
  const int size = std::snprintf(buffer.data(), buffer.size(), "%.*f", decimals, value);
  std::string text(buffer.data(), static_cast<std::size_t>(size));
  const bool zero = text.find_first_not_of("-0.") == std::string::npos;
  return zero && text.front() == '-' ? text.substr(1) : text;
}

std::string cell_text(const Json& value, int decimals) {
  if (value.is_null()) return "-";
  if (value.is_string()) return printable(value.get_ref<const std::string&>());
  if (value.is_number_float()) return fixed(value.get<double>(), decimals);
  return printable(value.dump());
}

std::string member_text(const Json& object, const char* name, int decimals) {
  if (!object.is_object()) return "-";
  const auto found = object.find(name);
  return found == object.end() ? "-" : cell_text(*found, decimals);
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(std::llround(std::clamp(seconds, 0.0, 1e12)));
  if (whole < 120) return std::to_string(whole) + " s";
  if (whole < 7200) return std::to_string(whole / 60) + " min";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole / 60 % 60) + " min";
}

namespace {

void write_pretty(const Json& value, int indent, std::string& out) {
  const auto line = [&](int depth) { out += '\n' + std::string(static_cast<std::size_t>(depth) * 2, ' '); };
  const bool flat = value.is_array() &&
                    std::none_of(value.begin(), value.end(), [](const Json& item) { return item.is_structured(); });
  if (!value.is_structured() || value.empty() || flat) {
    if (!flat || value.empty()) {
      out += value.dump();
      return;
    }
    out += '[';
    for (std::size_t i = 0; i < value.size(); ++i) out += (i > 0 ? ", " : "") + value[i].dump();
    out += ']';
    return;
  }
  out += value.is_array() ? '[' : '{';
  bool first = true;
  for (const auto& [key, item] : value.items()) {
    if (!first) out += ',';
    first = false;
    line(indent + 1);
    if (value.is_object()) out += Json(key).dump() + ": ";
    write_pretty(item, indent + 1, out);
  }
  line(indent);
  out += value.is_array() ? ']' : '}';
}

bool looks_numeric(const std::string& text) { return text == "-" || to_number(text).has_value(); }

/// Columns a UTF-8 text takes, counting every code point as one.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace

std::string pretty(const Json& value) {
  std::string out;
  write_pretty(value, 0, out);
  return out + '\n';
}

std::string table_text(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  const std::size_t columns = header.size();
  std::vector<std::size_t> widths(columns);
  std::vector<bool> right(columns, true);
  for (std::size_t c = 0; c < columns; ++c) {
    widths[c] = width_of(header[c]);
    for (const auto& row : rows) {
      widths[c] = std::max(widths[c], width_of(row[c]));
      right[c] = right[c] && looks_numeric(row[c]);
    }
  }
  std::string out;
  const auto write = [&](const std::vector<std::string>& row) {
    std::string line;
    for (std::size_t c = 0; c < columns; ++c) {
      const std::string pad(widths[c] - width_of(row[c]), ' ');
      line += (c > 0 ? "  " : "") + (right[c] ? pad + row[c] : row[c] + pad);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + '\n';
  };
  write(header);
  for (const auto& row : rows) write(row);
  return out;
}

std::string sparkline(const std::vector<double>& values, std::size_t width, bool utf8) {
  static constexpr std::array<const char*, 8> kBlocks = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  static constexpr std::array<const char*, 8> kAscii = {"_", ".", ":", "-", "=", "+", "*", "#"};
  if (values.empty() || width == 0) return {};
  const double top = *std::max_element(values.begin(), values.end());
  const std::size_t columns = std::min(width, values.size());
  std::string out;
  for (std::size_t c = 0; c < columns; ++c) {
    const double value = values[(c + 1) * values.size() / columns - 1];
    const double level = top > 0 ? std::clamp(value / top, 0.0, 1.0) * 7.0 : 0.0;
    const auto index = static_cast<std::size_t>(std::lround(level));
    out += utf8 ? kBlocks[index] : kAscii[index];
  }
  return out;
}

std::optional<std::int64_t> to_integer(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> to_number(std::string_view text) {
  double value = 0;
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace colony::client
