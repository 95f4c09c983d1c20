#include "server/store/identity.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <random>

namespace colony::server {
namespace {

std::string hex16(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

std::uint64_t mix(std::uint64_t x) {  // the finaliser of SplitMix64: every input bit reaches every output bit
  x ^= x >> 30;
  x *= 0xBF58476D1CE4E5B9ULL;
  x ^= x >> 27;
  x *= 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

std::uint64_t seal(std::uint64_t key, std::int64_t salt) {
  const auto secret = static_cast<std::uint64_t>(salt);
  return mix(mix(key + 0x9E3779B97F4A7C15ULL + secret) ^ (secret << 32 | secret >> 32));
}

std::optional<std::uint64_t> from_hex16(std::string_view text) {
  std::uint64_t value = 0;
  for (const char c : text) {
    if (c >= '0' && c <= '9') {
      value = value << 4 | static_cast<std::uint64_t>(c - '0');
    } else if (c >= 'a' && c <= 'f') {
      value = value << 4 | static_cast<std::uint64_t>(c - 'a' + 10);
    } else {
      return std::nullopt;
    }
  }
  return value;
}

}  // namespace

std::int64_t wall_time_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string wall_time_text() { return wall_time_text_at(wall_time_ms()); }

std::string wall_time_text_at(std::int64_t at_ms) {
  const std::int64_t ms = std::max<std::int64_t>(at_ms, 0);
  const auto seconds = static_cast<std::time_t>(ms / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02d-%02dT%02d:%02d:%02d.%03dZ", utc.tm_year + 1900, utc.tm_mon + 1,
                utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, static_cast<int>(ms % 1000));
  return text.data();
}

std::optional<std::int64_t> unix_ms_of(std::string_view text) {
  std::tm utc{};
  int ms = 0;
  int used = 0;
  const std::string whole(text);
  const int fields = std::sscanf(whole.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d.%3dZ%n", &utc.tm_year, &utc.tm_mon, &utc.tm_mday,
                                 &utc.tm_hour, &utc.tm_min, &utc.tm_sec, &ms, &used);
  if (fields != 7 || used != static_cast<int>(whole.size())) return std::nullopt;
  utc.tm_year -= 1900;
  utc.tm_mon -= 1;
  const std::int64_t value = static_cast<std::int64_t>(timegm(&utc)) * 1000 + ms;
  if (wall_time_text_at(value) != text) return std::nullopt;  // 31 February, or another spelling
  return value;
}

std::string new_job_id() {
  std::random_device device;  // the system's generator on Linux
  const auto draw = [&device] { return static_cast<std::uint64_t>(device()) << 32 | device(); };
  const std::uint64_t high = static_cast<std::uint64_t>(wall_time_ms()) << 16 | 0x7000U | (draw() & 0xFFFU);
  const std::uint64_t low = 0x8000000000000000ULL | (draw() >> 2);
  const std::string digits = hex16(high) + hex16(low);
  return digits.substr(0, 8) + "-" + digits.substr(8, 4) + "-" + digits.substr(12, 4) + "-" + digits.substr(16, 4) +
         "-" + digits.substr(20);
}

std::string cursor_text(std::int64_t job_key, std::int64_t salt) {
  const auto key = static_cast<std::uint64_t>(job_key);
  const std::uint64_t check = seal(key, salt);
  return hex16(key ^ mix(check)) + hex16(check);
}

std::optional<std::int64_t> cursor_key(std::string_view text, std::int64_t salt) {
  if (text.size() != 32) return std::nullopt;
  const auto hidden = from_hex16(text.substr(0, 16));
  const auto check = from_hex16(text.substr(16));
  if (!hidden || !check) return std::nullopt;
  const std::uint64_t key = *hidden ^ mix(*check);
  if (seal(key, salt) != *check) return std::nullopt;
  return static_cast<std::int64_t>(key);
}

}  // namespace colony::server
