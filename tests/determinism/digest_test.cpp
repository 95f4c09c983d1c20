// One committed digest for each scene: the same spec and seed give the same bytes on any machine, any vector width, any
// window. UPDATE_DIGESTS=1 rewrites digests.txt; a change of it is a change of results and belongs in the CHANGELOG.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/runs.hpp"
#include "tests/support/targets.hpp"

namespace colony {
namespace {

constexpr const char* kDigestFile = COLONY_DIGEST_FILE;

std::map<std::string, RunSpec> scenes() {
  std::map<std::string, RunSpec> all;
  all["paper-seed-1-to-180-cells"] = testing::spec_of(1, 180);
  all["paper-seed-2-to-60-cells"] = testing::spec_of(2, 60);
  all["paper-largest-seed-to-20-cells"] = testing::spec_of(kSeedMax, 20);

  RunSpec spec = testing::spec_of(3, 100'000, *preset("clonogenic"));
  spec.params.founders.count = 12;
  spec.until = {std::nullopt, 30.0};
  all["clonogenic-12-founders-30-h"] = spec;

  spec = testing::spec_of(4, 20);
  spec.params.contact.rule = ContactRule::kMax;
  spec.params.contact.neighbour_retained_min = 0.3;
  spec.params.wake.rule = WakeRule::kAlways;
  spec.params.cycle.distribution = CycleDistribution::kUniform;
  spec.params.cycle.sibling_correlation = 0.6;
  all["max-retained-always-uniform-correlated-to-20-cells"] = spec;

  spec = testing::spec_of(5, 50);
  spec.params.search.optimiser = Optimiser::kSobol;
  spec.params.search.coding = Coding::kBinary;
  spec.params.search.bits = 12;
  spec.params.dish.radius_um = 40.0;
  all["sobol-binary-dish-to-50-cells"] = spec;

  spec = testing::spec_of(6, 60);
  spec.params.search.selection = Selection::kRoulette;
  spec.params.search.mutation_rate = 0.02;
  spec.params.division.inhibition = false;
  spec.params.division.generation_limit = 5;
  spec.params.noise = {0.45, 3.0, 0.5};
  all["roulette-no-inhibition-five-generations"] = spec;

  all["young-colony-seed-1-to-110-cells"] = testing::spec_of(1, 110, *preset("young-colony"));

  spec = testing::spec_of(7, 100'000, *preset("young-colony"));
  spec.params.motility = {0.5, 4.0, 0.8};
  spec.params.founders.count = 8;
  spec.params.founders.radius_um = 40.0;
  spec.params.dish.radius_um = 60.0;
  spec.until = {std::nullopt, 60.0};
  all["many-moves-8-founders-dish-60-h"] = spec;

  all["tumour-seed-1-to-150-cells"] = testing::spec_of(1, 150, *preset("tumour"));

  spec = testing::spec_of(8, 100'000, *preset("tumour"));
  spec.params.founders.count = 6;
  spec.params.founders.radius_um = 40.0;
  spec.params.dish.radius_um = 55.0;
  spec.params.contact.neighbour_retained_min = 0.2;
  spec.params.wake.rule = WakeRule::kAlways;
  spec.until = {std::nullopt, 36.0};
  all["tumour-6-founders-dish-retained-always-36-h"] = spec;
  return all;
}

std::string digest_of(const RunSpec& spec) {
  const testing::Run run = testing::run(spec);
  return run.colony().digest().hex() + " " + std::to_string(run.events.size());
}

TEST(Digests, AreTheCommittedOnes) {
  std::map<std::string, std::string> found;
  for (const auto& [name, spec] : scenes()) found[name] = digest_of(spec);
  const char* update = std::getenv("UPDATE_DIGESTS");
  if (update != nullptr && std::string(update) == "1") {
    std::ofstream file(kDigestFile);
    file << "# scene, digest after the last event, number of events. Rewritten by UPDATE_DIGESTS=1.\n";
    for (const auto& [name, value] : found) file << name << " " << value << "\n";
    ASSERT_TRUE(file.good()) << kDigestFile;
    GTEST_SKIP() << "digests rewritten";
  }
  std::ifstream file(kDigestFile);
  ASSERT_TRUE(file.good()) << kDigestFile;
  std::map<std::string, std::string> committed;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t space = line.find(' ');
    committed[line.substr(0, space)] = line.substr(space + 1);
  }
  EXPECT_EQ(found, committed)
      << "results changed: if that is meant, UPDATE_DIGESTS=1 and a CHANGELOG line under Results";
}

TEST(Digests, DoNotDependOnTheWindow) {
  for (const Seed seed : {1, 8}) {
    std::string expected;
    for (const double window_h : {1.0, 0.1, 0.25, 2.0}) {
      RunSpec spec = testing::spec_of(seed, 50);
      spec.params.window_h = window_h;
      ASSERT_TRUE(validate(spec.params).empty());
      const std::string found = digest_of(spec);
      if (expected.empty()) expected = found;
      EXPECT_EQ(found, expected) << testing::name_of_run(spec) << " window " << window_h;
    }
  }
}

TEST(Digests, DoNotDependOnTheWindowWithMovesEither) {
  for (const double rate_per_h : {0.1, 0.5}) {
    std::string expected;
    for (const double window_h : {1.0, 0.01, 0.1, 0.25, 0.7}) {
      RunSpec spec = testing::spec_of(8, 60, *preset("young-colony"));
      spec.params.motility.rate_per_h = rate_per_h;
      spec.params.window_h = window_h;
      ASSERT_TRUE(validate(spec.params).empty());
      const std::string found = digest_of(spec);
      if (expected.empty()) expected = found;
      EXPECT_EQ(found, expected) << testing::name_of_run(spec) << " window " << window_h << " rate " << rate_per_h;
    }
  }
}

TEST(Digests, DoNotDependOnTheWindowWithLayersEither) {
  std::string expected;
  for (const double window_h : {1.0, 0.01, 0.25, 2.0}) {
    RunSpec spec = testing::spec_of(8, 80, *preset("tumour"));
    spec.params.window_h = window_h;
    ASSERT_TRUE(validate(spec.params).empty());
    const std::string found = digest_of(spec);
    if (expected.empty()) expected = found;
    EXPECT_EQ(found, expected) << testing::name_of_run(spec) << " window " << window_h;
  }
}

// A scene for each kind of kernel: searches, layers, moves, the other contact rule, walls with several founders, neighbours that are asked.
std::map<std::string, RunSpec> scenes_of_every_kernel() {
  std::map<std::string, RunSpec> all;
  all["paper"] = testing::spec_of(9, 30);
  all["tumour"] = testing::spec_of(9, 60, *preset("tumour"));
  all["young-colony"] = testing::spec_of(9, 40, *preset("young-colony"));

  RunSpec spec = testing::spec_of(9, 30);
  spec.params.contact.rule = ContactRule::kMax;
  all["max"] = spec;

  spec = testing::spec_of(9, 40);
  spec.params.founders.count = 6;
  spec.params.founders.radius_um = 30.0;
  spec.params.dish.radius_um = 45.0;
  all["dish of 6 founders"] = spec;

  spec = testing::spec_of(9, 8);
  spec.params.contact.neighbour_retained_min = 0.3;
  all["retained"] = spec;
  return all;
}

TEST(Digests, DoNotDependOnTheVectorWidth) {
  const std::map<std::string, RunSpec> scenes = scenes_of_every_kernel();
  std::map<std::string, std::string> expected;
  for (const auto& [name, spec] : scenes) {
    ASSERT_TRUE(validate(spec.params).empty()) << name;
    expected[name] = digest_of(spec);
  }
  testing::on_every_target([&](const std::string& target) {
    for (const auto& [name, spec] : scenes) EXPECT_EQ(digest_of(spec), expected[name]) << target << ", " << name;
  });
}

TEST(Digests, DifferBySeed) {
  std::map<std::string, Seed> seen;
  for (Seed seed = 0; seed < 20; ++seed)
    EXPECT_TRUE(seen.emplace(digest_of(testing::spec_of(seed, 2)), seed).second) << seed;
}

}  // namespace
}  // namespace colony
