// The handlers of forks and verifications: what is refused, and what reaches the job service.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;

TEST(Forks, AndVerifications) {
  ApiFixture fixture;
  auto wrong = fixture.post(kJob + "/fork", R"({"at_h": 5, "at_seq": 5, "model": {"layers": "multi", "cycle": {"mean_h": 1}}})");
  EXPECT_EQ(wrong.status, 422);
  const std::vector<std::string> found = faults(wrong);
  for (const char* pointer : {"", "/until", "/model/layers", "/model/cycle/mean_h"}) {
    EXPECT_NE(std::find(found.begin(), found.end(), pointer), found.end()) << pointer;
  }
  EXPECT_TRUE(fixture.jobs.submitted.empty());
  const auto made = fixture.post(kJob + "/fork", R"({"at_seq": 5, "seed": 9, "model": {"cycle": {"mean_h": 14}}, "until": {"cells": 50}})");
  EXPECT_EQ(made.status, 201);
  ASSERT_EQ(fixture.jobs.submitted.size(), 1u);
  const Json spec = Json::parse(fixture.jobs.submitted[0].spec_json), origin = Json::parse(fixture.jobs.submitted[0].origin_json);
  EXPECT_EQ(spec["seed"], 9);
  EXPECT_EQ(spec["model"]["cycle"]["mean_h"], 14.0);
  EXPECT_EQ(origin["job_id"], kJobId);
  EXPECT_EQ(origin["at_seq"], 5);
  EXPECT_EQ(origin["spec"]["seed"], 3);
  EXPECT_EQ(fixture.post(kJob + "/verify", "{}").status, 201);
  EXPECT_EQ(fixture.jobs.submitted[1].kind, "verify");
  fixture.jobs.row.engine_version = "0.0.1/1";  // of another results version
  EXPECT_EQ(fixture.post(kJob + "/verify", "").status, 409);
  EXPECT_EQ(fixture.post(kJob + "/fork", R"({"at_seq": 5, "until": {"cells": 50}})").status, 409);
}

}  // namespace
}  // namespace colony::server::testing
