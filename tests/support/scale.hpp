// scale: how long the statistical tests run. COLONY_TEST_FULL=1 asks for the full sizes; reduced ones keep a check
// under seconds. Bands in the tests are standard errors or bounds that hold for both sizes.
#pragma once

#include <cstdlib>
#include <string_view>

namespace colony::testing {

inline bool full_run() {
  const char* value = std::getenv("COLONY_TEST_FULL");
  return value != nullptr && std::string_view(value) == "1";
}

template <class T>
T scaled(T reduced, T full) {
  return full_run() ? full : reduced;
}

}  // namespace colony::testing
