// text: the few questions about bytes that HTTP asks. ASCII only; the locale never matters.
// Threads: pure.
#pragma once

#include <string_view>

namespace colony::server::http {

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
constexpr bool is_alpha(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
constexpr bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }
constexpr char to_lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// The value of a hexadecimal digit, or -1.
constexpr int hex_value(char c) {
  if (is_digit(c)) return c - '0';
  const char lower = to_lower(c);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

/// tchar of RFC 9110, 5.6.2: what field names and methods are made of.
constexpr bool is_token_char(char c) {
  return is_digit(c) || is_alpha(c) ||
         (c != '\0' && std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos);
}

bool equals_without_case(std::string_view a, std::string_view b);
bool is_token(std::string_view text);
std::string_view trim_blanks(std::string_view text);  // spaces and tabs at both ends

/// Whether a comma separated list (Connection, for one) holds `token`, compared without case.
bool list_holds(std::string_view list, std::string_view token);

/// Length of the well-formed UTF-8 character that `text` begins with; 0 if there is none. Surrogates and overlong forms
/// are not well-formed.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);

}  // namespace colony::server::http
