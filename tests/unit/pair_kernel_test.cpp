// Scoring of candidate pairs and the choice of their points, each against its twin: equal to the last bit on every vector target.
#include "engine/space/pair_kernel.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/any_params.hpp"
#include "tests/support/scale.hpp"
#include "tests/support/search_stage.hpp"
#include "tests/support/targets.hpp"

namespace colony {
namespace {

using kernel::CandidateBody;
using kernel::PairScore;
using kernel::SearchScene;

bool equal(const PairScore& a, const PairScore& b) {
  return a.hits == b.hits && a.shared == b.shared && a.sibling == b.sibling && a.dropped == b.dropped && a.beyond_wall == b.beyond_wall;
}

std::string text_of(const PairScore& s) {
  std::string text = s.dropped ? "dropped" : "whole";
  for (std::size_t k = 0; k < 2; ++k) {
    text += "; hits " + std::to_string(s.hits[k]) + " shared " + std::to_string(s.shared[k]) + " sibling " + std::to_string(s.sibling[k]);
  }
  return text + (s.beyond_wall ? "; beyond the wall" : "");
}

// Any parameters, any pair, and counts that tell every cube from its neighbours, so that a wrong index is seen.
struct Scene {
  explicit Scene(std::uint32_t number) : stream(testing::case_stream(number)), stage(params_of(number, stream)) {
    const PairFrame frame = testing::any_frame(stage.params, stream);
    std::optional<double> wall_um;
    if (number % 2 == 0) wall_um = frame.pivot_um.head<2>().norm() + stream.uniform({-1.0, 1.5}) * search_reach_um(stage.params);
    constexpr std::array<std::uint32_t, 4> kSizes = {64, 256, 256, 1024};
    stage.open(frame, testing::points(kSizes[number % 4], number), wall_um);
    counts.resize(stage.voxels.empty_cube() + 1);
    for (std::size_t i = 0; i + 1 < counts.size(); ++i) {
      const auto hash = static_cast<std::uint32_t>(i * 2654435761U + number) >> 24;
      counts[i] = static_cast<std::uint8_t>(hash < 160 ? 0 : hash < 255 ? hash % 3 : hash);
    }
    counts.back() = 0;
    stage.scene.counts = counts.data();
  }
  const std::array<CandidateBody, 2>& next() { return stage.place(testing::any_chromosome(stage.params, stream)); }

