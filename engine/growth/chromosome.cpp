#include "engine/growth/chromosome.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr double kRadiansPerDegree = maths::kPi / 180.0;

double on(const Interval& range, double value) { return range.low + (range.high - range.low) * value; }
double symmetric(double half_range, double value) { return half_range * (2.0 * value - 1.0); }

Mat3 about(int axis, double angle_rad) {
  const auto [s, c] = maths::sincos(angle_rad);
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  Mat3 m = Mat3::Identity();
  m(i, i) = c;
  m(j, j) = c;
  m(i, j) = -s;
  m(j, i) = s;
  return m;
}

}  // namespace

std::uint32_t gray_from_binary(std::uint32_t binary) { return binary ^ (binary >> 1); }

std::uint32_t binary_from_gray(std::uint32_t gray) {
  for (std::uint32_t shift = 16; shift > 0; shift >>= 1) gray ^= gray >> shift;
  return gray;
}

void Chromosome::flip(int bit) {
  DCHECK(bit >= 0 && bit < length());
  const int within = bits_ - 1 - bit % bits_;
  std::uint16_t& gene = codes_[static_cast<std::size_t>(bit / bits_)];
  gene = static_cast<std::uint16_t>(gene ^ (1U << within));
}

double Chromosome::value(int gene, Coding coding) const {
  const std::uint32_t raw = code(gene);
  const std::uint32_t number = coding == Coding::kGray ? binary_from_gray(raw) : raw;
  return static_cast<double>(number) / static_cast<double>((1U << bits_) - 1U);
}

Chromosome random_chromosome(int gene_count, int bits, Stream& stream) {
  Chromosome chromosome(gene_count, bits);
  for (int gene = 0; gene < gene_count; ++gene) chromosome.set_code(gene, stream.next_u32() >> (32 - bits));
  return chromosome;
}

BitFlips::BitFlips(int length, double rate) : length_(length), never_(rate == 0.0) {
  CHECK(length >= 1 && rate >= 0.0 && rate <= 1.0);
  double survival = 1.0;
  for (int k = 0; k < length; ++k) {
    survival *= 1.0 - rate;
    survival_.push_back(static_cast<std::uint32_t>(survival * 4294967295.0));
  }
  survival_.push_back(0);
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    const std::uint32_t largest = (byte << 24) | 0xffffffU;
    while (largest < survival_[guide_[byte]]) ++guide_[byte];
  }
}

int BitFlips::gap(Stream& stream) const {
  // The number of k with u < survival_[k].
  const std::uint32_t u = stream.next_u32();
  std::uint32_t k = guide_[u >> 24];
  while (u < survival_[k]) ++k;
  return static_cast<int>(k);
}

std::uint32_t code_of(double value, int bits, Coding coding) {
  CHECK(value >= 0.0 && value <= 1.0);
  const auto number = static_cast<std::uint32_t>(value * ((1U << bits) - 1U) + 0.5);
  return coding == Coding::kGray ? gray_from_binary(number) : number;
}

Chromosome crossover(const Chromosome& a, const Chromosome& b, int cut) {
  CHECK(a.bits() == b.bits() && cut >= 0 && cut <= a.length());
  Chromosome child = b;
  const auto whole = static_cast<std::size_t>(cut / a.bits());
  std::copy(a.codes_.begin(), a.codes_.begin() + static_cast<std::ptrdiff_t>(whole), child.codes_.begin());
  const int head = cut % a.bits();
  if (head > 0) {
    const std::uint32_t low = (1U << (a.bits() - head)) - 1U;
    child.codes_[whole] = static_cast<std::uint16_t>((a.codes_[whole] & ~low) | (b.codes_[whole] & low));
  }
  return child;
}

Vec3 across(const Vec3& n) {
  const double length = std::sqrt(n.x() * n.x() + n.y() * n.y());
  if (!(length > 1e-9)) return Vec3::UnitX();  // straight up: any will do
  return {-n.y() / length, n.x() / length, 0.0};
}

Vec3 semiaxes_um(double volume_um3, double elongation, double flatness) {
  const double mean = maths::cbrt(3.0 * volume_um3 / (4.0 * maths::kPi * flatness));  // sqrt(AB)
  const double root = std::sqrt(elongation);
  return {mean * root, mean / root, mean * flatness};
}

Vec3 orientation_rad(double rotation_rad, double tilt_x_rad, double tilt_y_rad) {
  const Mat3 tilted = about(0, tilt_x_rad) * about(1, tilt_y_rad);
  return rotation_vector(about(2, rotation_rad) * tilted);
}

Pair decode(const Chromosome& chromosome, const PairFrame& frame, const Params& params) {
  const Coding coding = params.search.coding;
  const auto gene = [&](int index) { return chromosome.value(index, coding); };

  Pair pair;
  const double turn = symmetric(params.search.turn_max_deg * kRadiansPerDegree, gene(kTurn));
  const auto [s, c] = maths::sincos(turn);
  const Vec3& n = frame.direction;
  pair.direction = Vec3(c * n.x() - s * n.y(), s * n.x() + c * n.y(), n.z());
  const Vec3 sideways = across(pair.direction);
  const double volume = on(params.cell.pair_volume_um3, gene(kPairVolume));
  const double smaller = on(params.cell.smaller_share, gene(kSmallerShare));

  for (int k = 0; k < 2; ++k) {
    const int first = kFirstOfBody + k * kBodyGeneCount;
    const double side = k == 0 ? -1.0 : 1.0;
    const double share = k == 0 ? 1.0 - smaller : smaller;
    const double tilt_max = params.search.tilt_max_deg * kRadiansPerDegree;
    BodyGeometry& body = pair.bodies[static_cast<std::size_t>(k)];
    body.semiaxes_um = semiaxes_um(volume * share, on(params.cell.elongation, gene(first + kElongation)),
                                   on(params.cell.flatness, gene(first + kFlatness)));
    body.rotation_rad = orientation_rad(maths::kPi * gene(first + kRotation), symmetric(tilt_max, gene(first + kTiltX)),
                                        symmetric(tilt_max, gene(first + kTiltY)));
    body.noise_offset = frame.noise_offsets[static_cast<std::size_t>(k)];
    const double half_width = Body(body, params.noise).half_width_um(pair.direction);
    const double mean = std::sqrt(body.semiaxes_um.x() * body.semiaxes_um.y());
    const Vec3 offset = side * on(params.search.distance, gene(first + kDistance)) * half_width * pair.direction +
                        symmetric(params.search.sideways * mean, gene(first + kSideways)) * sideways;
    const double height = params.layers == Layers::kMono ? 0.0 : gene(kFirstHeight + k);
    body.centre_um = Vec3(frame.pivot_um.x() + offset.x(), frame.pivot_um.y() + offset.y(),
                          height_above_dish(body.semiaxes_um.z(), params.layers, height));
  }
  return pair;
}

}  // namespace colony
