// slim_optional: a value or none, as std::optional, in the bytes of the value alone: "none" is one value that is never a value.
// Why:     std::optional pads its flag to the value's alignment; a cell holds eight of them, and there are millions of cells.
// Errors:  CHECKs that a value given is not the one that stands for none; DCHECKs that there is one where it is asked for.
// Threads: as the value's.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>

#include "engine/base/check.hpp"
#include "engine/base/types.hpp"

namespace colony {

/// What stands for none. For numbers a quiet NaN with a payload that no arithmetic makes: any other NaN is a value, and is
/// refused where values are (canonicalise).
template <class T>
struct NoneOf;
template <>
struct NoneOf<double> {
  static constexpr std::uint64_t kBits = 0x7FF8'6E6F'6E65'0001;
  static double none() { return std::bit_cast<double>(kBits); }
  static bool is_none(double value) { return std::bit_cast<std::uint64_t>(value) == kBits; }
};
template <>
struct NoneOf<Vec3> {  // by its first component
  static Vec3 none() { return {NoneOf<double>::none(), 0.0, 0.0}; }
  static bool is_none(const Vec3& value) { return NoneOf<double>::is_none(value.x()); }
};
template <>
struct NoneOf<CellId> {  // 0 is no cell
  static CellId none() { return {}; }
  static bool is_none(CellId value) { return value == CellId{}; }
};

/// The part of std::optional's interface that is used here; converts from and to it.
template <class T>
class SlimOptional {
 public:
  SlimOptional() : value_(NoneOf<T>::none()) {}
  SlimOptional(std::nullopt_t) : SlimOptional() {}                  // NOLINT: implicit, as std::optional
  SlimOptional(const T& value) : value_(value) { CHECK(has_value()); }
  SlimOptional(const std::optional<T>& other) : SlimOptional() {
    if (other) *this = SlimOptional(*other);
  }
  operator std::optional<T>() const { return has_value() ? std::optional<T>(value_) : std::nullopt; }

  bool has_value() const { return !NoneOf<T>::is_none(value_); }
  explicit operator bool() const { return has_value(); }
  const T& operator*() const {
    DCHECK(has_value());
    return value_;
  }
  T& operator*() {
    DCHECK(has_value());
    return value_;
  }
  const T* operator->() const { return &**this; }
  T* operator->() { return &**this; }
  T value_or(const T& other) const { return has_value() ? value_ : other; }
  void reset() { value_ = NoneOf<T>::none(); }

  friend bool operator==(const SlimOptional& a, const SlimOptional& b) {
    return a.has_value() && b.has_value() ? a.value_ == b.value_ : a.has_value() == b.has_value();
  }
  /// Each of its own: std::optional's templates would take a SlimOptional for a value, and conversions would be ambiguous.
  friend bool operator==(const SlimOptional& a, const std::optional<T>& b) { return a == SlimOptional(b); }
  friend bool operator==(const SlimOptional& a, std::nullopt_t) { return !a.has_value(); }
  friend bool operator==(const SlimOptional& a, const T& b) { return a.has_value() && a.value_ == b; }

 private:
  T value_;
};

}  // namespace colony
