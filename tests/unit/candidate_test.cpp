// Candidates by tables against their definition, the bounds of what a search can reach, and the drawing of mutations.
#include "engine/growth/candidate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "engine/space/voxels.hpp"
#include "tests/support/any_params.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/search_stage.hpp"
#include "tests/support/stats.hpp"

namespace colony {
namespace {

// The largest distance, um, between what the tables and the definition make of the same string: centres and ends of the semiaxes; and the
// largest difference of (u, v, w) on the body's surface.
struct Difference {
  double um = 0.0, unit = 0.0;
};

Difference difference(const Pair& exact, const std::array<kernel::CandidateBody, 2>& fast, const Params& params, const Vec3& pivot_um) {
  Difference worst;
  for (std::size_t k = 0; k < 2; ++k) {
    const BodyGeometry& g = exact.bodies[k];
    const Mat3 axes = rotation_matrix(g.rotation_rad) * g.semiaxes_um.asDiagonal();
    const Body body(g, params.noise);
    for (int row = 0; row < 3; ++row) {
      worst.um = std::max(worst.um, std::abs(fast[k].centre[row] - (g.centre_um - pivot_um)[row]));
      for (int i = 0; i < 3; ++i) worst.um = std::max(worst.um, std::abs(fast[k].axes[3 * row + i] - axes(row, i)));
    }
    for (int i = 0; i < 3; ++i) {
      for (int end = 0; end < 3; ++end) {
        const Vec3 p = g.centre_um - pivot_um + axes.col(end);
        const float* m = fast[k].field.m + 3 * i;
        const double unit = m[0] * p.x() + m[1] * p.y() + m[2] * p.z() + fast[k].field.t[i];
        worst.unit = std::max(worst.unit, std::abs(unit - (i == end ? 1.0 : 0.0)));
      }
    }
  }
  return worst;
}

TEST(GeneTables, DecodeWhatTheDefinitionDecodes) {
  Difference worst;
  for (const Layers layers : {Layers::kMono, Layers::kMulti}) {
    for (const Coding coding : {Coding::kGray, Coding::kBinary}) {
      for (int bits = 4; bits <= 16; ++bits) {
        Stream stream = testing::case_stream(static_cast<std::uint32_t>(bits));
        Params params = bits % 3 == 0 ? testing::any_params(stream) : Params{};
        params.layers = layers;
        params.search.coding = coding;
        params.search.bits = bits;
        const GeneTables genes(params);
        for (int i = 0; i < testing::scaled(100, 2000); ++i) {
          const PairFrame frame = testing::any_frame(params, stream);
          const Chromosome chromosome = i % 2 == 0 ? testing::any_chromosome(params, stream) : random_chromosome(gene_count_of(layers), bits, stream);
          std::array<kernel::CandidateBody, 2> fast{};
          genes.decode(chromosome, frame, fast);
          const Pair exact = decode(chromosome, frame, params);
          const Difference found = difference(exact, fast, params, frame.pivot_um);
          ASSERT_LT(found.um, 1e-4) << "bits " << bits << " layers " << static_cast<int>(layers) << " string " << i;
          ASSERT_LT(found.unit, 3e-5) << "bits " << bits << " layers " << static_cast<int>(layers) << " string " << i;
          worst = {std::max(worst.um, found.um), std::max(worst.unit, found.unit)};
          for (std::size_t k = 0; k < 2; ++k) {
            // The body lies within a circle of that radius: so do its tangents across any direction.
            const Body body(exact.bodies[k], params.noise);
            for (int step = 0; step < 16; ++step) {
              const auto [sine, cosine] = maths::sincos(maths::kPi * step / 8.0);
              const Vec3 unit(cosine, sine, 0.0);
              const double extent = (body.centre_um() - frame.pivot_um).dot(unit) + body.noisy_scale() * body.half_width_um(unit);
              ASSERT_LE(extent, 1.00001 * fast[k].reach + 1e-4);
            }
          }
        }
      }
    }
  }
  std::printf("figure: candidates by tables: off by at most %.1e um, %.1e in the unit frame\n", worst.um, worst.unit);
}

// Climbs gene by gene to the string with the largest value: three codes a gene, until nothing gains.
Chromosome climb(Chromosome chromosome, const Params& params, const std::function<double(const Chromosome&)>& value) {
  double best = value(chromosome);
  for (bool gained = true; gained;) {
    gained = false;
    for (int gene = 0; gene < chromosome.gene_count(); ++gene) {
      for (const double x : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        Chromosome other = chromosome;
        other.set_code(gene, code_of(x, other.bits(), params.search.coding));
        const double found = value(other);
        if (!(found > best)) continue;
        best = found;
        chromosome = other;
        gained = true;
      }
    }
  }
  return chromosome;
}

// CHECKs that every point the kernel can look up for this pair lies in a cube of the box; the share of the bounds that was reached.
struct Reached {
  double across = 0.0, up = 0.0, index = 0.0;
};
void expect_inside(const testing::SearchStage& stage, Reached& reached) {
  const kernel::SearchScene& scene = stage.scene;
  const auto n = static_cast<float>(stage.voxels.nx());
  const double noisy = std::sqrt(1.0 + noise_bound(stage.params.noise));
  for (const kernel::CandidateBody& body : stage.pair) {
    float extreme_cube[3][2];
    for (int axis = 0; axis < 3; ++axis) {
      const float* a = body.axes + 3 * axis;
      // The furthest point of the ellipsoid that holds the noisy body, along this axis.
      const double half = noisy * std::sqrt(static_cast<double>(a[0]) * a[0] + static_cast<double>(a[1]) * a[1] + static_cast<double>(a[2]) * a[2]);
      for (int end = 0; end < 2; ++end) {
        float p = static_cast<float>(body.centre[axis] + (end == 0 ? -half : half));
        if (axis == 2) p = std::max(p, scene.dish_z);  // below the dish nothing is looked up
        extreme_cube[axis][end] = ((p * scene.voxels_per_um + scene.voxel_shift[axis]) + 12582912.0F) - 12582912.0F;
      }
      ASSERT_GE(extreme_cube[axis][0], 0.0F) << "axis " << axis;
      ASSERT_LT(extreme_cube[axis][1], axis == 2 ? static_cast<float>(stage.voxels.nz()) : n) << "axis " << axis;
      if (axis < 2) reached.across = std::max(reached.across, (half + std::abs(body.centre[axis])) / search_reach_um(stage.params));
    }
    reached.up = std::max(reached.up, (extreme_cube[2][1] + 1.0) / stage.voxels.nz());
    const double index = (static_cast<double>(extreme_cube[2][1]) * n + extreme_cube[1][1]) * n + extreme_cube[0][1];
    ASSERT_LT(index, static_cast<double>(stage.voxels.empty_cube()));
    reached.index = std::max(reached.index, index);
  }
  ASSERT_LT(static_cast<double>(stage.voxels.empty_cube()), 16'777'216.0);  // indices are whole numbers of single precision
}

TEST(SearchBounds, NoChromosomeAsksForACubeOutsideTheBox) {
  Reached reached;
  double top_share = 0.0, reach_share = 0.0;
  const std::uint32_t sets = testing::scaled(60U, 1500U);
  for (std::uint32_t number = 1; number <= sets; ++number) {
    Stream stream = testing::case_stream(number);
    Params params = number % 6 == 0 ? Params{} : testing::any_params(stream);
    params.search.bits = 4 + stream.below(5);
    if (number % 4 == 0) params.search.tilt_max_deg = 20.0;
    if (number % 3 == 0) params.layers = Layers::kMulti;
    testing::SearchStage stage(params);
    const double reach_um = search_reach_um(params);
    const double top_um = body_top_max_um(params);
    const auto extent = [&](const Chromosome& chromosome, int axis, double sign) {
      const Pair pair = decode(chromosome, stage.frame, params);
      double most = -1e9;
      for (const BodyGeometry& g : pair.bodies) {
        const Box box = Body(g, params.noise).box();
        const double pivot = axis == 2 ? 0.0 : stage.frame.pivot_um[axis];
        most = std::max(most, sign > 0.0 ? box.high[axis] - pivot : pivot - box.low[axis]);
      }
      return most;
    };
    for (int frames = 0; frames < 2; ++frames) {
      stage.open(testing::any_frame(params, stream, frames == 0 ? 100.0 : 5e4), testing::points(64, number), std::nullopt);
      for (int i = 0; i < 40; ++i) {
        Chromosome chromosome = testing::any_chromosome(params, stream);
        if (i < 4) {  // directed attempts to break the bounds: high, and out along either sign of an axis
          const int axis = i == 0 ? 2 : static_cast<int>(stream.below(2));
          chromosome = climb(chromosome, params, [&](const Chromosome& c) { return extent(c, axis, i % 2 == 0 ? 1.0 : -1.0); });
        }
        for (const int axis : {0, 1}) {
          for (const double sign : {-1.0, 1.0}) {
            ASSERT_LE(extent(chromosome, axis, sign), reach_um) << "parameters " << number;
            reach_share = std::max(reach_share, extent(chromosome, axis, sign) / reach_um);
          }
        }
        ASSERT_LE(extent(chromosome, 2, 1.0), top_um) << "parameters " << number;
        top_share = std::max(top_share, extent(chromosome, 2, 1.0) / top_um);
        stage.place(chromosome);
        expect_inside(stage, reached);
        if (HasFatalFailure()) FAIL() << "parameters " << number << " string " << i;
      }
    }
  }
  std::printf("figure: bounds of a search: %.3f of the reach and %.3f of the top are used; highest cube index %.0f of 2^24\n", reach_share, top_share, reached.index);
  EXPECT_GT(top_share, 0.95);  // bounds, not guesses: somebody comes near
  EXPECT_GT(reach_share, 0.8);
}

TEST(BitFlips, AreIndependentBitsOfOneProbability) {
  const int draws = testing::scaled(40'000, 1'000'000);
  for (const auto& [length, rate] : {std::pair<int, double>{136, 1.0 / 136}, {51, 1.0 / 51}, {304, 0.5}, {68, 0.02}, {7, 0.3}, {1, 0.25}}) {
    const BitFlips flips(length, rate);
    Stream stream = testing::case_stream(static_cast<std::uint32_t>(length));
    std::vector<double> by_bit(static_cast<std::size_t>(length), 0.0);
    double sum = 0.0, squares = 0.0, neighbours = 0.0;
    for (int i = 0; i < draws; ++i) {
      int count = 0, last = -1;
      flips.draw(stream, [&](int bit) {
        ASSERT_TRUE(bit > last && bit < length);
        if (bit == last + 1 && last >= 0) neighbours += 1.0;
        by_bit[static_cast<std::size_t>(bit)] += 1.0;
        last = bit;
        ++count;
      });
      sum += count;
      squares += static_cast<double>(count) * count;
    }
    // Binomial: mean L p, variance L p (1 - p); its fourth central moment gives the standard error of the variance.
    const double mean = length * rate, variance = length * rate * (1.0 - rate);
    const double fourth = variance * (1.0 + (3.0 * length - 6.0) * rate * (1.0 - rate));
    const double found_mean = sum / draws, found_variance = squares / draws - found_mean * found_mean;
    EXPECT_NEAR(found_mean, mean, 5.0 * std::sqrt(variance / draws)) << length << " " << rate;
    EXPECT_NEAR(found_variance, variance, 5.0 * std::sqrt((fourth - variance * variance) / draws)) << length << " " << rate;
    if (length > 1) {
      // The same everywhere in the string; for bits that are not certain the counts vary less than Poisson's: the bound holds.
      EXPECT_LT(testing::chi_square_uniform(by_bit), testing::chi_square_bound(by_bit.size() - 1)) << length << " " << rate;
      // Gap 0: the next bit is flipped as often as any.
      const double pairs = (length - 1) * rate * rate * draws;
      EXPECT_NEAR(neighbours, pairs, 5.0 * std::sqrt(pairs * (1.0 + 2.0 * rate))) << length << " " << rate;
    }
  }
}

TEST(BitFlips, GapsFollowTheGeometricLaw) {
  const double rate = 0.05;
  const int draws = testing::scaled(100'000, 2'000'000);
  const BitFlips flips(200'000, rate);  // long: hardly a gap is cut off at the end (with 2,000 bits, 2 million draws show those that are)
  Stream stream = testing::case_stream(3);
  std::vector<double> counts(60, 0.0);
  double total = 0.0;
  while (total < draws) {
    int last = -1;
    flips.draw(stream, [&](int bit) {
      const std::size_t gap = std::min<std::size_t>(static_cast<std::size_t>(bit - last - 1), counts.size() - 1);
      last = bit;
      counts[gap] += 1.0;
      total += 1.0;
    });
  }
  double chi_square = 0.0, beyond = 1.0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double p = k + 1 < counts.size() ? rate * std::pow(1.0 - rate, k) : beyond;
    beyond -= rate * std::pow(1.0 - rate, k);
    chi_square += (counts[k] - p * total) * (counts[k] - p * total) / (p * total);
  }
  EXPECT_LT(chi_square, testing::chi_square_bound(counts.size() - 1));
}

TEST(BitFlips, RateZeroFlipsNothingAndRateOneAll) {
  for (const int length : {1, 2, 136, 304}) {
    Stream stream = testing::case_stream(1);
    int flipped = 0;
    for (int i = 0; i < 1000; ++i) BitFlips(length, 0.0).draw(stream, [&](int) { ++flipped; });
    EXPECT_EQ(flipped, 0);
    BitFlips(length, 1.0).draw(stream, [&](int bit) { EXPECT_EQ(bit, flipped++); });
    EXPECT_EQ(flipped, length);
  }
}

}  // namespace
}  // namespace colony
