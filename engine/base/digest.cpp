#include "engine/base/digest.hpp"

#include <bit>
#include <cmath>
#include <cstring>

#include <xxhash.h>

#include "engine/base/check.hpp"

namespace colony {

std::string Digest::hex() const {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text(2 * bytes.size(), '0');
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    text[2 * i] = kDigits[bytes[i] >> 4];
    text[2 * i + 1] = kDigits[bytes[i] & 15];
  }
  return text;
}

std::optional<Digest> Digest::from_hex(std::string_view text) {
  if (text.size() != 32) return std::nullopt;
  Digest digest;
  for (std::size_t i = 0; i < 32; ++i) {
    const char c = text[i];
    int value = 0;
    if (c >= '0' && c <= '9') {
      value = c - '0';
    } else if (c >= 'a' && c <= 'f') {
      value = c - 'a' + 10;
    } else {
      return std::nullopt;
    }
    digest.bytes[i / 2] = static_cast<std::uint8_t>(digest.bytes[i / 2] * 16 + value);
  }
  return digest;
}

void CanonicalBytes::add_u32(std::uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void CanonicalBytes::add_u64(std::uint64_t value) {
  for (int i = 0; i < 8; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void CanonicalBytes::add_double(double value) {
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(value);
  CHECK(std::isfinite(value) && bits != 0x8000000000000000ULL);
  add_u64(bits);
}

void CanonicalBytes::add_vec3(const Vec3& value) {
  for (int i = 0; i < 3; ++i) add_double(value[i]);
}

void CanonicalBytes::add_optional(const std::optional<double>& value) {
  add_u8(value ? 1 : 0);
  if (value) add_double(*value);
}

Digest chain(const Digest& previous, const CanonicalBytes& event) {
  std::vector<std::uint8_t> link(previous.bytes.begin(), previous.bytes.end());
  link.insert(link.end(), event.bytes().begin(), event.bytes().end());
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(link.data(), link.size()));
  Digest digest;
  std::memcpy(digest.bytes.data(), canonical.digest, digest.bytes.size());
  return digest;
}

}  // namespace colony
