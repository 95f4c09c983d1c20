// paged: a growing array in pages of equal size. It never moves what it holds and never needs twice its memory to grow, as a
// vector does while it doubles: beyond its elements it takes one page at most, and a spare one while it shrinks.
// Errors:  DCHECKs the range. What is popped keeps its last value in its place until something is pushed there.
// Threads: as a vector: const functions on many threads, the others exclusive.
#pragma once

#include <algorithm>
#include <compare>
#include <cstddef>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "engine/base/check.hpp"

namespace colony {

/// T: default constructible and copyable. An element's address holds until it is popped, or the whole is assigned to.
template <class T>
class Paged {
 public:
  /// Elements of a page: the power of two that fills at most 16 KiB, so that an index splits by shift and mask.
  static constexpr std::size_t kPageBytesMax = 16 * 1024;
  static constexpr std::size_t kPageSize = [] {
    std::size_t n = 1;
    while (2 * n * sizeof(T) <= kPageBytesMax) n *= 2;
    return n;
  }();

  /// Read only: elements change by operator[] of the container.
  class ConstIterator {
   public:
    using iterator_category = std::random_access_iterator_tag;
    using value_type = T;
    using difference_type = std::ptrdiff_t;
    using pointer = const T*;
    using reference = const T&;

    ConstIterator() = default;
    ConstIterator(const Paged* paged, std::size_t index) : paged_(paged), index_(index) {}
    reference operator*() const { return (*paged_)[index_]; }
    pointer operator->() const { return &(*paged_)[index_]; }
    reference operator[](difference_type n) const { return *(*this + n); }
    ConstIterator& operator+=(difference_type n) {
      index_ = static_cast<std::size_t>(static_cast<difference_type>(index_) + n);
      return *this;
    }
    ConstIterator& operator-=(difference_type n) { return *this += -n; }
    ConstIterator& operator++() { return *this += 1; }
    ConstIterator& operator--() { return *this += -1; }
    ConstIterator operator++(int) { return std::exchange(*this, *this + 1); }
    ConstIterator operator--(int) { return std::exchange(*this, *this - 1); }
    friend ConstIterator operator+(ConstIterator it, difference_type n) { return it += n; }
    friend ConstIterator operator+(difference_type n, ConstIterator it) { return it += n; }
    friend ConstIterator operator-(ConstIterator it, difference_type n) { return it -= n; }
    friend difference_type operator-(const ConstIterator& a, const ConstIterator& b) {
      return static_cast<difference_type>(a.index_) - static_cast<difference_type>(b.index_);
    }
    friend bool operator==(const ConstIterator& a, const ConstIterator& b) { return a.index_ == b.index_; }
    friend auto operator<=>(const ConstIterator& a, const ConstIterator& b) { return a.index_ <=> b.index_; }

   private:
    const Paged* paged_ = nullptr;
    std::size_t index_ = 0;
  };
  using value_type = T;
  using const_iterator = ConstIterator;
  using iterator = ConstIterator;

  Paged() = default;
  Paged(const Paged& other) : size_(other.size_) {
    pages_.reserve((size_ + kPageSize - 1) / kPageSize);
    for (std::size_t begin = 0; begin < size_; begin += kPageSize) {
      const T* from = other.pages_[begin / kPageSize].get();
      pages_.push_back(std::make_unique<T[]>(kPageSize));
      std::copy(from, from + std::min(kPageSize, size_ - begin), pages_.back().get());
    }
  }
  Paged(Paged&& other) noexcept : pages_(std::move(other.pages_)), size_(std::exchange(other.size_, 0)) {
    other.pages_.clear();
  }
  Paged& operator=(const Paged& other) { return *this = Paged(other); }
  Paged& operator=(Paged&& other) noexcept {
    pages_ = std::move(other.pages_);
    other.pages_.clear();
    size_ = std::exchange(other.size_, 0);
    return *this;
  }
  ~Paged() = default;

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T& operator[](std::size_t index) const {
    DCHECK(index < size_);
    return pages_[index / kPageSize][index % kPageSize];
  }
  T& operator[](std::size_t index) {
    DCHECK(index < size_);
    return pages_[index / kPageSize][index % kPageSize];
  }
  /// A hint that the element will be read soon.
  void prefetch(std::size_t index) const {
    const char* const at = reinterpret_cast<const char*>(&(*this)[index]);
    for (std::size_t line = 0; line < sizeof(T); line += 64) __builtin_prefetch(at + line);
  }
  const T& front() const { return (*this)[0]; }
  const T& back() const { return (*this)[size_ - 1]; }
  const_iterator begin() const { return {this, 0}; }
  const_iterator end() const { return {this, size_}; }

  void push_back(const T& value) {
    if (size_ == pages_.size() * kPageSize) pages_.push_back(std::make_unique<T[]>(kPageSize));
    ++size_;
    (*this)[size_ - 1] = value;
  }
  /// Gives pages back, all but one spare: at a page's edge it would come and go.
  void pop_back() {
    DCHECK(size_ > 0);
    --size_;
    if (pages_.size() * kPageSize - size_ >= 2 * kPageSize) pages_.pop_back();
  }

  /// All heap that it holds.
  std::size_t memory_bytes() const {
    return pages_.size() * kPageSize * sizeof(T) + pages_.capacity() * sizeof(std::unique_ptr<T[]>);
  }

 private:
  std::vector<std::unique_ptr<T[]>> pages_;
  std::size_t size_ = 0;
};

}  // namespace colony
