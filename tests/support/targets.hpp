// targets: runs a check on every vector target that this CPU has. Only for programs that link hwy.
#pragma once

#include <cstdint>
#include <cstdio>
#include <hwy/targets.h>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "engine/space/overlap_kernel.hpp"

namespace colony::testing {

/// Calls check(name) with the kernels dispatched to each target in turn, and expects that there are two at least: else nothing was compared.
/// `print`: names them.
template <class Check>
void on_every_target(const Check& check, bool print = true) {
  std::set<std::string> names;  // several bits may fall back to one target
  for (std::int64_t bit = 1; bit > 0 && bit <= hwy::SupportedTargets(); bit <<= 1) {
    if ((hwy::SupportedTargets() & bit) == 0) continue;
    hwy::SetSupportedTargetsForTest(bit);
    hwy::GetChosenTarget().DeInit();
    const std::string name = kernel::vector_target();
    if (names.insert(name).second) {
      SCOPED_TRACE(name);
      check(name);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
    if (::testing::Test::HasFatalFailure()) return;
  }
  std::string all;
  for (const std::string& name : names) all += " " + name;
  if (print) std::printf("compared on%s\n", all.c_str());
  EXPECT_GE(names.size(), 2U);
}

}  // namespace colony::testing
