// digest: the chain that names a history. digest(k) = XXH3-128(digest(k-1) bytes, canonical bytes of event k).
// Canonical bytes: little endian, fixed order, every optional number preceded by a presence byte, every list by its length
// (u32); no cell id is written as 0, which is no id.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/check.hpp"
#include "engine/base/types.hpp"

namespace colony {

/// 16 bytes in XXH128 canonical (big-endian) order; all zero before the first event.
struct Digest {
  std::array<std::uint8_t, 16> bytes{};
  friend bool operator==(const Digest&, const Digest&) = default;
  /// 32 lower-case hex digits.
  std::string hex() const;
  /// The inverse of hex(); nullopt unless exactly 32 hex digits.
  static std::optional<Digest> from_hex(std::string_view text);
};

/// Collects canonical bytes. Doubles must be finite and without negative zero (CHECKed): what is hashed is what is stored.
/// Written in place, behind room for the link before: a divided event takes no heap and is not copied. Longer ones (many
/// woken cells, a request's body) move to the heap.
class CanonicalBytes {
 public:
  void add_u8(std::uint8_t value) { add(&value, 1); }
  void add_u32(std::uint32_t value) { add(&value, sizeof value); }
  void add_u64(std::uint64_t value) { add(&value, sizeof value); }
  void add_double(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    constexpr std::uint64_t kExponent = 0x7FF0000000000000ULL, kNegativeZero = 0x8000000000000000ULL;
    CHECK((bits & kExponent) != kExponent && bits != kNegativeZero);
    add_u64(bits);
  }
  void add_vec3(const Vec3& value) {
    for (int i = 0; i < 3; ++i) add_double(value[i]);
  }
  void add_optional(const std::optional<double>& value) {
    add_u8(value ? 1 : 0);
    if (value) add_double(*value);
  }
  std::span<const std::uint8_t> bytes() const { return {data() + kLinkBytes, size_ - kLinkBytes}; }

 private:
  friend Digest chain(const Digest& previous, CanonicalBytes&& event);
  static constexpr std::size_t kLinkBytes = sizeof(Digest);
  static constexpr std::size_t kInlineBytes = 1024;
  static_assert(std::endian::native == std::endian::little);  // numbers are copied as they lie

  const std::uint8_t* data() const { return heap_.empty() ? inline_.data() : heap_.data(); }
  std::uint8_t* data() { return heap_.empty() ? inline_.data() : heap_.data(); }
  void add(const void* bytes, std::size_t n) {
    if (size_ + n > capacity_) grow();
    std::memcpy(data() + size_, bytes, n);
    size_ += n;
  }
  void grow();                                 // to twice the capacity

  std::size_t size_ = kLinkBytes;
  std::size_t capacity_ = kInlineBytes;
  std::array<std::uint8_t, kInlineBytes> inline_;  // not cleared: written before it is read
  std::vector<std::uint8_t> heap_;             // empty while inline_ suffices
};

/// digest(k) from digest(k-1) and the canonical bytes of event k, which are used up: the link before is written in front.
Digest chain(const Digest& previous, CanonicalBytes&& event);

}  // namespace colony
