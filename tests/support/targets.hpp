// targets: runs a check on every vector target that this CPU has. Only for programs that link hwy.
// Which:   SSSE3, SSE4, AVX2, AVX3, and the target without vectors. That one is Highway's EMU128 (plain C++ in vectors of 16 bytes) or, where
//          the compiler is known to get it wrong (GCC before 12.3: HWY_BROKEN_EMU128, so Debian 12's 12.2), SCALAR: one lane.
#pragma once

#include <cstdint>
#include <cstdio>
#include <hwy/targets.h>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "engine/space/overlap_kernel.hpp"

namespace colony::testing {

/// The targets that must have been compiled in and be chosen on this CPU; asked of the CPU itself, not of Highway, so that a build which lost
/// one is found out. The features are those that Highway 1.0.3 asks for.
inline std::set<std::string> targets_of_this_cpu() {
  std::set<std::string> names = {HWY_BROKEN_EMU128 ? "SCALAR" : "EMU128"};
#if defined(__x86_64__)
  const bool ssse3 = __builtin_cpu_supports("ssse3");
  const bool sse4 = ssse3 && __builtin_cpu_supports("sse4.1") && __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("pclmul") &&
                    __builtin_cpu_supports("aes");
  const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("f16c") &&
                    __builtin_cpu_supports("lzcnt") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const bool avx3 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512cd");
  if (ssse3) names.insert("SSSE3");
  if (sse4) names.insert("SSE4");
  if (avx2) names.insert("AVX2");
  if (avx3) names.insert("AVX3");
#endif
  return names;
}

/// Calls check(name) with the kernels dispatched to each target in turn, and expects that all of this CPU's were among them.
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
  for (const std::string& name : targets_of_this_cpu()) EXPECT_TRUE(names.contains(name)) << "not compared: " << name << ", which this CPU has";
  EXPECT_GE(names.size(), 2U);  // else nothing was compared
}

}  // namespace colony::testing
