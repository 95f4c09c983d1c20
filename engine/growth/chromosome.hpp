// chromosome: a pair of new cells as a bit string, so that every string is a valid pair.
// Method:  17 genes of 4..16 bits (19 with several layers), Gray or plain binary, each mapped linearly on its range.
// Shapes:  gene order as in Gene; bit 0 of the string is the most significant bit of the first gene.
// Units:   um, rad.     Threads: pure.
// Source:  the paper, section 4.3; genes instead of raw r, A, B, C, W are ours: no repair, no penalty (engine/DESIGN.md).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/model/params.hpp"
#include "engine/random/stream.hpp"
#include "engine/shape/body.hpp"

namespace colony {

/// The first three are the pair's; then seven for each of the two, larger share first.
enum Gene { kTurn, kPairVolume, kSmallerShare, kFirstOfBody };
enum BodyGene { kElongation, kFlatness, kRotation, kTiltX, kTiltY, kDistance, kSideways, kBodyGeneCount };
/// With several layers two more: how high each of the two stands.
inline constexpr int kFirstHeight = kFirstOfBody + 2 * kBodyGeneCount;
inline constexpr int kGeneCountMono = kFirstHeight;
inline constexpr int kGeneCountMulti = kFirstHeight + 2;

/// How many low bits of a gene the corrector may flip.
inline constexpr int kCorrectorLowBits = 3;

inline int gene_count_of(Layers layers) { return layers == Layers::kMulti ? kGeneCountMulti : kGeneCountMono; }

class Chromosome {
 public:
  Chromosome() = default;
  Chromosome(int gene_count, int bits) : gene_count_(gene_count), bits_(bits) {}

  int gene_count() const { return gene_count_; }
  int bits() const { return bits_; }
  int length() const { return gene_count_ * bits_; }
  std::uint32_t code(int gene) const { return codes_[static_cast<std::size_t>(gene)]; }
  void set_code(int gene, std::uint32_t code) { codes_[static_cast<std::size_t>(gene)] = static_cast<std::uint16_t>(code); }
  void flip(int bit);
  /// The gene's value in [0, 1]: code / (2^bits - 1), after Gray decoding if asked.
  double value(int gene, Coding coding) const;
  friend bool operator==(const Chromosome&, const Chromosome&) = default;
  friend auto operator<=>(const Chromosome&, const Chromosome&) = default;
  friend Chromosome crossover(const Chromosome& a, const Chromosome& b, int cut);

 private:
  int gene_count_ = kGeneCountMono;
  int bits_ = 8;
  std::array<std::uint16_t, kGeneCountMulti> codes_{};   // zero beyond gene_count_
};

std::uint32_t gray_from_binary(std::uint32_t binary);
std::uint32_t binary_from_gray(std::uint32_t gray);

Chromosome random_chromosome(int gene_count, int bits, Stream& stream);
/// Flips independent random bits of a string, each with one probability, at the cost of the flips alone: the gap to the next flip is drawn
/// from its geometric distribution, tabled in 32-bit fixed point.
class BitFlips {
 public:
  BitFlips() = default;
  /// Strings of `length` bits, probability `rate` in [0, 1].
  BitFlips(int length, double rate);
  /// Calls flip(bit) for each flipped bit, ascending.
  template <class Flip>
  void draw(Stream& stream, const Flip& flip) const {
    if (never_) return;
    for (int bit = gap(stream); bit < length_; bit += 1 + gap(stream)) flip(bit);
  }

 private:
  int gap(Stream& stream) const;

  int length_ = 0;
  bool never_ = true;
  std::vector<std::uint32_t> survival_;   // [k]: 2^32 P(gap > k), rounded down; falling; then a 0
  std::array<std::uint32_t, 256> guide_{};  // by the highest byte of a draw: a k from which to go on
};

/// The code of the value nearest to `value` in [0, 1].
std::uint32_t code_of(double value, int bits, Coding coding);
/// One-point crossover: bits [0, cut) of a, the rest of b.
Chromosome crossover(const Chromosome& a, const Chromosome& b, int cut);

/// What a search is about: where the pair stands and what was drawn for it before the search.
struct PairFrame {
  Vec3 pivot_um = Vec3::Zero();                         // the nucleus centre c
  Vec3 direction = Vec3::UnitX();                       // n, unit vector before the turn; horizontal in a monolayer
  std::array<Vec3, 2> noise_offsets = {Vec3::Zero(), Vec3::Zero()};
};

/// bodies[0]: the larger share, on the side -direction; bodies[1]: the smaller.
struct Pair {
  std::array<BodyGeometry, 2> bodies;
  Vec3 direction = Vec3::UnitX();                       // after the turn
};

Pair decode(const Chromosome& chromosome, const PairFrame& frame, const Params& params);

/// Semiaxes (A, B, C) of an ellipsoid of that volume with A/B = elongation, C/sqrt(AB) = flatness.
Vec3 semiaxes_um(double volume_um3, double elongation, double flatness);
/// Rotation vector of: tilt about y, then about x, then turn about z.
Vec3 orientation_rad(double rotation_rad, double tilt_x_rad, double tilt_y_rad);
/// Height of a cell's centre above the dish: it is spread on the substrate.
inline double spread_height_um(const Vec3& semiaxes) { return 0.55 * semiaxes.z(); }
/// The same with layers: a height gene in [0, 1] lifts it by up to 2 C.
inline double height_above_dish(double semiaxis_c_um, Layers layers, double gene) {
  return layers == Layers::kMono ? 0.55 * semiaxis_c_um : (0.55 + 2.0 * gene) * semiaxis_c_um;
}
/// Horizontal unit vector across n; n itself may lean where there are layers.
Vec3 across(const Vec3& n);

}  // namespace colony