  static Params params_of(std::uint32_t number, Stream& stream) {
    Params params = number % 3 == 0 ? Params{} : testing::any_params(stream);
    params.search.bits = 4 + stream.below(5);
    if (number % 5 == 0) params.layers = Layers::kMulti;
    return params;
  }
  Stream stream;
  testing::SearchStage stage;
  std::vector<std::uint8_t> counts;
};

// The score of body k's first `last` points alone.
PairScore prefix(SearchScene& scene, const std::array<CandidateBody, 2>& pair, std::size_t k, std::uint32_t last) {
  const std::array<std::vector<std::uint32_t>, 2> ends = {scene.own[0].stage_ends, scene.own[1].stage_ends};
  scene.own[k].stage_ends = {last};
  scene.own[1 - k].stage_ends.clear();
  const PairScore score = score_pair_reference(scene, pair);
  for (std::size_t i = 0; i < 2; ++i) scene.own[i].stage_ends = ends[i];
  return score;
}

TEST(ScorePair, EqualsItsTwinToTheLastBitOnEveryTarget) {
  const std::uint32_t scenes = testing::scaled(150U, 3000U);
  std::uint64_t hits = 0, shared = 0, sibling = 0, beyond = 0;
  for (std::uint32_t number = 1; number <= scenes; ++number) {
    Scene scene(number);
    std::vector<std::array<CandidateBody, 2>> pairs;
    std::vector<PairScore> expected;
    for (int i = 0; i < 12; ++i) {
      pairs.push_back(scene.next());
      expected.push_back(score_pair_reference(scene.stage.scene, pairs.back()));
      hits += expected.back().hits[0] + expected.back().hits[1];
      shared += expected.back().shared[0] + expected.back().shared[1];
      sibling += expected.back().sibling[0] + expected.back().sibling[1];
      beyond += expected.back().beyond_wall ? 1 : 0;
    }
    const auto compare = [&](const std::string& name) {
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        kernel::CountWork work;
        const PairScore found = score_pair(scene.stage.scene, pairs[i], {}, work);
        // Beyond the wall the counting ends: only that is said.
        if (expected[i].beyond_wall) {
          ASSERT_TRUE(found.beyond_wall) << name << " scene " << number;
          continue;
        }
        ASSERT_TRUE(equal(found, expected[i])) << name << " scene " << number << " pair " << i << "\nfound    " << text_of(found)
                                               << "\nexpected " << text_of(expected[i]);
        EXPECT_EQ(work.field_count, expected[i].hits[0] + expected[i].hits[1]);
      }
    };
    testing::on_every_target(compare, number == scenes);
    if (HasFatalFailure()) return;
  }
  std::printf("%u scenes: %llu hits, %llu shared, %llu with the sibling, %llu pairs beyond the wall\n", scenes,
              static_cast<unsigned long long>(hits), static_cast<unsigned long long>(shared), static_cast<unsigned long long>(sibling),
              static_cast<unsigned long long>(beyond));
  EXPECT_GT(hits, 500U * scenes);  // the scenes do exercise what they are made for
  EXPECT_GT(shared, hits / 10);
  EXPECT_GT(sibling, hits / 100);
  EXPECT_GT(beyond, scenes / 4);
}

TEST(ScorePair, GivesUpExactlyWhereAPrefixSharesMoreThanTheLimit) {
  int dropped = 0, whole = 0, walls = 0;
  std::array<int, 8> where{};
  const std::uint32_t scenes = testing::scaled(120U, 1500U);
  for (std::uint32_t number = 1; number <= scenes; ++number) {
    Scene scene(number);
    SearchScene& s = scene.stage.scene;
    for (int i = 0; i < 12; ++i) {
      const std::array<CandidateBody, 2> pair = scene.next();
      std::vector<std::uint32_t> limit;
      const double share = scene.stream.uniform({0.0, 2.5});
      const std::uint32_t slack = scene.stream.below(8);
      for (std::size_t h = 0; h <= std::max(s.own[0].size(), s.own[1].size()); ++h) {
        limit.push_back(static_cast<std::uint32_t>(share * static_cast<double>(h)) + slack);
      }
      // By the definition: stage by stage, the bodies in turn, each look at the whole prefix.
      PairScore expected;
      int looks = 0;
      for (std::size_t stage = 0; stage < s.own[0].stage_ends.size() && !expected.dropped && !expected.beyond_wall; ++stage) {
        for (std::size_t k = 0; k < 2 && !expected.dropped && !expected.beyond_wall; ++k) {
          const PairScore so_far = prefix(s, pair, k, s.own[k].stage_ends[stage]);
          expected.beyond_wall = so_far.beyond_wall;
          if (so_far.beyond_wall) break;
          expected.hits[k] = so_far.hits[k];
          expected.shared[k] = so_far.shared[k];
          expected.sibling[k] = so_far.sibling[k];
          expected.dropped = so_far.shared[k] > limit[so_far.hits[k]];
          ++looks;
        }
      }
      const auto compare = [&](const std::string& name) {
        kernel::CountWork work;
        const PairScore found = score_pair(s, pair, limit, work);
        ASSERT_TRUE(equal(found, expected)) << name << " scene " << number << " pair " << i << "\nfound    " << text_of(found)
                                            << "\nexpected " << text_of(expected);
      };
      testing::on_every_target(compare, false);
      if (HasFatalFailure()) return;
      if (expected.dropped) ++where[static_cast<std::size_t>(looks)];
      (expected.beyond_wall ? walls : expected.dropped ? dropped : whole) += 1;
      if (!expected.dropped && !expected.beyond_wall) {
        EXPECT_TRUE(equal(expected, score_pair_reference(s, pair)));
      }
    }
  }
  std::printf("%d given up, %d scored wholly, %d beyond the wall\n", dropped, whole, walls);
  EXPECT_GT(whole, 100);
  EXPECT_GT(walls, 30);
  for (int look = 1; look <= 6; ++look) EXPECT_GT(where[static_cast<std::size_t>(look)], 5) << "look " << look;
}

TEST(OwnPoints, StagesAreRunsOfTheSequenceInAnOrderThatNoTargetChanges) {
  for (std::uint32_t number = 1; number <= testing::scaled(60U, 600U); ++number) {
    Stream stream = testing::case_stream(number);
    const NoiseParams noise = number % 4 == 0 ? testing::smooth() : NoiseParams{0.40, stream.uniform({2.0, 8.0}), stream.uniform({0.0, 6.28})};
    BodyGeometry g;
    g.semiaxes_um = Vec3::Ones();
    for (int i = 0; i < 3; ++i) g.noise_offset[i] = noise_period(noise) * stream.uniform();
    const Body body(g, noise);
    const kernel::FloatBody unit(body, Vec3::Zero());
    // Of a candidate anywhere: only the noise may be read.
    const kernel::FloatBody elsewhere(Body({Vec3(7, -3, 2), Vec3(4, 3, 2), Vec3(0.1, 0.2, 0.9), g.noise_offset}, noise), Vec3(1, 1, 1));
    const auto scale = static_cast<float>(body.noisy_scale());
    const PointSet points = testing::points(1U << (6 + number % 6), number);

    std::vector<std::array<float, 3>> inside;  // in the order of the sequence
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float width = 2.0F * scale;
      const std::array<float, 3> p = {points.x[i] * width - scale, points.y[i] * width - scale, points.z[i] * width - scale};
      if (kernel::is_inside_reference(unit, p[0], p[1], p[2])) inside.push_back(p);
    }
    kernel::OwnPoints first;
    bool is_first = true;
    kernel::OwnPoints own;  // kept from call to call, as a search keeps it
    testing::on_every_target([&](const std::string&) {
      kernel::select_own_points(elsewhere, scale, testing::points(4096, number), own);
      kernel::select_own_points(elsewhere, scale, points, own);
      ASSERT_EQ(own.size(), inside.size()) << "case " << number;
      std::size_t begin = 0;
      for (std::size_t stage = 0; stage < own.stage_ends.size(); ++stage) {
        const std::size_t end = own.stage_ends[stage];
        if (stage < kernel::kStageSizes.size()) {
          ASSERT_EQ(end, std::min<std::size_t>(inside.size(), begin + kernel::kStageSizes[stage]));
        }
        std::vector<std::array<float, 3>> chosen, expected(inside.begin() + static_cast<std::ptrdiff_t>(begin),
                                                           inside.begin() + static_cast<std::ptrdiff_t>(end));
        for (std::size_t i = begin; i < end; ++i) chosen.push_back({own.u[i], own.v[i], own.w[i]});
        std::sort(chosen.begin(), chosen.end());
        std::sort(expected.begin(), expected.end());
        ASSERT_EQ(chosen, expected) << "case " << number << " stage " << stage;
        begin = end;
      }
      if (is_first) first = own;
      is_first = false;
      for (std::size_t i = 0; i < own.size(); ++i) {
        ASSERT_TRUE(own.u[i] == first.u[i] && own.v[i] == first.v[i] && own.w[i] == first.w[i]) << "case " << number << " point " << i;
      }
    }, false);
    if (HasFatalFailure()) return;
  }
}

TEST(OwnPoints, NoneOfThePaddingIsTakenForAPoint) {
  // Every point inside: nothing beyond the set may be taken for one.
  const Body ball({Vec3::Zero(), Vec3::Ones(), Vec3::Zero(), Vec3::Zero()}, testing::smooth());
  PointSet points;
  points.count = 64;
  for (std::vector<float>* column : {&points.x, &points.y, &points.z}) column->assign(64 + kernel::kPadding, 0.5F);
  kernel::OwnPoints own;
  kernel::select_own_points(kernel::FloatBody(ball, Vec3::Zero()), 1.0F, points, own);
  EXPECT_EQ(own.size(), 64U);
  for (std::vector<float>* column : {&points.x, &points.y, &points.z}) column->assign(64 + kernel::kPadding, 0.999F);
  kernel::select_own_points(kernel::FloatBody(ball, Vec3::Zero()), 1.0F, points, own);
  EXPECT_EQ(own.size(), 0U);
  EXPECT_EQ(own.stage_ends, (std::vector<std::uint32_t>{0, 0, 0}));
}

}  // namespace
}  // namespace colony
