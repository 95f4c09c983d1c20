// digest: the chain that names a history. digest(k) = XXH3-128(digest(k-1) bytes, canonical bytes of event k).
// Canonical bytes: little endian, fixed order, every optional number preceded by a presence byte, every list by its length
// (u32); no cell id is written as 0, which is no id.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
class CanonicalBytes {
 public:
  void add_u8(std::uint8_t value) { bytes_.push_back(value); }
  void add_u32(std::uint32_t value);
  void add_u64(std::uint64_t value);
  void add_double(double value);
  void add_vec3(const Vec3& value);
  void add_optional(const std::optional<double>& value);
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// digest(k) from digest(k-1) and the canonical bytes of event k.
Digest chain(const Digest& previous, const CanonicalBytes& event);

}  // namespace colony
