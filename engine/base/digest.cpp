#include "engine/base/digest.hpp"

#include <cstring>
#include <utility>

#include <xxhash.h>


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

void CanonicalBytes::grow() {
  std::vector<std::uint8_t> larger(2 * capacity_);
  std::memcpy(larger.data(), data(), size_);
  heap_ = std::move(larger);
  capacity_ = heap_.size();
}

Digest chain(const Digest& previous, CanonicalBytes&& event) {
  std::memcpy(event.data(), previous.bytes.data(), CanonicalBytes::kLinkBytes);
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(event.data(), event.size_));
  Digest digest;
  std::memcpy(digest.bytes.data(), canonical.digest, digest.bytes.size());
  return digest;
}

}  // namespace colony
