// stream: random numbers that are addressed, not drawn in sequence: Philox4x32-10.
// Method:  key = the job's seed; counter = (cell id, the cell's ordinal, purpose (8 bits) and lane (24 bits), block).
//          No generator state exists outside a Stream, so a history can be continued from any event.
// Threads: a Stream is used by one thread; any number of Streams may exist.
// Source:  Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"; library Random123.
#pragma once

#include <array>
#include <cstdint>

#include "engine/base/types.hpp"

namespace colony {

/// Why a number is drawn. Stored nowhere but in the meaning of a seed: never reuse or renumber.
enum class Purpose : std::uint8_t {
  kFounder = 1,          // a founder's body; lane 0
  kFounderPlace = 2,     // lane = try
  kCycle = 3,            // lane 0: the cell that keeps the id (or a founder), 1: the daughter
  kNoiseOffset = 4,      // lane as kCycle
  kIsolation = 5,        // scrambling: does the cell touch anybody?
  kSplitDirection = 6,   // of an isolated cell
  kSearch = 7,           // lane = generation: the genetic search
  kSearchPoints = 8,     // scrambling of the search's points
  kFinalPoints = 9,      // scrambling of the winner's fresh points
  kSettlePoints = 10,    // scrambling: centre of mass and nearest membrane
  kFreeShare = 11,       // scrambling of the disc
  kRetry = 12,           // next cycle after an unlucky search
  kRetained = 13,        // scrambling: a neighbour's retained share; lane 0: in the search, 1: of the winner
  kMoveDelay = 14,       // time to the next move; lane 0: the cell itself, 1: the daughter of its division
  kMove = 15,            // of a move: guided or not, and the direction
  kMoveSurroundings = 16,  // scrambling of the disc in which a move looks for the freer half
  kMovePoints = 17,      // scrambling of the points on which a moved body is scored
  kSplitPerpendicular = 18,  // several layers: which of the planes through nucleus centre and nearest membrane point
  kControl = 32,         // places of the discs of a random control; no part of any history
};

class Stream {
 public:
  Stream(Seed seed, CellId cell, std::uint32_t ordinal, Purpose purpose, std::uint32_t lane = 0);

  std::uint32_t next_u32() {
    if (used_ == held_) refill();
    return words_[static_cast<std::size_t>(used_++)];
  }
  std::uint64_t next_u64() {
    const std::uint64_t low = next_u32();
    return low | (static_cast<std::uint64_t>(next_u32()) << 32);
  }
  /// Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(next_u64() >> 11) * 0x1.0p-53; }
  /// Uniform in [low, high) (low if they are equal).
  double uniform(const Interval& interval);
  /// Uniform in 0..n-1 without bias; n >= 1.
  std::uint32_t below(std::uint32_t n) {
    // Lemire's multiply-and-reject: values of the low half under (2^32 mod n) would make some results likelier than others. It is below n,
    // so the division is needed only when the low half is too. (<= and not <: 0 comes to its CHECK as well.)
    std::uint64_t product = static_cast<std::uint64_t>(next_u32()) * n;
    if (static_cast<std::uint32_t>(product) <= n) product = below_rarely(n, product);
    return static_cast<std::uint32_t>(product >> 32);
  }
  /// Standard normal (Box-Muller, one value a call).
  double normal();

 private:
  void refill();
  std::uint64_t below_rarely(std::uint32_t n, std::uint64_t product);

  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 64> words_;   // kPhiloxBlocks of them; not initialised: refill() comes first
  int used_ = 0;                          // words given out
  int held_ = 0;                          // words there
};

/// The raw function, for known-answer tests.
std::array<std::uint32_t, 4> philox4x32_10(const std::array<std::uint32_t, 4>& counter,
                                           const std::array<std::uint32_t, 2>& key);

}  // namespace colony
